// The velocity of the surface against a loop over all particles, on every device.
#include "stages/extras/motion.hpp"

#include <cstring>

#include "prepare/velocities.hpp"
#include "stages/stage_test_support.hpp"
#include "verify/reference/motion.hpp"
#include "verify/stage_cases/cases.hpp"

namespace meniscus {
namespace {

using Motion = OnDevice;
using reference::MovingParticle;

struct Fluid {
  Projected projected;
  std::vector<Vec3> velocity;

  void add(const Vec3& at, const Vec3& v) {
    add_position(projected, Vec3d(at));
    projected.index.push_back(static_cast<std::uint32_t>(velocity.size()));
    velocity.push_back(v);
  }
  std::vector<MovingParticle> known() const {
    std::vector<MovingParticle> all;
    for (std::size_t i = 0; i < velocity.size(); ++i)
      if (is_known(velocity[i])) all.push_back({projected.eye(i), Vec3d(velocity[i])});
    return all;
  }
};

Vec3 random_point(Random& random, double side) {
  return {static_cast<float>(random(-side, side)), static_cast<float>(random(-side, side)),
          static_cast<float>(random(-side, side) - 20)};
}

Fluid scattered(std::size_t n, double side, unsigned seed) {
  Random random(seed);
  Fluid fluid;
  for (std::size_t i = 0; i < n; ++i) {
    const Vec3 at = random_point(random, side);
    const Vec3 v{static_cast<float>(random(-5, 5)), static_cast<float>(random(2, 3)), 0};
    fluid.add(at, i % 7 == 3 ? kNoVelocity : v);
  }
  return fluid;
}

void expect_near(const Vec3& actual, const reference::Motion& expected) {
  const double off = reference::motion_error(expected, 0);
  EXPECT_NEAR(actual.x, expected.velocity.x, off);
  EXPECT_NEAR(actual.y, expected.velocity.y, off);
  EXPECT_NEAR(actual.z, expected.velocity.z, off);
}

TEST_P(Motion, MatchesTheReference) {
  for (const std::size_t n : {1, 65, 700, 900})
    for (const Camera& camera : {perspective_camera(45, 31), orthographic_camera(24, 16)})
      expect_within(verify::motion_errors(device_, n, 777, camera));
}

// More particles at one place than are taken together.
TEST_P(Motion, ManyParticlesAtOnePlaceAllCount) {
  Fluid fluid;
  Random random(4);
  for (int k = 0; k < 1000; ++k)
    fluid.add({1, 2, -9}, {static_cast<float>(random(-1, 1)), 0, static_cast<float>(k)});
  const std::vector<Vec3d> points{{1, 2, -9}, {2, 2.5, -8}, {0, 0, -9}};
  const auto actual =
      motion_of_points(device_, upload_moving(device_, fluid.projected, fluid.velocity), points);
  for (std::size_t k = 0; k < points.size(); ++k)
    expect_near(actual[k], reference::motion(fluid.known(), points[k]));
}

// Where the nearest particle is far, the mean is over more of them, as far as anything goes.
TEST_P(Motion, FarPointsMatchTheReferenceToo) {
  const Fluid fluid = scattered(50, 3, 8);
  const auto known = fluid.known();
  std::vector<Vec3d> points;
  for (const double far : {3.1, 6.0, 7.9, 50.0, 1000.0, 1e6})
    points.push_back(Vec3d(static_cast<Vec3>(Vec3d{far, -0.3 * far, -20 + 0.1 * far})));
  const auto actual =
      motion_of_points(device_, upload_moving(device_, fluid.projected, fluid.velocity), points);
  for (std::size_t k = 0; k < points.size(); ++k) {
    const reference::Motion expected = reference::motion(known, points[k]);
    // Settled in double precision and rounded to float.
    EXPECT_NEAR(actual[k].x, expected.velocity.x, 2 * kEpsilon * 5);
    EXPECT_NEAR(actual[k].y, expected.velocity.y, 2 * kEpsilon * 5);
  }
}

TEST_P(Motion, EveryWidthGivesTheSameBitsAtSamples) {
  for (const Camera& camera : {perspective_camera(45, 31), orthographic_camera(24, 16)}) {
    const View view = make_view(camera, 0.5, {0, 0, 0});
    const Fluid fluid = scattered(700, 8, 5);
    const SampleGrid grid = pixel_grid(view);
    std::vector<float> depth(grid.size(), kNoSurface);
    Random random(6);
    for (std::size_t s = 0; s < grid.size(); ++s)  // a slope with a jump, holes and loose samples
      if (s % 11 != 0 && s % grid.nx < 40)
        depth[s] = static_cast<float>(s % 13 == 0 ? random(10, 40) : 15 + s % grid.nx * 0.3);
    const MovingParticles moving = upload_moving(device_, fluid.projected, fluid.velocity);
    const auto all = [&](int width) {
      use_width(width);
      return motion_of_samples(device_, view, moving, grid, depth);
    };
    const std::vector<Vec3> one = all(1), eight = all(8);
    EXPECT_EQ(std::memcmp(one.data(), eight.data(), grid.size() * sizeof(Vec3)), 0);
  }
}

TEST_P(Motion, EveryWidthGivesTheSameBitsAtPoints) {
  const Fluid fluid = scattered(3000, 9, 3);
  const MovingParticles moving = upload_moving(device_, fluid.projected, fluid.velocity);
  Random random(1);
  std::vector<Vec3d> points;
  for (int k = 0; k < 2001; ++k) points.push_back(Vec3d(random_point(random, 10)));
  std::vector<Vec3> first;
  for (const int width : {1, 8}) {
    use_width(width);
    const auto actual = motion_of_points(device_, moving, points);
    if (first.empty()) first = actual;
    EXPECT_EQ(std::memcmp(actual.data(), first.data(), first.size() * sizeof(Vec3)), 0) << width;
  }
}

// A step of 1/512 radius from among the particles to far outside. The nearest particle's weight is
// at least (7/16)^4 = .037, and no weight changes faster than .5 d (1 - d^2/16)^3 < .48 per radius
// (the widened support only slows it), so that each of two particles moves the mean by less than
// .48 / .037 = 13 times their difference per radius. Taking the nearest instead would jump by all
// of it.
TEST_P(Motion, IsContinuousEverywhere) {
  Fluid fluid;
  fluid.add({0, 0, -20}, {1, 0, 0});
  fluid.add({1.5f, 3, -20}, {0, 0, 0});
  std::vector<Vec3d> points;
  for (int k = 0; k < 20000; ++k) points.push_back({-20 + k / 512.0, 1.4 + k / 5000.0, -20});
  const auto v =
      motion_of_points(device_, upload_moving(device_, fluid.projected, fluid.velocity), points);
  double least = 1, most = 0;
  for (std::size_t k = 1; k < v.size(); ++k) {
    EXPECT_LT(std::abs(v[k].x - v[k - 1].x), 2 * 13 / 512.0) << k;
    least = std::min<double>(least, v[k].x);
    most = std::max<double>(most, v[k].x);
  }
  EXPECT_LT(least, 0.2);
  EXPECT_GT(most, 0.8);
}

TEST_P(Motion, WhatMovesAlikeMovesTheSurfaceAlike) {
  Fluid fluid = scattered(800, 8, 9);
  for (Vec3& v : fluid.velocity) v = {-7, 0, 1e-3f};
  Random random(2);
  std::vector<Vec3d> points;
  for (int k = 0; k < 500; ++k) points.push_back(Vec3d(random_point(random, 15)));
  const auto known = fluid.known();
  const auto actual =
      motion_of_points(device_, upload_moving(device_, fluid.projected, fluid.velocity), points);
  for (std::size_t k = 0; k < points.size(); ++k) {
    // Sums of terms of one sign round once a particle at most.
    const double relative = (2 * reference::motion(known, points[k]).count + 5) * kEpsilon;
    EXPECT_NEAR(actual[k].x, -7, 7 * relative);
    EXPECT_EQ(actual[k].y, 0);
    EXPECT_NEAR(actual[k].z, 1e-3, 1e-3 * relative + 1e-10);
  }
}

TEST_P(Motion, WithoutAnyKnownVelocityNothingMoves) {
  Fluid fluid;
  fluid.add({0, 0, -20}, kNoVelocity);
  for (const Fluid& each : {fluid, Fluid{}}) {
    const MovingParticles moving = upload_moving(device_, each.projected, each.velocity);
    EXPECT_EQ(motion_of_points(device_, moving, {{0, 0, -20}}), std::vector<Vec3>(1));
    const View view = make_view(perspective_camera(9, 7), 1, {});
    EXPECT_EQ(
        motion_of_samples(device_, view, moving, pixel_grid(view), std::vector<float>(63, 12.0f)),
        std::vector<Vec3>(63));
    EXPECT_TRUE(motion_of_points(device_, moving, {}).empty());
  }
}

TEST_P(Motion, RefusesAMapOfAnotherSize) {
  const View view = make_view(perspective_camera(9, 7), 1, {});
  const MovingParticles moving = upload_moving(device_, {}, {});
  EXPECT_THROW(motion_of_samples(device_, view, moving, pixel_grid(view), std::vector<float>(62)),
               InvalidArgument);
}

MENISCUS_ON_EVERY_DEVICE(Motion);

}  // namespace
}  // namespace meniscus
