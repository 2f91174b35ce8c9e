// The scenes: what they are and where they are seen from.
#include <cmath>
#include <limits>
#include <numbers>
#include <utility>

#include "accuracy/scene.hpp"
#include "accuracy/shapes.hpp"
#include "accuracy/splash.hpp"
#include "accuracy/violent.hpp"
#include "meniscus/error.hpp"

namespace meniscus::accuracy {
namespace {

using Distance = std::function<double(const Vec3d&)>;

/// Water of these waves in a square basin of half width `half` and floor at z = -depth.
Distance basin(double half, double depth, const std::function<Level(const Vec3d&)>& level) {
  return [=](const Vec3d& p) {
    // The lid is far above all waves.
    return std::max(distance_to_zero(p, level),
                    box_distance(p - Vec3d{0, 0, 10 - depth}, {half, half, 10}));
  };
}

Distance wave_basin(std::vector<Wave> waves) {
  return basin(20, 5, [waves = std::move(waves)](const Vec3d& p) { return above_waves(p, waves); });
}

/// Two crossing waves, one of them with a bent crest.
Level above_bent_waves(const Vec3d& p) {
  constexpr double kLong = 1.3, kShort = 0.7;  // amplitudes, s
  constexpr double kx = 2 * std::numbers::pi / 12, ky = 2 * std::numbers::pi / 17;
  const double a = kx * p.x + 0.5 * std::sin(0.1 * p.y), b = ky * p.y + 0.3 * p.x;
  return {p.z - kLong * std::sin(a) - kShort * std::sin(b),
          {-kLong * kx * std::cos(a) - 0.3 * kShort * std::cos(b),
           -kLong * std::cos(a) * 0.05 * std::cos(0.1 * p.y) - kShort * ky * std::cos(b), 1}};
}

/// Four capsules in a raft: side by side they meet in creases of 30, 60 and 105 degrees. A fifth
/// lies across them, so that there are corners where three sheets meet.
double raft_distance(const Vec3d& p) {
  constexpr double kRadius = 7, kHalfLength = 9;  // s
  double nearest = capsule_distance(p, {-14, -5, 4}, {14, 3, 4}, 6);
  double x = -10.9;
  for (const double crease : {30, 60, 105, 0}) {
    nearest =
        std::min(nearest, capsule_distance(p, {x, -kHalfLength, 0}, {x, kHalfLength, 0}, kRadius));
    x += 2 * kRadius * std::sin(crease / 2 * std::numbers::pi / 180);
  }
  return nearest;
}

/// Corners of a polygon whose edges turn by 30, 45, 60 and 45 degrees along its upper side and by
/// right angles at its foot.
std::vector<std::array<double, 2>> roof() {
  std::vector<std::array<double, 2>> corners{{10, -7}, {10, 0}};
  double heading = 90;
  for (const double turn : {30, 45, 60}) {
    heading += turn;
    const double angle = heading * std::numbers::pi / 180;
    corners.push_back(
        {corners.back()[0] + 9 * std::cos(angle), corners.back()[1] + 9 * std::sin(angle)});
  }
  corners.push_back({corners.back()[0], -7});
  return corners;
}

/// A bent sheet whose thickness grows from 1.1 s to 2 s along x; it stands 14 s from its axis.
double sheet_distance(const Vec3d& p) {
  constexpr double kRadius = 14, kHalfLength = 10, kHalfAngle = 0.6;
  const double half_thickness = (1.55 + 0.45 * p.x / kHalfLength) / 2;
  const double from_axis = std::hypot(p.y, p.z);
  const double sides = std::abs(p.z) * std::cos(kHalfAngle) + p.y * std::sin(kHalfAngle);
  return std::max(
      {std::abs(from_axis - kRadius) - half_thickness, std::abs(p.x) - kHalfLength, sides});
}

/// A list of scenes that grows.
struct SceneList {
  std::vector<Scene> all;

