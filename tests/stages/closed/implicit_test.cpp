// The implicit function at points, on every device; verify's cases compare it with a loop in double
// precision.
#include "stages/closed/implicit.hpp"

#include <gtest/gtest.h>

#include "stages/stage_test_support.hpp"
#include "verify/stage_cases/fits_by_hand.hpp"
#include "verify/stage_cases/into_new.hpp"

namespace meniscus {
namespace {

using Implicit = OnDevice;

// Fits on the planes z = 0 and x = 0, whose fluid lies below or left of them: a quarter of space in
// particles, a radius inside.
struct Corner {
  GivenFits given;
  Projected particles;
  explicit Corner(bool concave) {
    for (int i = 0; i < 12; ++i)
      for (int j = -6; j <= 6; ++j) {
        const double out = concave ? 2 * i + 1.0 : -2 * i - 1.0;
        given.add({out, 2.0 * j, 0}, {0, 0, 1});
        given.add({0, 2.0 * j, out}, {1, 0, 0});
      }
    for (int i = -8; i < 8; ++i)
      for (int j = -8; j <= 8; ++j)
        for (int k = -8; k < 8; ++k) {
          const bool in_quarter = i < 0 && k < 0, out_quarter = i >= 0 && k >= 0;
          if (concave ? out_quarter : !in_quarter) continue;
          add_position(particles, Vec3d(2 * i + 1, 2 * j, 2 * k + 1));
        }
  }
  ImplicitFunction function(Device& device, const Parameters& params) const {
    const DeviceCells cells =
        upload_cells(device, make_cells(particles.x, particles.y, particles.z, kDensitySupport));
    return make_implicit(
        device,
        make_records(given.fits, given.trust, params.fit, kBlendReach * params.blend.radius),
        level_cells(device, cells, params.region), params);
  }
};

// Two planes meet in an edge that is as sharp as they are flat: F is the farther one's height where
// the edge is convex, the nearer one's where it is concave.
TEST_P(Implicit, TwoSheetsMeetInASharpEdge) {
  const Parameters params;
  for (const bool concave : {false, true}) {
    const ImplicitFunction function = Corner(concave).function(device_, params);
    Points points;
    for (int i = -4; i <= 4; ++i)
      for (int k = -4; k <= 4; ++k) points.add({0.3 * i, 0.1, 0.3 * k});
    const Levels found = measure_implicit(device_, function, points);
    for (std::size_t p = 0; p < points.size(); ++p) {
      const double x = points.x[p], z = points.z[p];
      const double expected = concave ? std::min(x, z) : std::max(x, z);
      // Farther out, and deeper in, the field takes over.
      if (expected < (concave ? -0.35 : -0.65) || expected > (concave ? 0.35 : 0.2)) continue;
      EXPECT_NEAR(found.value[p], expected, 1e-5)
          << (concave ? "concave " : "convex ") << x << ' ' << z;
      if (std::abs(x - z) < 1e-3) continue;
      const bool is_x = (x > z) != concave;
      EXPECT_NEAR(found.gradient[p].x, is_x ? 1 : 0, 1e-5);
      EXPECT_NEAR(found.gradient[p].z, is_x ? 0 : 1, 1e-5);
    }
  }
}

// Far outside F is above zero, deep inside below, whatever planes go on.
TEST_P(Implicit, KnowsOutsideFromInside) {
  const Parameters params;
  const ImplicitFunction function = Corner(false).function(device_, params);
  Points points;
  for (const Vec3d& at : {Vec3d{4, 0, -3}, {-3, 0, 4}, {30, 0, 0}, {2.5, 0, 2.5}, {1e6, 1e6, 1e6}})
    points.add(at);
  const std::size_t outside = points.size();
  for (const Vec3d& at : {Vec3d{-6, 0, -6}, {-2, 0, -3}, {-8, 4, -5}}) points.add(at);
  const Levels found = measure_implicit(device_, function, points);
  for (std::size_t p = 0; p < points.size(); ++p) {
    if (p < outside)
      EXPECT_GT(found.value[p], 0.5) << p;
    else
      EXPECT_LT(found.value[p], -0.5) << p;
  }
}

// Every width gives the same bits, whatever else is asked for at the same time.
TEST_P(Implicit, IsTheSameAtEveryWidthAndInAnyOrder) {
  const Parameters params;
  Random random(4);
  Points points;
  for (int k = 0; k < 333; ++k) points.add({random(-6, 3), random(-9, 9), random(-6, 3)});
  const Corner corner(true);
  std::vector<Levels> found;
  for (const int width : {1, 8}) {
    use_width(width);
    found.push_back(measure_implicit(device_, corner.function(device_, params), points));
  }
  EXPECT_EQ(found[0].value, found[1].value);
  EXPECT_EQ(found[0].gradient, found[1].gradient);
  Points turned;
  for (std::size_t p = points.size(); p-- > 0;) turned.add({points.x[p], points.y[p], points.z[p]});
  Levels back = measure_implicit(device_, corner.function(device_, params), turned);
  std::reverse(back.value.begin(), back.value.end());
  EXPECT_EQ(back.value, found[0].value);
}

TEST_P(Implicit, WithoutFitsIsTheField) {
  const Parameters params;
  Projected one;
  one.x = {0.5f};
  one.y = {0};
  one.z = {0};
  const DeviceCells cells = upload_cells(device_, make_cells(one.x, one.y, one.z, kDensitySupport));
  const ImplicitFunction function =
      make_implicit(device_, {}, level_cells(device_, cells, params.region), params);
  Points points;
  for (const double x : {0.5, 1.49, 1.51, 9.0}) points.add({x, 0, 0});
  const Levels found = measure_implicit(device_, function, points);
  EXPECT_LT(found.value[0], -1);
  EXPECT_LT(found.value[1], 0);
  EXPECT_GT(found.value[2], 0);
  EXPECT_GT(found.value[3], 0.5);
  EXPECT_NEAR(found.gradient[1].x, 1, 1e-6);
}

// Asked for its sign, it has that which it has without fits, and says how much of 1 the levelled
// field lacks: 1 away from all particles.
TEST_P(Implicit, AloneTheFieldSpeaks) {
  const Parameters params;
  const Corner corner(false);
  ImplicitFunction function = corner.function(device_, params);
  Points points;
  for (int i = -4; i <= 4; ++i)
    for (int k = -4; k <= 4; ++k) points.add({0.7 * i, 0.1, 0.7 * k});
  points.add({500, 0, 0});
  function.alone = true;
  const Levels alone = measure_implicit(device_, function, points);
  const Levels without =
      measure_implicit(device_, make_implicit(device_, {}, function.levelled, params), points);
  int inside = 0;
  for (std::size_t k = 0; k < points.size(); ++k) {
    EXPECT_EQ(alone.value[k] < 0, without.value[k] < 0) << k;
    EXPECT_LE(alone.value[k], 1) << k;
    inside += alone.value[k] < 0 ? 1 : 0;
  }
  EXPECT_GT(inside, 10);
  EXPECT_EQ(alone.value.back(), 1);
  EXPECT_TRUE(alone.gradient.empty());
}

MENISCUS_ON_EVERY_DEVICE(Implicit);

}  // namespace
}  // namespace meniscus
