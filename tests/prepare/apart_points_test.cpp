// Points of which no two lie nearer than a distance.
#include "prepare/apart_points.hpp"

#include <gtest/gtest.h>

#include "stages/stage_test_support.hpp"

namespace meniscus {
namespace {

// A cloud of voxels, and a point near each of them, at most a side outside its voxel.
struct Cloud {
  explicit Cloud(double across, int many) {
    Random random(3);
    VoxelGrid grid(1, {0, 0, 0});
    std::vector<VoxelGrid::Particle> particles;
    for (int k = 0; k < many; ++k)
      particles.push_back({static_cast<float>(random(-across, across)),
                           static_cast<float>(random(-across, across)),
                           static_cast<float>(random(-across, across)), false});
    grid.add(particles);
    voxels = grid.voxels();
    for (const VoxelGrid::Voxel& voxel : voxels)
      points.push_back(grid.along_axes(grid.mean(voxel)) +
                       Vec3d{random(-.9, .9), random(-.9, .9), random(-.9, .9)});
  }
  std::vector<VoxelGrid::Voxel> voxels;
  std::vector<Vec3d> points;
};

TEST(VoxelBlocks, HaveEveryVoxelOnceAndKnowTheirNeighbours) {
  const Cloud cloud(20, 3000);
  const VoxelBlocks blocks(cloud.voxels);
  ASSERT_GT(blocks.size(), 100u);
  EXPECT_EQ(blocks.first.front(), 0u);
  EXPECT_EQ(blocks.first.back(), cloud.voxels.size());
  int known = 0;
  for (std::size_t b = 0; b < blocks.size(); ++b) {
    EXPECT_EQ(blocks.around[b][13], b);
    for (std::uint32_t v = blocks.first[b]; v < blocks.first[b + 1]; ++v)
      for (std::size_t a = 0; a < 3; ++a) {
        const std::int64_t within = place_of(cloud.voxels[v].key)[a] - blocks.place[b][a];
        EXPECT_GE(within, 0);
        EXPECT_LT(within, kVoxelBlock);
      }
    for (std::size_t k = 0; k < 27; ++k) {
      const std::uint32_t there = blocks.around[b][k];
      if (there == KeyTable::kNone) continue;
      ++known;
      EXPECT_EQ(blocks.around[there][26 - k], b);
      EXPECT_EQ(blocks.place[there][0] - blocks.place[b][0],
                kVoxelBlock * (static_cast<std::int64_t>(k) % 3 - 1));
    }
  }
  EXPECT_GT(known, 10 * static_cast<int>(blocks.size()));
  std::size_t all = 0;
  for (const auto& apart : blocks.colour) {
    all += apart.size();
    for (const std::uint32_t a : apart)
      for (const std::uint32_t b : apart)
        for (std::size_t k = 0; k < 27; ++k)
          EXPECT_TRUE(a == b || blocks.around[a][k] != b);  // two of a colour never touch
  }
  EXPECT_EQ(all, blocks.size());
}

// Against a plain loop over all points kept before.
TEST(ApartPoints, KeepsWhatAPlainLoopKeeps) {
  for (const double distance : {0.65, 0.95}) {
    const Cloud cloud(8, 6000);
    const VoxelBlocks blocks(cloud.voxels);
    ApartPoints apart(blocks, cloud.points.size());
    std::vector<Vec3d> kept;
    int wrong = 0;
    for (const auto& colour : blocks.colour)  // one after the other
      for (const std::uint32_t block : colour)
        for (std::uint32_t v = blocks.first[block]; v < blocks.first[block + 1]; ++v) {
          bool expected = true;
          for (const Vec3d& other : kept)
            expected = expected && length(other - cloud.points[v]) >= distance;
          wrong += apart.is_apart(block, cloud.points[v], distance) != expected;
          if (!expected) continue;
          apart.keep(block, cloud.points[v], v);
          kept.push_back(cloud.points[v]);
        }
    EXPECT_EQ(wrong, 0) << distance;
    EXPECT_GT(kept.size(), 500u);
    EXPECT_LT(kept.size(), 0.9 * static_cast<double>(cloud.points.size()));
  }
}

TEST(ApartPoints, KeepTheSameOnEveryThread) {
  const Cloud cloud(30, 60000);
  const VoxelBlocks blocks(cloud.voxels);
  const auto kept_by = [&](unsigned threads) {
    std::vector<char> kept(cloud.points.size());
    ApartPoints apart(blocks, cloud.points.size());
    on_threads(threads, [&] {
      for_blocks_apart(blocks, [&](std::size_t block) {
        for (std::uint32_t v = blocks.first[block]; v < blocks.first[block + 1]; ++v) {
          if (!apart.is_apart(block, cloud.points[v], 0.75)) continue;
          apart.keep(block, cloud.points[v], v);
          kept[v] = 1;
        }
      });
    });
    return kept;
  };
  const std::vector<char> one = kept_by(1);
  for (const unsigned threads : {2u, 7u}) EXPECT_EQ(kept_by(threads), one) << threads;
}

// Far from the grid's origin, where places end.
TEST(ApartPoints, StraysDoNoHarm) {
  VoxelGrid grid(1, {0, 0, 0});
  grid.add({{3e38f, 3e38f, 3e38f, false}, {-3e38f, 3e38f, 0, false}, {0, 0, 0, false}});
  const auto voxels = grid.voxels();
  const VoxelBlocks blocks(voxels);
  ApartPoints apart(blocks, voxels.size());
  for (std::size_t b = 0; b < blocks.size(); ++b)
    for (std::uint32_t v = blocks.first[b]; v < blocks.first[b + 1]; ++v) {
      const Vec3d p = grid.along_axes(grid.mean(voxels[v]));
      EXPECT_TRUE(apart.is_apart(b, p, 0.75));
      apart.keep(b, p, v);
      EXPECT_FALSE(apart.is_apart(b, p, 0.75));
    }
}

}  // namespace
}  // namespace meniscus
