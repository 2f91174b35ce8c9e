#include "accuracy/scene.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "accuracy/random.hpp"
#include "meniscus/error.hpp"

namespace meniscus::accuracy {
namespace {

/// Rotation by angles about x, then y, then z (radians); rows are the rotated axes.
struct Rotation {
  Vec3d x, y, z;
  Rotation(double about_x, double about_y, double about_z) {
    const auto turned = [&](Vec3d v) {
      const double cx = std::cos(about_x), sx = std::sin(about_x);
      v = {v.x, cx * v.y - sx * v.z, sx * v.y + cx * v.z};
      const double cy = std::cos(about_y), sy = std::sin(about_y);
      v = {cy * v.x + sy * v.z, v.y, cy * v.z - sy * v.x};
      const double cz = std::cos(about_z), sz = std::sin(about_z);
      return Vec3d{cz * v.x - sz * v.y, sz * v.x + cz * v.y, v.z};
    };
    x = turned({1, 0, 0});
    y = turned({0, 1, 0});
    z = turned({0, 0, 1});
  }
  /// World -> the rotated body's own axes.
  Vec3d local(const Vec3d& v) const { return {dot(x, v), dot(y, v), dot(z, v)}; }
};

double box_distance(const Vec3d& p, const Vec3d& half) {
  const Vec3d q{std::abs(p.x) - half.x, std::abs(p.y) - half.y, std::abs(p.z) - half.z};
  const Vec3d outside{std::max(q.x, 0.0), std::max(q.y, 0.0), std::max(q.z, 0.0)};
  return length(outside) + std::min(std::max({q.x, q.y, q.z}), 0.0);
}

/// Two crossing waves above a box. The height over the surface is divided by the slope there,
/// which is a distance to first order.
double waves_distance(const Vec3d& p) {
  constexpr double kLong = 1.3, kShort = 0.7;  // amplitudes, s
  constexpr double kx = 2 * std::numbers::pi / 12, ky = 2 * std::numbers::pi / 17;
  const double a = kx * p.x + 0.5 * std::sin(0.1 * p.y), b = ky * p.y + 0.3 * p.x;
  const double height = kLong * std::sin(a) + kShort * std::sin(b);
  const double slope_x = kLong * kx * std::cos(a) + 0.3 * kShort * std::cos(b);
  const double slope_y =
      kLong * std::cos(a) * 0.05 * std::cos(0.1 * p.y) + kShort * ky * std::cos(b);
  const double above = (p.z - height) / std::sqrt(1 + slope_x * slope_x + slope_y * slope_y);
  return std::max(above, box_distance(p, {26, 26, 6}));
}

std::vector<Scene> make_scenes() {
  std::vector<Scene> all;
  const auto add = [&](const char* name, std::function<double(const Vec3d&)> distance, Vec3d low,
                       Vec3d high, Vec3d eye, double focal) -> Scene& {
    Scene& scene = all.emplace_back();
    scene.name = name;
    scene.distance = std::move(distance);
    scene.low = low;
    scene.high = high;
    scene.eye = eye;
    scene.focal = focal;
    return scene;
  };
  add(
      "sphere", [](const Vec3d& p) { return length(p) - 12; }, {-12, -12, -12}, {12, 12, 12},
      {30, -50, 25}, 900)
      .smooth = true;
  add(
      "torus",
      [r = Rotation(0.9, 0.3, 0)](const Vec3d& p) {
        const Vec3d q = r.local(p);
        return std::hypot(std::hypot(q.x, q.y) - 14, q.z) - 5;
      },
      {-20, -20, -20}, {20, 20, 20}, {10, -60, 20}, 800)
      .smooth = true;
  add(
      "plane",
      [r = Rotation(0.12, -0.17, 0.3)](const Vec3d& p) {
        return box_distance(r.local(p), {26, 26, 3});
      },
      {-40, -40, -14}, {40, 40, 14}, {10, -60, 42}, 780);
  Scene& waves = add("waves", waves_distance, {-26, -26, -6}, {26, 26, 6}, {10, -60, 42}, 780);
  waves.safe_step = 0.7;
  waves.smooth = true;
  add(
      "box",
      [r = Rotation(0.6, 0.5, 0.35)](const Vec3d& p) {
        return box_distance(r.local(p), {9, 9, 9});
      },
      {-16, -16, -16}, {16, 16, 16}, {30, -50, 25}, 850);
  add(
      "boxpool",
      [r = Rotation(0.25, 0.15, 0.5)](const Vec3d& p) {
        return std::min(box_distance(p - Vec3d{0, 0, -3}, {24, 24, 3}),
                        box_distance(r.local(p - Vec3d{0, 0, 2}), {7, 7, 7}));
      },
      {-24, -24, -10}, {24, 24, 14}, {15, -55, 38}, 760);
  add(
      "twolayer",
      [r = Rotation(0.5, -0.2, 0.4)](const Vec3d& p) {
        return std::min(box_distance(p - Vec3d{0, 0, -2.5}, {24, 24, 2.5}),
                        box_distance(r.local(p - Vec3d{3, -8, 14}), {10, 10, 1.5}));
      },
      {-24, -24, -5}, {24, 24, 26}, {15, -55, 38}, 740)
      .target = {0, 0, 2};
  return all;
}

/// Volume inside a cube: cubes that the surface cannot reach count whole or not at all, the others
/// are split; the smallest count by the share that lies behind the tangent plane.
double volume_in(const Scene& scene, const Vec3d& low, double side) {
  constexpr double kSmallest = 0.125;  // s
  const double half = side / 2;
  const double distance = scene.distance(low + Vec3d{half, half, half});
  if (std::abs(distance) * scene.safe_step > half * std::numbers::sqrt3)
    return distance < 0 ? side * side * side : 0;
  if (side <= kSmallest) return side * side * side * std::clamp(0.5 - distance / side, 0.0, 1.0);
  double sum = 0;
  for (int k = 0; k < 8; ++k)
    sum += volume_in(scene, low + half * Vec3d(k & 1, (k >> 1) & 1, k >> 2), half);
  return sum;
}

}  // namespace

const std::vector<Scene>& scenes() {
  static const std::vector<Scene> all = make_scenes();
  return all;
}

const Scene& find_scene(const std::string& name) {
  std::string names;
  for (const Scene& scene : scenes()) {
    if (scene.name == name) return scene;
    names += (names.empty() ? "" : ", ") + scene.name;
  }
  throw InvalidArgument("scene: no scene is called '" + name + "', there are " + names);
}

Scene posed(Scene scene, std::uint64_t seed) {
  if (seed == 1) return scene;
  constexpr double kTurn = std::numbers::pi / 6, kRise = std::numbers::pi / 36;
  Random random(~seed * 3);  // another stream than the filling's and the noise's
  const double turn = random.uniform(-kTurn, kTurn), rise = random.uniform(-kRise, kRise);
  const Vec3d arm = scene.eye - scene.target;
  const double flat = std::hypot(arm.x, arm.y), distance = length(arm);
  const double heading = std::atan2(arm.y, arm.x) + turn, height = std::atan2(arm.z, flat) + rise;
  scene.eye =
      scene.target + distance * Vec3d{std::cos(height) * std::cos(heading),
                                      std::cos(height) * std::sin(heading), std::sin(height)};
  return scene;
}

Scene scaled(Scene scene, double scale) {
  constexpr int kWidest = 960;  // pixels
  const double factor = scale * length(scene.eye - scene.target) / scene.focal;
  scene.focal *= factor;
  // Multiples of four keep the shape of 4 : 3 exactly.
  scene.width = 4 * static_cast<int>(std::lround(std::min(factor * scene.width, 1. * kWidest) / 4));
  scene.height = scene.width * 3 / 4;
  return scene;
}

Scene moved_back(Scene scene, double factor) {
  scene.eye = scene.target + factor * (scene.eye - scene.target);
  scene.focal *= factor;
  return scene;
}

Vec3d outward(const Scene& scene, const Vec3d& p) {
  constexpr double h = 1e-4;  // s; differences are then good to about 1e-8
  const auto& f = scene.distance;
  return normalized({f(p + Vec3d{h, 0, 0}) - f(p - Vec3d{h, 0, 0}),
                     f(p + Vec3d{0, h, 0}) - f(p - Vec3d{0, h, 0}),
                     f(p + Vec3d{0, 0, h}) - f(p - Vec3d{0, 0, h})});
}

double volume(const Scene& scene) {
  const Vec3d extent = scene.high - scene.low;
  double side = 1;
  while (side < std::max({extent.x, extent.y, extent.z})) side *= 2;
  return volume_in(scene, scene.low, side);
}

Vec3d Lens::origin(int i, int j) const {
  if (!orthographic) return eye;
  return eye + right * ((i + 0.5 - 0.5 * width) / focal) +
         down * ((j + 0.5 - 0.5 * height) / focal);
}

Vec3d Lens::direction(int i, int j) const {
  if (orthographic) return forward;
  return forward + right * ((i + 0.5 - 0.5 * width) / focal) +
         down * ((j + 0.5 - 0.5 * height) / focal);
}

std::optional<std::size_t> Lens::pixel(const Vec3d& point) const {
  const Vec3d from_eye = point - eye;
  const double depth = dot(from_eye, forward);
  if (!(depth > 0)) return std::nullopt;
  const double x = std::floor(0.5 * width + dot(from_eye, right) * scale(depth));
  const double y = std::floor(0.5 * height + dot(from_eye, down) * scale(depth));
  if (!(x >= 0 && y >= 0 && x < width && y < height)) return std::nullopt;
  return static_cast<std::size_t>(y) * width + static_cast<std::size_t>(x);
}

Lens lens_of(const Scene& scene, bool orthographic, double shift) {
  Lens lens;
  lens.width = scene.width;
  lens.height = scene.height;
  const double distance = length(scene.target - scene.eye);
  lens.forward = (scene.target - scene.eye) / distance;
  lens.right = normalized(cross(lens.forward, {0, 0, 1}));
  lens.down = cross(lens.forward, lens.right);
  lens.eye = scene.eye + shift * lens.right;
  lens.orthographic = orthographic;
  lens.focal = orthographic ? scene.focal / distance : scene.focal;
  return lens;
}

Camera camera_of(const Lens& lens) {
  constexpr double kNear = 1, kFar = 1000;  // s
  const Vec3d &r = lens.right, &d = lens.down, &f = lens.forward, &e = lens.eye;
  Camera camera;
  camera.width = lens.width;
  camera.height = lens.height;
  camera.view = {r.x,  r.y,  r.z,  -dot(r, e),  //
                 -d.x, -d.y, -d.z, dot(d, e),   //
                 -f.x, -f.y, -f.z, dot(f, e),   //
                 0,    0,    0,    1};
  const double x = 2 * lens.focal / lens.width, y = 2 * lens.focal / lens.height;
  const double span = kFar - kNear;
  if (lens.orthographic)
    camera.projection = {x, 0, 0,         0,  //
                         0, y, 0,         0,  //
                         0, 0, -2 / span, -(kFar + kNear) / span,
                         0, 0, 0,         1};
  else
    camera.projection = {x,
                         0,
                         0,
                         0,  //
                         0,
                         y,
                         0,
                         0,  //
                         0,
                         0,
                         -(kFar + kNear) / span,
                         -2 * kFar * kNear / span,
                         0,
                         0,
                         -1,
                         0};
  return camera;
}

}  // namespace meniscus::accuracy
