// Boxes that fill space and take no more than they may.
#include "stages/closed/share_space.hpp"

#include <gtest/gtest.h>

#include <algorithm>

namespace meniscus {
namespace {

// A row of cubes of two blocks with ten points each.
CubeCounts row(std::int32_t cubes) {
  CubeCounts counts;
  counts.blocks = 2;
  for (std::int32_t i = 0; i < cubes; ++i) counts.cubes.push_back({{i, 0, 0}, 10});
  return counts;
}

// How many boxes hold the block.
std::int64_t holding(const std::vector<BlockBox>& boxes, const std::array<std::int32_t, 3>& block) {
  return std::ranges::count_if(boxes, [&](const BlockBox& box) { return box.holds(block); });
}

TEST(ShareSpace, NothingIsCutThatHasRoom) {
  const std::vector<BlockBox> boxes =
      share_space(row(8), {.memory = 80, .bytes = 1, .block = 1, .thinnest = 2});
  ASSERT_EQ(boxes.size(), 1u);
  EXPECT_TRUE(boxes[0].holds({-1000, 1000, 1000}));
}

TEST(ShareSpace, EveryBlockIsInOneBoxWithRoom) {
  const std::vector<BlockBox> boxes =
      share_space(row(8), {.memory = 20, .bytes = 1, .block = 1, .thinnest = 2});
  EXPECT_EQ(boxes.size(), 4u);
  for (std::int32_t x = -3; x < 20; ++x) EXPECT_EQ(holding(boxes, {x, -5, 7}), 1) << x;
  for (const BlockBox& box : boxes) {
    int own = 0;
    for (std::int32_t cube = 0; cube < 8; ++cube) own += box.holds({2 * cube, 0, 0}) ? 10 : 0;
    EXPECT_EQ(own, 20);
  }
}

// What is around a box counts too: here as much as is in it.
TEST(ShareSpace, ACutThatSavesLittleIsLeftOut) {
  const Sharing sharing{.memory = 20, .bytes = 1, .block = 1, .halo = 16, .thinnest = 2};
  EXPECT_EQ(share_space(row(8), sharing).size(), 1u);
}

TEST(ShareSpace, NoBoxIsThinnerThanItMayBe) {
  const Sharing sharing{.memory = 0, .bytes = 1, .block = 1, .thinnest = 7};  // four cubes
  EXPECT_EQ(share_space(row(8), sharing).size(), 2u);
  EXPECT_EQ(share_space(row(7), sharing).size(), 1u);
}

TEST(ShareSpace, ThereAreAsManyBoxesAsWanted) {
  EXPECT_EQ(share_space(row(8), {.memory = 80, .bytes = 1, .thinnest = 2, .least = 3}).size(), 3u);
}

// A box may begin and end within cubes.
TEST(ShareSpace, ABoxIsCutWithinItsSides) {
  BlockBox own;
  own.low[0] = 3;
  own.high[0] = 13;
  const std::vector<BlockBox> boxes =
      share_space(row(8), {.memory = 0, .bytes = 1, .block = 1, .thinnest = 2}, own);
  EXPECT_GT(boxes.size(), 2u);
  for (std::int32_t x = -3; x < 20; ++x)
    EXPECT_EQ(holding(boxes, {x, 0, 0}), x >= 3 && x < 13 ? 1 : 0) << x;
}

TEST(ShareSpace, PointsAreCountedInCubes) {
  CubeCounter counter(2);
  for (const double x : {-0.1, 0.0, 1.9, 2.0}) counter.add({x, 0, 5});
  std::vector<CubeCounts::Cube> cubes = counter.cubes();
  std::ranges::sort(cubes, {}, [](const CubeCounts::Cube& cube) { return cube.at; });
  ASSERT_EQ(cubes.size(), 3u);
  EXPECT_EQ(cubes[0].at, (std::array<std::int32_t, 3>{-1, 0, 2}));
  EXPECT_EQ(cubes[1].count, 2);
  EXPECT_EQ(cubes[2].at[0], 1);
}

}  // namespace
}  // namespace meniscus
