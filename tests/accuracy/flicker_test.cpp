// Steadiness from frame to frame.
#include "accuracy/figures/flicker.hpp"

#include <gtest/gtest.h>

#include <cfloat>
#include <cmath>
#include <vector>

#include "accuracy/synthetic.hpp"
#include "meniscus/error.hpp"

namespace meniscus::accuracy {
namespace {

// A float holds a depth below 16 s to half of 2^-20 s; a change has two of them.
constexpr double kFloat = 16 * FLT_EPSILON;

Map at_depth(double depth) {
  Map map = map_of(whole_wall());
  for (float& d : map.depth) d = static_cast<float>(depth);
  return map;
}

TEST(Flicker, IsTheChangeOfTheError) {
  const std::vector<Truth> truths(3, whole_wall());
  EXPECT_EQ(flicker(truths, std::vector<Map>(3, at_depth(kWall + 0.25))).rms, 0);
  const std::vector<Map> maps{at_depth(kWall), at_depth(kWall + 0.125), at_depth(kWall)};
  EXPECT_NEAR(flicker(truths, maps).rms, 0.125, kFloat);
  EXPECT_NEAR(flicker(truths, maps).p999, 0.125, kFloat);
}

TEST(Flicker, OneTruthHoldsForAllFrames) {
  const std::vector<Truth> truth{whole_wall()};
  const std::vector<Map> maps{at_depth(kWall), at_depth(kWall + 0.5), at_depth(kWall + 0.5)};
  EXPECT_NEAR(flicker(truth, maps).rms, 0.5 / std::sqrt(2), kFloat) << "one of two steps";
  EXPECT_THROW(flicker(std::vector<Truth>(2, whole_wall()), maps), InvalidArgument);
}

TEST(Flicker, PopsShowInThePercentile) {
  const std::vector<Truth> truth{whole_wall()};
  std::vector<Map> maps(2, at_depth(kWall));
  // 50 of 32,000 pixels are more than one in a thousand; 20 are fewer.
  for (int k = 0; k < 20; ++k) maps[1].depth[7 * k] += 1;
  EXPECT_EQ(flicker(truth, maps).p999, 0);
  for (int k = 0; k < 50; ++k) maps[1].depth[7 * k] = kWall + 1;
  EXPECT_EQ(flicker(truth, maps).p999, 1);
}

TEST(SecondDifference, VelocityDoesNotCountAndAccelerationDoes) {
  EXPECT_NEAR(second_difference(std::vector<Map>{at_depth(9), at_depth(9.25), at_depth(9.5)}).rms,
              0, 0);
  const std::vector<Map> maps{at_depth(9), at_depth(9.25), at_depth(9.625), at_depth(9.875)};
  EXPECT_NEAR(second_difference(maps).rms, 0.125, kFloat);
  EXPECT_NEAR(second_difference(maps).p999, 0.125, kFloat);
}

TEST(SecondDifference, GrazingRaysDoNotMagnifyWhatIsAlongTheNormal) {
  const Lens lens = whole_wall().lens;
  std::vector<Map> maps{at_depth(9), at_depth(9.25), at_depth(9.625)};
  const std::size_t middle =
      static_cast<std::size_t>(lens.height / 2) * lens.width + lens.width / 2;
  for (Map& map : maps) {
    map.normal.assign(map.depth.size(), Vec3{});
    map.normal[middle] = static_cast<Vec3>(-lens.forward);
  }
  const double along = dot(lens.direction(lens.width / 2, lens.height / 2), lens.forward);
  EXPECT_NEAR(second_difference_along_normal(lens, maps).rms, 0.125 * along, kFloat);
  // A surface that leans by 60 degrees.
  maps[1].normal[middle] = static_cast<Vec3>(0.5 * -lens.forward + std::sqrt(0.75) * lens.right);
  const double half =
      std::abs(dot(Vec3d(maps[1].normal[middle]), lens.direction(lens.width / 2, lens.height / 2)));
  EXPECT_NEAR(half, 0.5, 0.05);
  EXPECT_NEAR(second_difference_along_normal(lens, maps).rms, 0.125 * half, kFloat);
  maps[1].normal[middle] = Vec3{};
  EXPECT_TRUE(std::isnan(second_difference_along_normal(lens, maps).rms));
  maps[2].normal.pop_back();
  EXPECT_THROW(second_difference_along_normal(lens, maps), InvalidArgument);
}

TEST(SecondDifference, OtherLayersAndGapsDoNotCount) {
  std::vector<Map> maps{at_depth(9), at_depth(9), at_depth(9)};
  maps[1].depth[5] = 12;
  maps[2].depth[6] = static_cast<float>(kNothing);
  EXPECT_EQ(second_difference(maps).rms, 0);
  EXPECT_TRUE(std::isnan(second_difference(std::vector<Map>(2, at_depth(9))).rms));
  maps[0].depth.pop_back();
  EXPECT_THROW(second_difference(maps), InvalidArgument);
}

}  // namespace
}  // namespace meniscus::accuracy
