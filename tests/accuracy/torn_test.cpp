// Torn, rough and averted surfaces, and how their rims are shaded.
#include <gtest/gtest.h>

#include <cfloat>
#include <cmath>

#include "accuracy/figures.hpp"
#include "accuracy/synthetic.hpp"

namespace meniscus::accuracy {
namespace {

constexpr double kRounding = FLT_EPSILON / kDegree;  // degrees, of two unit vectors of floats
constexpr double kPixels = kWidth * kHeight;

TEST(Torn, CountsGapsAndTheirNeighbours) {
  const Truth truth = whole_wall();
  Map map = map_of(truth);
  EXPECT_EQ(torn_share(truth, map), 0);
  map.depth[pixel(50, 60)] = static_cast<float>(kNothing);
  EXPECT_DOUBLE_EQ(torn_share(truth, map), 100 * 5 / kPixels);
  map.depth[pixel(50, 60)] = kWall + 3;
  EXPECT_DOUBLE_EQ(torn_share(truth, map), 100 * 5 / kPixels);
  map.depth[pixel(0, 0)] = kWall - 3;
  EXPECT_DOUBLE_EQ(torn_share(truth, map), 100 * (5 + 3) / kPixels);
}

TEST(Torn, CountsJumpsThatTheTruthHasNot) {
  const Truth truth = whole_wall();
  Map map = map_of(truth);
  for (int y = 0; y < kHeight; ++y)
    for (int x = 0; x < kWidth; ++x) map.depth[pixel(x, y)] += x < 40 ? -0.75f : 0.75f;
  EXPECT_DOUBLE_EQ(torn_share(truth, map), 100. * 2 * kHeight / kPixels) << "no error is over s";
  for (float& depth : map.depth) depth = kWall + 1.5f;
  EXPECT_EQ(torn_share(truth, map), 100);
}

TEST(Torn, LeavesOutRims) {
  EXPECT_TRUE(std::isnan(
      torn_share(whole_wall(PixelClass::silhouette), map_of(whole_wall(PixelClass::silhouette)))));
  Truth truth = whole_wall();
  truth.class_of[pixel(50, 60)] = PixelClass::silhouette;
  truth.class_of[pixel(51, 60)] = PixelClass::crease;
  Map map = map_of(truth);
  map.depth[pixel(50, 60)] = static_cast<float>(kNothing);
  EXPECT_DOUBLE_EQ(torn_share(truth, map), 100 * 4 / (kPixels - 1));
}

TEST(Rough, IsTheMeanTurnBeyondTheTruths) {
  const Truth truth = whole_wall();
  Map map = map_of(truth);
  EXPECT_EQ(compare(truth, map).rough, 0);
  for (int y = 0; y < kHeight; ++y)
    for (int x = 1; x < kWidth; x += 2) map.normal[pixel(x, y)] = turned(2);
  const double across = (kWidth - 1.) * kHeight, down = kWidth * (kHeight - 1.);
  const Figures f = compare(truth, map);
  EXPECT_NEAR(f.rough, 2 * across / (across + down), kRounding);
  EXPECT_NEAR(f.jump_p999, 2, kRounding);
}

TEST(RimAngle, IsTheMedianNearOutlines) {
  const Truth rim = whole_wall(PixelClass::silhouette), inside = whole_wall();
  Map map = map_of(rim);
  for (Vec3& normal : map.normal) normal = turned(3);
  EXPECT_NEAR(compare(rim, map).rim_angle, 3, kRounding);
  EXPECT_TRUE(std::isnan(compare(inside, map).rim_angle));
}

TEST(Averted, CountsCoveredPixelsThatDoNotFaceTheEye) {
  const Truth truth = whole_wall();
  Map map = map_of(truth);
  EXPECT_EQ(compare(truth, map).averted, 0);
  map.normal[7] = turned(100);
  map.normal[8] = {1, 0, 0};
  map.normal[9] = {};
  map.normal[10] = turned(180);
  map.depth[10] = static_cast<float>(kNothing);
  EXPECT_EQ(compare(truth, map).averted, 3) << "what is not covered does not count";
  map.normal.clear();
  EXPECT_TRUE(std::isnan(compare(truth, map).averted));
}

}  // namespace
}  // namespace meniscus::accuracy
