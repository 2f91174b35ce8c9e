// Water that moves: where its points are, and how steady errors are along them.
#include "accuracy/motion.hpp"

#include <gtest/gtest.h>

#include <cfloat>

#include "accuracy/figures/flicker.hpp"
#include "accuracy/random.hpp"
#include "accuracy/synthetic.hpp"
#include "meniscus/error.hpp"

namespace meniscus::accuracy {
namespace {

const Vec3d kCentre{1, -2, 3};

Vec3d some_point(Random& random) { return random.in_box({-30, -30, -30}, {30, 30, 30}); }

TEST(Motion, BackUndoesForth) {
  Random random(1);
  for (const Motion& motion : {rigid_motion(kCentre), smooth_bend()})
    for (int k = 0; k < 100; ++k) {
      const Vec3d p = some_point(random);
      EXPECT_LT(length(motion.forth(p, 0) - p), 1e-13);
      for (const int frame : {1, 3}) {
        const Vec3d there = motion.forth(p, frame);
        EXPECT_LT(length(motion.back(there, frame) - p), 1e-13);
        EXPECT_GT(length(there - p), 0);
        EXPECT_LT(length(there - p), 0.15 * frame) << "a small step: 45 s from the centre .144 s";
      }
    }
}

TEST(Motion, RigidKeepsDistancesAndTheBendKeepsVolumes) {
  Random random(2);
  constexpr double h = 1e-4;  // s
  for (int k = 0; k < 100; ++k) {
    const Vec3d p = some_point(random), q = some_point(random);
    const Motion rigid = rigid_motion(kCentre), bend = smooth_bend();
    EXPECT_NEAR(length(rigid.forth(p, 3) - rigid.forth(q, 3)), length(p - q), 1e-12);
    const auto slope = [&](const Vec3d& d) {
      return (bend.forth(p + h * d, 3) - bend.forth(p - h * d, 3)) / (2 * h);
    };
    const Vec3d x = slope({1, 0, 0}), y = slope({0, 1, 0}), z = slope({0, 0, 1});
    EXPECT_NEAR(dot(x, cross(y, z)), 1, 1e-8) << "differences: h^2 and rounding over h";
    for (const Vec3d& side : {x, y, z}) EXPECT_NEAR(length(side), 1, 3 * 0.02);
  }
}

TEST(Motion, TruthGoesWithTheParticles) {
  Scene scene;
  scene.distance = [](const Vec3d& p) { return length(p - Vec3d{5, 6, 7}) - 4; };
  Particles particles;
  particles.x = {9};
  particles.y = {6};
  particles.z = {7};
  for (const Motion& motion : {rigid_motion(kCentre), smooth_bend()}) {
    const Particles there = moved(particles, motion, 2);
    EXPECT_NE(there.x[0], 9);
    EXPECT_NEAR(moved(scene, motion, 2).distance({there.x[0], there.y[0], there.z[0]}), 0,
                16 * FLT_EPSILON);
  }
}

/// Sideways by 0.05 s a frame, 0.8 pixels.
Motion sideways() {
  const Vec3d step{0.05, 0, 0};
  return {[=](const Vec3d& p, int frame) { return p + frame * step; },
          [=](const Vec3d& p, int frame) { return p - frame * step; }};
}

/// The wall's map with an error that grows by 0.1 to the right, its zero moved by `shift` pixels.
Map slanted(double shift) {
  Map map = map_of(wall([](int, int) { return true; }, PixelClass::interior));
  for (int y = 0; y < kHeight; ++y)
    for (int x = 0; x < kWidth; ++x)
      map.depth[pixel(x, y)] += static_cast<float>(0.1 * (x - shift) / kScale);
  return map;
}

TEST(FlickerAlongPoints, ErrorsThatGoWithTheWaterAreSteady) {
  const std::vector<Truth> truths(3, wall([](int, int) { return true; }, PixelClass::interior));
  // Floats below 16 s, two of them, between the pixels.
  constexpr double kFloat = 16 * FLT_EPSILON;
  const double step = 0.05 * kScale;  // pixels
  const std::vector<Map> along{slanted(0), slanted(step), slanted(2 * step)};
  EXPECT_NEAR(flicker(truths, along, sideways()).p999, 0, kFloat);
  EXPECT_NEAR(flicker(truths, along).rms, 0.1 * 0.05, kFloat) << "at the pixels it is not";
  const std::vector<Map> stuck(3, slanted(0));
  EXPECT_NEAR(flicker(truths, stuck, sideways()).rms, 0.1 * 0.05, kFloat);
  EXPECT_NEAR(flicker(truths, stuck, sideways()).p999, 0.1 * 0.05, kFloat);
}

TEST(FlickerAlongPoints, OtherLayersAndGapsDoNotCount) {
  std::vector<Truth> truths(2, wall([](int, int) { return true; }, PixelClass::interior));
  std::vector<Map> maps(2, map_of(truths[0]));
  maps[1].depth[pixel(20, 20)] = static_cast<float>(kNothing);
  truths[1].depth[pixel(40, 40)] += 3;  // another layer has come in front of the point
  maps[1].depth[pixel(40, 40)] += 3.5f;
  EXPECT_EQ(flicker(truths, maps, sideways()).rms, 0);
  maps.pop_back();
  EXPECT_THROW(flicker(truths, maps, sideways()), InvalidArgument);
}

}  // namespace
}  // namespace meniscus::accuracy
