// The measuring instrument itself: scenes, particles, truth and figures.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <numbers>

#include "accuracy/figures.hpp"
#include "accuracy/particles.hpp"
#include "accuracy/scene.hpp"
#include "accuracy/truth.hpp"
#include "meniscus/camera.hpp"
#include "meniscus/error.hpp"
#include "stages/view.hpp"

namespace meniscus::accuracy {
namespace {

constexpr float kInfinity = std::numeric_limits<float>::infinity();

/// A float holds a depth below 128 s to half of 2^-17 s.
constexpr double kFloatDepth = 0x1p-18;

Map shifted(Map map, double by) {
  for (float& depth : map.depth) depth += static_cast<float>(by);
  return map;
}

/// A quarter of the pixels of the scene's camera are enough here.
Lens small_lens(const Scene& scene, bool orthographic = false) {
  Lens lens = lens_of(scene, orthographic);
  lens.width /= 2;
  lens.height /= 2;
  lens.focal /= 2;
  return lens;
}

const Truth& truth_of(const std::string& name) {
  static std::map<std::string, Truth> traced;
  if (!traced.contains(name))
    traced.emplace(name, trace(find_scene(name), small_lens(find_scene(name))));
  return traced.at(name);
}

/// A pixel in the middle of the largest interior: the one farthest from everything else.
std::size_t deepest_interior_pixel(const Truth& truth) {
  std::vector<bool> other(truth.depth.size());
  for (std::size_t p = 0; p < other.size(); ++p)
    other[p] = truth.class_of[p] != PixelClass::interior;
  const auto distance = distance_to(other, truth.lens.width, truth.lens.height);
  return std::max_element(distance.begin(), distance.end()) - distance.begin();
}

TEST(AccuracyScene, LensIsTheLibrarysCamera) {
  for (const Scene& scene : scenes())
    for (const bool orthographic : {false, true}) {
      const Lens lens = lens_of(scene, orthographic, 0.25);
      const Camera camera = camera_of(lens);
      ASSERT_NO_THROW(check(camera)) << scene.name;
      const View view = make_view(camera, kParticleRadius, {1, 2, 3});
      for (const auto& [i, j] : {std::pair{0, 0}, {639, 479}, {100, 350}}) {
        const double depth = 61;
        const Vec3d eye = eye_from_world(view, lens.point(i, j, depth));
        // Coordinates below 200 through ten or so operations in double precision.
        EXPECT_NEAR(-eye.z * kParticleRadius, depth, 1e-11) << scene.name;
        EXPECT_NEAR(project(view, eye).u, i + 0.5, 1e-9) << scene.name;
        EXPECT_NEAR(project(view, eye).v, j + 0.5, 1e-9) << scene.name;
      }
    }
}

TEST(AccuracyScene, VolumesAreTheClosedForms) {
  // A ramp of width h over the surface adds h^2/4R^2 of a ball's volume (h = 0.125 s, R = 12 s:
  // 3e-5). The ramp is h wide along the normal, while a cube reaches up to sqrt(3) h: sampling adds
  // a random part of the 1.2e5 cubes cut, each off by at most h^3, which is below 1e-4.
  EXPECT_NEAR(volume(find_scene("sphere")) / (4 * std::numbers::pi / 3 * 12 * 12 * 12), 1, 2e-4);
  EXPECT_NEAR(volume(find_scene("torus")) / (2 * std::numbers::pi * std::numbers::pi * 14 * 25), 1,
              2e-4);
  // The ramp around an edge loses at most h^2 of cross-section, along 12 edges of 18 s: 4e-4.
  EXPECT_NEAR(volume(find_scene("box")) / (18 * 18 * 18), 1, 6e-4);
}

TEST(AccuracyScene, UnknownNameIsRefusedWithTheNamesThereAre) {
  EXPECT_THROW(
      {
        try {
          find_scene("ball");
        } catch (const InvalidArgument& error) {
          EXPECT_THAT(error.what(), testing::HasSubstr("'ball'"));
          EXPECT_THAT(error.what(), testing::HasSubstr("sphere, ellipsoid, torus"));
          throw;
        }
      },
      InvalidArgument);
}

class AccuracyParticles : public testing::TestWithParam<const char*> {};

TEST_P(AccuracyParticles, FillTheVolumeAtHalfASpacingBelowTheSurface) {
  const Scene& scene = find_scene(GetParam());
  const auto points = fill(scene, 1);
  EXPECT_EQ(points.size(), static_cast<std::size_t>(std::llround(volume(scene))));
  double shallowest = -1e9;
  for (const Vec3d& p : points) shallowest = std::max(shallowest, scene.distance(p));
  // Each of up to 40 pushes leaves at most the cosine of an edge's angle of the excess; waves meet
  // their wall at 50 degrees or more: 0.65^40 < 2^-20.
  EXPECT_LE(shallowest, -0.5 + 0x1p-20);
  EXPECT_GE(shallowest, -0.5 - 1e-2) << "no particle lies at the surface";
}

INSTANTIATE_TEST_SUITE_P(Scenes, AccuracyParticles, testing::Values("sphere", "waves", "twolayer"),
                         [](const auto& info) { return std::string(info.param); });

TEST(AccuracyParticles, RelaxedPointsKeepApart) {
  const auto points = fill(find_scene("box"), 3);
  double nearest = 1e9;
  for (std::size_t i = 0; i < points.size(); ++i)
    for (std::size_t j = 0; j < i; ++j) {
      const Vec3d d = points[i] - points[j];
      nearest = std::min(nearest, dot(d, d));
    }
  // 900 of the 5832 points are dropped at random: unrelaxed, the nearest pair is below 0.1 s.
  EXPECT_GT(std::sqrt(nearest), 0.5);
}

TEST(AccuracyParticles, SeedDecidesAll) {
  const Scene& scene = find_scene("sphere");
  const Particles a = make_particles(scene, 0.05, 7), b = make_particles(scene, 0.05, 7);
  EXPECT_EQ(a.x, b.x);
  EXPECT_EQ(a.y, b.y);
  EXPECT_EQ(a.z, b.z);
  EXPECT_NE(a.x, make_particles(scene, 0.05, 8).x);
  EXPECT_EQ(a.particle_radius, 0.5);
}

TEST(AccuracyParticles, NoiseHasItsStandardDeviation) {
  constexpr int n = 100000;
  std::vector<Vec3d> points(n);
  add_noise(points, 0.05, 11);
  double sum = 0, square = 0;
  for (const Vec3d& p : points) {
    sum += p.x + p.y + p.z;
    square += dot(p, p);
  }
  // Five standard deviations of the mean and of the variance of 3n normal numbers.
  EXPECT_NEAR(sum / (3 * n), 0, 5 * 0.05 / std::sqrt(3. * n));
  EXPECT_NEAR(square / (3 * n), 0.05 * 0.05, 5 * 0.05 * 0.05 * std::sqrt(2 / (3. * n)));
}

TEST(AccuracyTruth, SphereIsTheClosedForm) {
  for (const bool orthographic : {false, true}) {
    const Lens lens = small_lens(find_scene("sphere"), orthographic);
    const Truth truth = trace(find_scene("sphere"), lens);
    double worst = 0, worst_normal = 0;
    int other_mask = 0;
    for (int j = 0; j < lens.height; ++j)
      for (int i = 0; i < lens.width; ++i) {
        const std::size_t p = static_cast<std::size_t>(j) * lens.width + i;
        const Vec3d o = lens.origin(i, j), d = lens.direction(i, j);
        const double a = dot(d, d), b = dot(o, d), root = b * b - a * (dot(o, o) - 144);
        if (truth.covered(p) != (root >= 0)) ++other_mask;
        if (root < 0 || !truth.covered(p)) continue;
        const double depth = (-b - std::sqrt(root)) / a;
        worst = std::max(worst, std::abs(truth.depth[p] - depth));
        worst_normal =
            std::max(worst_normal, length(truth.normal[p] - normalized(lens.point(i, j, depth))));
      }
    EXPECT_LT(worst, 1e-4);
    EXPECT_LT(worst_normal, 1e-4);
    EXPECT_EQ(other_mask, 0);
  }
}

TEST(AccuracyTruth, OutlineReachesOneAndAHalfSpacings) {
  const Lens lens = small_lens(find_scene("sphere"), /*orthographic=*/true);
  const Truth truth = trace(find_scene("sphere"), lens);
  const double border = (12 - 1.5) * lens.focal;  // pixels from the centre of the disc
  for (int j = 0; j < lens.height; ++j)
    for (int i = 0; i < lens.width; ++i) {
      const double radius = std::hypot(i + 0.5 - lens.width / 2., j + 0.5 - lens.height / 2.);
      const PixelClass found = truth.class_of[static_cast<std::size_t>(j) * lens.width + i];
      // Outline pixels lie up to a pixel's diagonal inside the outline.
      if (std::abs(radius - border) < std::numbers::sqrt2 || radius > 12 * lens.focal - 1) continue;
      EXPECT_EQ(found, radius < border ? PixelClass::interior : PixelClass::silhouette);
    }
}

TEST(AccuracyTruth, CreaseReachesOneAndAHalfSpacings) {
  // The pool's upper edge on the camera's side: y = -24, z = 0. On the screen nothing is farther
  // from it than in space.
  const Truth& truth = truth_of("twolayer");
  const Lens& lens = truth.lens;
  int near_edge = 0, crease = 0;
  for (int j = 0; j < lens.height; ++j)
    for (int i = 0; i < lens.width; ++i) {
      const std::size_t p = static_cast<std::size_t>(j) * lens.width + i;
      if (!truth.covered(p)) continue;
      const Vec3d point = lens.point(i, j, truth.depth[p]);
      const double two_pixels = 2 / lens.scale(truth.depth[p]);
      if (std::abs(point.x) > 20 || std::hypot(point.y + 24, point.z) > 1.5 - two_pixels) continue;
      ++near_edge;
      crease += truth.class_of[p] == PixelClass::crease;
      EXPECT_NE(truth.class_of[p], PixelClass::interior) << i << ", " << j;
    }
  EXPECT_GT(2 * crease, near_edge) << "the plate's outline covers less than half of the edge";
  EXPECT_GT(near_edge, 0);
}

TEST(AccuracyTruth, DistanceIsToTheNearestPixelOfTheSet) {
  constexpr int width = 23, height = 17;
  std::vector<bool> set(width * height);
  const std::vector<std::array<int, 2>> members{{3, 2}, {20, 15}, {11, 16}};
  for (const auto& [x, y] : members) set[y * width + x] = true;
  const auto distance = distance_to(set, width, height);
  for (int y = 0; y < height; ++y)
    for (int x = 0; x < width; ++x) {
      double best = 1e9;
      for (const auto& m : members) best = std::min(best, std::hypot(x - m[0], y - m[1]));
      // Both are roots of the same integer.
      EXPECT_DOUBLE_EQ(distance[y * width + x], best);
    }
  for (const double d : distance_to(std::vector<bool>(width * height), width, height))
    EXPECT_TRUE(std::isinf(d));
}

TEST(AccuracyFigures, PerfectMapHasNoError) {
  for (const char* name : {"plane", "sphere", "box"}) {
    const Figures f = compare(truth_of(name), map_of(truth_of(name)));
    EXPECT_LE(f.normal_rms, kFloatDepth) << name;
    EXPECT_LE(f.normal_p95, kFloatDepth) << name;
    EXPECT_LE(f.depth_rms, kFloatDepth) << name;
    EXPECT_LE(f.outline_rms, kFloatDepth) << name;
    EXPECT_EQ(f.outliers, 0) << name;
    EXPECT_EQ(f.iou, 1) << name;
    EXPECT_EQ(f.outline_miss, 0) << name;
    EXPECT_EQ(f.holes, 0) << name;
    EXPECT_EQ(f.specks, 0) << name;
    // Unit vectors of floats: each component good to 2^-25.
    EXPECT_LE(f.angle_p95, 0x1p-24 * 180 / std::numbers::pi) << name;
    EXPECT_EQ(f.outline_jag, 0) << name;
    EXPECT_EQ(f.outline_lost, 0) << name;
    EXPECT_TRUE(std::isnan(f.flicker)) << name;
  }
  EXPECT_TRUE(std::isnan(compare(truth_of("sphere"), map_of(truth_of("sphere"))).crease_rms));
  // On a plane differences are exact but for the float depths: 2 kFloatDepth over two pixels of
  // at least 1/10 s.
  EXPECT_LE(compare(truth_of("plane"), map_of(truth_of("plane"))).slope_p95,
            2 * kFloatDepth / (2 / 10.) * std::numbers::sqrt2 * 180 / std::numbers::pi);
}

TEST(AccuracyFigures, ShiftedMapHasExactlyTheShift) {
  const Scene& scene = find_scene("plane");
  const Truth truth = trace(scene, small_lens(scene, /*orthographic=*/true));
  const Figures f = compare(truth, shifted(map_of(truth), 0.25));
  double square = 0, sum = 0, count = 0;
  for (std::size_t p = 0; p < truth.depth.size(); ++p)
    if (truth.class_of[p] == PixelClass::interior) {
      const double along = 0.25 * std::abs(dot(truth.normal[p], truth.lens.forward));
      square += along * along;
      sum += along;
      ++count;
    }
  EXPECT_NEAR(f.depth_rms, 0.25, 2 * kFloatDepth);
  EXPECT_NEAR(f.normal_rms, std::sqrt(square / count), 2 * kFloatDepth);
  EXPECT_NEAR(f.normal_bias, sum / count, 2 * kFloatDepth);
  // Over 95 % of the interior is the slab's upper face, which has one normal.
  const Vec3d face = truth.normal[deepest_interior_pixel(truth)];
  EXPECT_NEAR(f.normal_p95, 0.25 * std::abs(dot(face, truth.lens.forward)), 2 * kFloatDepth);
  EXPECT_NEAR(f.crease_rms, 0.25, 2 * kFloatDepth);
  EXPECT_NEAR(f.outline_rms, 0.25, 2 * kFloatDepth);
  EXPECT_EQ(f.iou, 1);
  EXPECT_EQ(f.outliers, 0);
  const Figures behind = compare(truth, shifted(map_of(truth), 5));
  EXPECT_NEAR(behind.depth_rms, 2, 0) << "errors are clamped to 2 s";
  EXPECT_EQ(behind.outliers, 100);
}

// The perfect map, but with the normals of every so many rows turned.
Map tilted_map(const Truth& truth, double degrees, std::size_t every) {
  Map map = map_of(truth);
  for (std::size_t p = 0; p < map.normal.size(); ++p) {
    const Vec3d n = truth.normal[p];
    if (n == Vec3d{} || p / truth.lens.width % every != 0) continue;
    const Vec3d side = normalized(cross(n, {0.3, 0.8, 0.5}));
    map.normal[p] =
        static_cast<Vec3>(std::cos(degrees * kDegree) * n + std::sin(degrees * kDegree) * side);
  }
  return map;
}

TEST(AccuracyFigures, TiltedNormalsHaveTheirAngle) {
  const Truth& truth = truth_of("plane");
  const Map map = tilted_map(truth, 3, 1);
  const Figures f = compare(truth, map);
  const double rounding = 0x1p-23 / kDegree;  // of two unit vectors of floats
  EXPECT_NEAR(f.angle_median, 3, rounding);
  EXPECT_NEAR(f.angle_p95, 3, rounding);
  EXPECT_NEAR(f.crease_angle, 3, rounding);
}

TEST(AccuracyFigures, HolesSpecksAndMaskAreCounted) {
  const Truth& truth = truth_of("box");
  const int width = truth.lens.width;
  const std::size_t middle = deepest_interior_pixel(truth);
  Map map = map_of(truth);
  const auto megapixels = static_cast<double>(map.depth.size()) / 1e6;
  const auto covered =
      std::count_if(map.depth.begin(), map.depth.end(), [](float d) { return d < kInfinity; });

  map.depth[middle] = kInfinity;  // one pixel is missing: a hole and a speck
  Figures f = compare(truth, map);
  EXPECT_EQ(f.holes, 1);
  EXPECT_DOUBLE_EQ(f.specks, 1 / megapixels);
  EXPECT_DOUBLE_EQ(f.iou, static_cast<double>(covered - 1) / covered);

  for (int k = 0; k < 9; ++k) map.depth[middle + k] = kInfinity;  // too long for a speck
  f = compare(truth, map);
  EXPECT_EQ(f.holes, 1);
  EXPECT_EQ(f.specks, 0);

  map.depth[middle + 10 * width] -= 3;  // a pixel in front, two behind, one outside
  map.depth[middle + 12 * width] += 3;
  map.depth[middle + 12 * width + 1] += 3;
  map.depth[5 * width + 5] = 60;
  f = compare(truth, map);
  EXPECT_EQ(f.holes, 1);
  EXPECT_DOUBLE_EQ(f.specks, 3 / megapixels);
}

TEST(AccuracyFigures, JumpIsTheAngleBetweenNeighboursBeyondTheTruths) {
  const Truth& truth = truth_of("plane");
  // Every 25th row: 2 of 50 pairs, far more than one in a thousand.
  const Map map = tilted_map(truth, 7, 25);
  EXPECT_NEAR(compare(truth, map).jump_p999, 7, 0x1p-23 / kDegree);
  // The sphere's own normals turn from pixel to pixel, which is no jump.
  EXPECT_LE(compare(truth_of("sphere"), map_of(truth_of("sphere"))).jump_p999, 0x1p-23 / kDegree);
}

TEST(AccuracyFigures, OtherSizeIsRefused) {
  Map map = map_of(truth_of("sphere"));
  map.depth.pop_back();
  EXPECT_THROW(compare(truth_of("sphere"), map), InvalidArgument);
}

TEST(AccuracyFigures, MeanLeavesOutWhatIsNotMeasured) {
  Figures a, b;
  a.normal_rms = 1;
  b.normal_rms = 2;
  b.crease_rms = 4;
  const std::vector<Figures> both{a, b};
  const Figures m = mean(both);
  EXPECT_EQ(m.normal_rms, 1.5);
  EXPECT_EQ(m.crease_rms, 4);
  EXPECT_TRUE(std::isnan(m.flicker));
}

}  // namespace
}  // namespace meniscus::accuracy