  Scene& add(const char* name, Distance distance, Vec3d low, Vec3d high, Vec3d eye, double focal) {
    Scene& scene = all.emplace_back();
    scene.name = name;
    scene.distance = std::move(distance);
    scene.low = low;
    scene.high = high;
    scene.eye = eye;
    scene.focal = focal;
    return scene;
  }
  Scene& add_smooth(const char* name, Distance distance, Vec3d low, Vec3d high, Vec3d eye,
                    double focal) {
    Scene& scene = add(name, std::move(distance), low, high, eye, focal);
    scene.smooth = true;
    return scene;
  }
};

void add_round_solids(SceneList& scenes) {
  scenes.add_smooth(
      "sphere", [](const Vec3d& p) { return length(p) - 12; }, {-12, -12, -12}, {12, 12, 12},
      {30, -50, 25}, 900);
  scenes.add_smooth(
      "ellipsoid",
      [r = Rotation(0.4, 0.3, 0.5)](const Vec3d& p) {
        return ellipsoid_distance(r.local(p), {16, 10, 7});
      },
      {-16, -16, -16}, {16, 16, 16}, {20, -52, 28}, 920);
  scenes.add_smooth(
      "torus",
      [r = Rotation(0.9, 0.3, 0)](const Vec3d& p) {
        const Vec3d q = r.local(p);
        return std::hypot(std::hypot(q.x, q.y) - 14, q.z) - 5;
      },
      {-20, -20, -20}, {20, 20, 20}, {10, -60, 20}, 800);
  scenes.add_smooth(
      "bowl",
      [](const Vec3d& p) {
        return bowl_distance(p - Vec3d{0, 0, 5}, 14, 5);
      },
      {-17, -17, -12}, {17, 17, 8}, {12, -42, 44}, 860);
}

void add_water(SceneList& scenes) {
  constexpr double kWaveStep = 0.7;
  scenes.add(
      "plane",
      [r = Rotation(0.12, -0.17, 0.3)](const Vec3d& p) {
        return box_distance(r.local(p), {26, 26, 3});
      },
      {-40, -40, -14}, {40, 40, 14}, {10, -60, 42}, 780);
  scenes
      .add_smooth(
          "waves",
          [](const Vec3d& p) {
            return std::max(distance_to_zero(p, above_bent_waves), box_distance(p, {26, 26, 6}));
          },
          {-26, -26, -6}, {26, 26, 6}, {10, -60, 42}, 780)
      .safe_step = kWaveStep;
  scenes
      .add_smooth("longwaves", wave_basin({{26, 1.6, 0.5, 0.3}}), {-20, -20, -5}, {20, 20, 3},
                  {10, -52, 38}, 800)
      .safe_step = kWaveStep;
  scenes
      .add_smooth("shortwaves",
                  wave_basin({{6.5, 0.22, 0.2, 0}, {8, 0.3, 1.4, 1}, {10, 0.4, 2.5, 2}}),
                  {-20, -20, -5}, {20, 20, 2}, {-6, -52, 38}, 800)
      .safe_step = kWaveStep;
  scenes
      .add_smooth("mixedwaves", wave_basin({{30, 1.5, 0.9, 0}, {13, 0.6, 2, 1}, {7, 0.2, 0.1, 2}}),
                  {-20, -20, -5}, {20, 20, 3}, {14, -52, 38}, 800)
      .safe_step = kWaveStep;
  Scene& dam =
      scenes.add("dam", basin(17, 0, above_dam), {-17, -17, 0}, {17, 17, 12}, {42, -34, 30}, 740);
  dam.safe_step = kWaveStep;
  dam.target = {0, 0, 4};
}

void add_solids_with_edges(SceneList& scenes) {
  scenes.add(
      "box",
      [r = Rotation(0.6, 0.5, 0.35)](const Vec3d& p) {
        return box_distance(r.local(p), {9, 9, 9});
      },
      {-16, -16, -16}, {16, 16, 16}, {30, -50, 25}, 850);
  scenes.add(
      "notch",
      [r = Rotation(0.15, 0.1, 0.25)](const Vec3d& p) {
        const Vec3d q = r.local(p);
        return std::max(box_distance(q, {10, 10, 10}),
                        -box_distance(q - Vec3d{11, -11, 11}, {10, 10, 10}));
      },
      {-18, -18, -18}, {18, 18, 18}, {34, -44, 32}, 850);
  scenes.add(
      "prism",
      [r = Rotation(0, 0.49, 4.6), corners = roof()](const Vec3d& p) {
        return prism_distance(r.local(p), corners, 10);
      },
      {-20, -20, -16}, {20, 20, 16}, {16, -48, 36}, 920);
  scenes.add(
      "capsules",
      [r = Rotation(0.2, 0.1, 0.3)](const Vec3d& p) { return raft_distance(r.local(p)); },
      {-26, -26, -14}, {26, 26, 17}, {10, -48, 44}, 850);
}

void add_layered_scenes(SceneList& scenes) {
  scenes.add(
      "boxpool",
      [r = Rotation(0.25, 0.15, 0.5)](const Vec3d& p) {
        return std::min(box_distance(p - Vec3d{0, 0, -3}, {24, 24, 3}),
                        box_distance(r.local(p - Vec3d{0, 0, 2}), {7, 7, 7}));
      },
      {-24, -24, -10}, {24, 24, 14}, {15, -55, 38}, 760);
  scenes
      .add(
          "twolayer",
          [r = Rotation(0.5, -0.2, 0.4)](const Vec3d& p) {
            return std::min(box_distance(p - Vec3d{0, 0, -2.5}, {24, 24, 2.5}),
                            box_distance(r.local(p - Vec3d{3, -8, 14}), {10, 10, 1.5}));
          },
          {-24, -24, -5}, {24, 24, 26}, {15, -55, 38}, 740)
      .target = {0, 0, 2};
  scenes
      .add(
          "sheet",
          [r = Rotation(0.3, 0.1, 0.2)](const Vec3d& p) {
            return std::min(box_distance(p - Vec3d{0, 0, -2.5}, {22, 22, 2.5}),
                            sheet_distance(r.local(p - Vec3d{0, 6, 12})));
          },
          {-22, -22, -5}, {22, 22, 26}, {12, -55, 38}, 760)
      .target = {0, 0, 3};
}

void add_splash(SceneList& scenes) {
  Scene& splash = scenes.add_smooth(
      "splash",
      [](const Vec3d& p) {
        return distance_to_zero(p, [](const Vec3d& q) {
          return above_balls(q, {{{-3, 0, -3}, 9}, {{6, -3, 0}, 7}, {{-2, 3, 6}, 6}}, 5);
        });
      },
      {-13, -13, -13}, {14, 12, 13}, {26, -52, 22}, 900);
  splash.splash = make_splash(splash.distance);
}

std::vector<Scene> make_scenes() {
  SceneList scenes;
  add_round_solids(scenes);
  add_water(scenes);
  add_solids_with_edges(scenes);
  add_layered_scenes(scenes);
  add_splash(scenes);
  return std::move(scenes.all);
}

/// Depth below the faces of a convex solid: the largest of its planes' distances.
double tetrahedron_distance(const Vec3d& p, double inradius) {
  return std::max({p.x + p.y + p.z, p.x - p.y - p.z, -p.x + p.y - p.z, -p.x - p.y + p.z}) /
             std::numbers::sqrt3 -
         inradius;
}

double cylinder_distance(const Vec3d& p, double radius, double half_length) {
  return std::max(std::hypot(p.x, p.y) - radius, std::abs(p.z) - half_length);
}

/// Of this half angle at the tip, which is at the origin; its foot is at z = -height.
double cone_distance(const Vec3d& p, double half_angle, double height) {
  return std::max(std::hypot(p.x, p.y) * std::cos(half_angle) + p.z * std::sin(half_angle),
                  -height - p.z);
}

/// Three steps of 7 s along x.
double stairs_distance(const Vec3d& p) {
  double nearest = std::numeric_limits<double>::infinity();
  for (int k = 0; k < 3; ++k)
    nearest = std::min(nearest, box_distance(p - Vec3d{3.5 * k, 0, 3.5 * k - 7},
                                             {10.5 - 3.5 * k, 11, 3.5 + 3.5 * k}));
  return nearest;
}

// Solids that had no say in any constant. Each has an edge or a corner that the others have not.
std::vector<Scene> make_held_out_scenes() {
  std::vector<Scene> all;
  const Rotation turned(0.45, 0.35, 0.5), upright(0.2, 0.15, 0.3);
  const auto add = [&](const char* name, const Rotation& rotation, Distance distance, double reach,
                       Vec3d eye) -> Scene& {
    Scene& scene = all.emplace_back();
    scene.name = name;
    scene.distance = [=](const Vec3d& p) { return distance(rotation.local(p)); };
    scene.low = {-reach, -reach, -reach};
    scene.high = {reach, reach, reach};
    scene.eye = eye;
    scene.focal = 850;
    return scene;
  };
  const Vec3d aside{30, -50, 25}, far{36, -60, 30}, above{24, -44, 50};

  add(
      "cylinder", turned, [](const Vec3d& p) { return cylinder_distance(p, 9, 9); }, 14, aside);
  add(
      "cone", upright,
      [](const Vec3d& p) {
        return cone_distance(p - Vec3d{0, 0, 13}, 0.48, 26);
      },
      20, far)
      .smooth = true;
  add(
      "octahedron", turned,
      [](const Vec3d& p) {
        return (std::abs(p.x) + std::abs(p.y) + std::abs(p.z) - 16) / std::numbers::sqrt3;
      },
      17, aside);
  add("tetrahedron", turned, [](const Vec3d& p) { return tetrahedron_distance(p, 7); }, 22,
      {-58, -36, 30});
  add(
      "ring", turned,
      [](const Vec3d& p) {
        return std::max(std::abs(std::hypot(p.x, p.y) - 10) - 4, std::abs(p.z) - 5);
      },
      16, aside);
  add("stairs", upright, stairs_distance, 20, {-40, -48, 36});
  add(
      "slab", turned,
      [](const Vec3d& p) {
        return box_distance(p, {17, 15, 2});
      },
      23, far);
  add(
      "drilled", upright,
      [](const Vec3d& p) {
        return std::max(box_distance(p, {11, 11, 6}), 5 - std::hypot(p.x, p.y));
      },
      18, above);
  add(
      "lens", turned,
      [](const Vec3d& p) {
        return std::max(length(p - Vec3d{0, 0, 11}), length(p + Vec3d{0, 0, 11})) - 18;
      },
      16, aside)
      .smooth = true;
  add(
      "pit", upright,
      [](const Vec3d& p) {
        return std::max(box_distance(p, {12, 12, 6}), 9 - length(p - Vec3d{0, 0, 8}));
      },
      19, above);
  add("ballslab", upright,
      [](const Vec3d& p) {
        return std::min(box_distance(p + Vec3d{0, 0, 8}, {16, 14, 3}),
                        length(p - Vec3d{0, 0, 2}) - 7.5);
      },
      24, {28, -50, 40});
  return all;
}

}  // namespace

const std::vector<Scene>& scenes() {
  static const std::vector<Scene> all = make_scenes();
  return all;
}

const std::vector<Scene>& violent_scenes() {
  static const std::vector<Scene> all = make_violent_scenes();
  return all;
}

const std::vector<Scene>& held_out_scenes() {
  static const std::vector<Scene> all = make_held_out_scenes();
  return all;
}

const Scene& find_scene(std::string_view name) {
  std::string names;
  for (const auto* list : {&scenes(), &violent_scenes(), &held_out_scenes()})
    for (const Scene& scene : *list) {
      if (scene.name == name) return scene;
      names += (names.empty() ? "" : ", ") + scene.name;
    }
  throw InvalidArgument("scene: no scene is called '" + std::string(name) + "', there are " +
                        names);
}

std::vector<std::string> scenes_named(const std::vector<std::string>& words) {
  std::vector<std::string> names;
  for (const std::string& word : words) {
    const auto* const list = word == "calm"                ? &scenes()
                             : word == "held-out"          ? &held_out_scenes()
                             : word.starts_with("violent") ? &violent_scenes()
                                                           : nullptr;
    if (!list) {
      names.push_back(find_scene(word).name);
      continue;
    }
    const std::size_t before = names.size();
    for (const Scene& scene : *list)
      if (scene.use == Use::calm || word == "violent" ||
          word == (scene.use == Use::tuning ? "violent-tuning" : "violent-reporting"))
        names.push_back(scene.name);
    require(names.size() > before, "scene: '" + word +
                                       "' is no list of scenes, there are calm, held-out, violent, "
                                       "violent-tuning and violent-reporting");
  }
  return names;
}

}  // namespace meniscus::accuracy
