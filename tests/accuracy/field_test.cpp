// Solids on grids, and the threads that they are made of.
#include "accuracy/field.hpp"

#include <gtest/gtest.h>

#include <cmath>

#include "accuracy/random.hpp"
#include "accuracy/scene.hpp"

namespace meniscus::accuracy {
namespace {

const Vec3d kLow{-9, -9, -9}, kHigh{9, 9, 9};

std::function<double(const Vec3d&)> ball(double radius) {
  return [=](const Vec3d& p) { return length(p - Vec3d{0.13, 0.07, -0.21}) - radius; };
}

/// The largest difference at points up to `reach` from the surface, away from the grid's border and
/// from x > 2.
double worst_error(const Field& field, const std::function<double(const Vec3d&)>& distance,
                   double reach) {
  Random random(1);
  double worst = 0;
  for (int k = 0; k < 20000; ++k) {
    const Vec3d p = random.in_box({-7, -7, -7}, {2, 7, 7});
    if (std::abs(distance(p)) < reach) worst = std::max(worst, std::abs(field(p) - distance(p)));
  }
  return worst;
}

TEST(Field, InterpolatesQuadraticsExactlyAndGoesOnOutside) {
  // The Catmull-Rom cubic reproduces quadratics; at the border it lacks a node.
  const auto f = [](const Vec3d& p) { return 0.5 + p.x - 2 * p.y + 0.1 * p.x * p.z + p.y * p.y; };
  const Field field = sampled(f, kLow, kHigh);
  Random random(2);
  for (int k = 0; k < 1000; ++k) {
    const Vec3d p = random.in_box({-8, -8, -8}, {8, 8, 8});
    // Values below 128 as floats, weighed by at most 1.25^3 in sum.
    EXPECT_NEAR(field(p), f(p), 2 * 0x1p-18);
    EXPECT_NEAR(field.level(p).value, field(p), 1e-12);
    EXPECT_NEAR(field.level(p).gradient.x, 1 + 0.1 * p.z, 1e-4);
    EXPECT_NEAR(field.level(p).gradient.y, -2 + 2 * p.y, 1e-4);
  }
  const Vec3d last = field.node(field.count[0] - 1, 20, 20);
  EXPECT_NEAR(field(last + Vec3d{5, 0, 0}), field(last) + 5, 1e-12);
}

TEST(Field, DistancesAreThoseToTheZero) {
  // Steeper and less steep: the function's own values are no distances.
  const auto f = [](const Vec3d& p) { return ball(4)(p) * (1.25 + 0.5 * std::sin(p.x / 2)); };
  const Field distance = distances(sampled(f, kLow, kHigh));
  // Where the function turns the cubic between nodes is off by h^3 / 12 times its third derivative,
  // which is below 1.
  EXPECT_LT(worst_error(distance, ball(4), 1), 0.064 / 12);
  EXPECT_NEAR(distance({0.13, 0.07, -0.21}), -kBand, 0.01);
  EXPECT_NEAR(distance({8.8, 8.8, 8.8}), kBand, 1e-6);
}

TEST(Field, OpeningTakesAwayWhatIsThin) {
  const auto f = [](const Vec3d& p) {
    return std::min({ball(4)(p), capsule_distance(p, {0, 0, 0}, {8, 0, 0}, 0.8),
                     length(p - Vec3d{-6, -6, -6}) - 0.9});
  };
  const Field open = opened(distances(sampled(f, kLow, kHigh)), 1);
  // Of the thread remains what a ball reaches at its foot, 0.4 s at most.
  EXPECT_LT(worst_error(open, ball(4), 0.5), 0.064 / 12);
  EXPECT_GT(open({6.5, 0, 0}), 1.5);
  EXPECT_GT(open({-6, -6, -6}), 1);
}

TEST(Field, BlurKeepsPlanesAndShrinksBallsByTheirCurvature) {
  constexpr double kSigma = 0.3, kRadius = 4;  // s
  const auto plane = [](const Vec3d& p) { return 0.6 * p.x + 0.8 * p.z - 1; };
  EXPECT_LT(worst_error(blurred(sampled(plane, kLow, kHigh), kSigma), plane, 1), 1e-5);
  // The mean of a distance grows by sigma^2 / 2 times its Laplacian, 2 / r.
  const Field shrunk = blurred(sampled(ball(kRadius), kLow, kHigh), kSigma);
  EXPECT_LT(worst_error(shrunk, ball(kRadius - kSigma * kSigma / kRadius), 0.1), 0.064 / 12);
}

TEST(Thread, IsTheHullOfItsBeads) {
  const std::vector<Bead> beads{{{0, 0, 0}, 2}, {{6, 0, 0}, 1}};
  EXPECT_NEAR(thread_distance({-5, 0, 0}, beads), 3, 1e-12);
  EXPECT_NEAR(thread_distance({9, 0, 0}, beads), 2, 1e-12);
  // Against the union of many balls between the two.
  Random random(3);
  for (int k = 0; k < 200; ++k) {
    const Vec3d p = random.in_box({-4, -5, -5}, {9, 5, 5});
    double nearest = 1e9;
    for (double t = 0; t <= 1; t += 1e-3)
      nearest = std::min(nearest, length(p - Vec3d{6 * t, 0, 0}) - (2 - t));
    EXPECT_NEAR(thread_distance(p, beads), nearest, 5e-3) << "balls lie 6e-3 s apart";
  }
  EXPECT_EQ(thread_distance({0, 0, 5}, {{{0, 0, 0}, 2}}), 3);
  EXPECT_NEAR(thread_distance({0, 0, 5}, {{{0, 0, 0}, 1}, {{0, 0, 0.5}, 3}}), 1.5, 1e-12)
      << "one ball holds the other";
}

TEST(Melted, IsTheUnionAwayFromWhereBothAreNear) {
  EXPECT_EQ(melted(1, 3, 1.5), 1);
  EXPECT_EQ(melted(3, 1, 1.5), 1);
  EXPECT_DOUBLE_EQ(melted(1, 1, 1.5), 1 - 1.5 / 4);
}

}  // namespace
}  // namespace meniscus::accuracy
