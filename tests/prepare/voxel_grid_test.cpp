// Sums over the particles in cubes.
#include "prepare/voxel_grid.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <random>

#include "stages/stage_test_support.hpp"

namespace meniscus {
namespace {

TEST(VoxelGrid, AveragesByHand) {
  // The axes are askew: the centre of voxel (0, 0, 0) is half a side along each of them.
  const Vec3d origin{10, 20, 30};
  VoxelGrid grid(2, origin);
  const Vec3d centre = origin + (Vec3d{2, 3, 6} / 7 + Vec3d{3, -6, 2} / 7 + Vec3d{6, 2, -3} / 7);
  const auto add = [&](double dx, bool seen) {
    grid.add({{static_cast<float>(centre.x + dx), static_cast<float>(centre.y),
               static_cast<float>(centre.z), seen}});
  };
  add(-0.25, false);
  add(0.125, true);
  add(0.5, true);
  const auto voxels = grid.voxels();
  ASSERT_EQ(voxels.size(), 1u);
  EXPECT_EQ(voxels[0].count, 3);
  EXPECT_EQ(voxels[0].seen, 2);
  // Positions are floats of up to 32, and places have 2^-20 of a side.
  const double tolerance = 32 * kEpsilon + 2 * 0x1p-20;
  EXPECT_NEAR(grid.mean(voxels[0]).x, centre.x + 0.125, tolerance);
  EXPECT_NEAR(grid.mean(voxels[0]).y, centre.y, tolerance);
  EXPECT_NEAR(grid.seen_mean(voxels[0]).x, centre.x + 0.3125, tolerance);
  EXPECT_NEAR(grid.seen_mean(voxels[0]).z, centre.z, tolerance);
}

TEST(VoxelGrid, AveragesVelocitiesByHand) {
  VoxelGrid grid(2, {0, 0, 0}, true);
  const auto add = [&](bool seen, const Vec3& velocity) {
    grid.add({{11.0f / 7, -1.0f / 7, 5.0f / 7, seen, velocity}});  // half a side along each axis
  };
  add(false, {1, 0, -3});
  add(true, {2, 0, -5});
  add(true, {4.5f, 0, -4});
  add(true, kNoVelocity);
  const auto voxels = grid.voxels();
  ASSERT_EQ(voxels.size(), 1u);
  EXPECT_EQ(voxels[0].count, 4);
  EXPECT_EQ(voxels[0].moving, 3);
  EXPECT_EQ(voxels[0].seen_moving, 2);
  // All are multiples of 2^-20 sides a second, so that only the quotients round.
  EXPECT_EQ(grid.mean_velocity(voxels[0]), (Vec3{2.5f, 0, -4}));
  EXPECT_EQ(grid.seen_mean_velocity(voxels[0]), (Vec3{3.25f, 0, -4.5f}));

  VoxelGrid unknown(2, {0, 0, 0}, true);
  unknown.add({{0, 0, 0, true}});
  EXPECT_FALSE(is_known(unknown.mean_velocity(unknown.voxels()[0])));
  VoxelGrid fast(0.5, {0, 0, 0}, true);  // clamped at 2^18 sides a second
  fast.add({{0, 0, 0, false, {1e29f, -1e29f, 0}}});
  EXPECT_EQ(fast.mean_velocity(fast.voxels()[0]), (Vec3{0x1p17f, -0x1p17f, 0}));
  EXPECT_FALSE(is_known(fast.seen_mean_velocity(fast.voxels()[0])));
}

TEST(VoxelGrid, StraysAtAnyDistanceStayInTheOuterVoxels) {
  VoxelGrid grid(2, {0, 0, 0});
  for (int k = 0; k < 4; ++k) grid.add({{3e38f, -3e38f, 3e38f, true}});
  grid.add({{1e12f, 0, 0, true}});
  for (const VoxelGrid::Voxel& voxel : grid.voxels())
    for (const std::int64_t sum : voxel.sum) {
      EXPECT_GE(sum, 0);
      EXPECT_LT(sum, voxel.count << 20);  // places in a voxel have 20 bits
    }
}

void expect_same(const std::vector<VoxelGrid::Voxel>& found,
                 const std::vector<VoxelGrid::Voxel>& expected) {
  ASSERT_EQ(expected.size(), found.size());
  for (std::size_t k = 0; k < expected.size(); ++k) {
    EXPECT_EQ(expected[k].key, found[k].key);
    EXPECT_EQ(expected[k].count, found[k].count);
    EXPECT_EQ(expected[k].seen, found[k].seen);
    EXPECT_EQ(expected[k].sum, found[k].sum);
    EXPECT_EQ(expected[k].seen_sum, found[k].seen_sum);
    EXPECT_EQ(expected[k].moving, found[k].moving);
    EXPECT_EQ(expected[k].seen_moving, found[k].seen_moving);
    EXPECT_EQ(expected[k].velocity, found[k].velocity);
    EXPECT_EQ(expected[k].seen_velocity, found[k].seen_velocity);
  }
}

// More than one thread sorts at a time.
std::vector<VoxelGrid::Particle> some_particles() {
  Random random(2);
  std::vector<VoxelGrid::Particle> particles;
  for (int k = 0; k < 20000; ++k) {
    const float x = static_cast<float>(random(-20, 20)), y = static_cast<float>(random(-20, 20)),
                z = static_cast<float>(random(-20, 20));
    particles.push_back({x, y, z, x > y, k % 7 ? Vec3{y, z, x} : kNoVelocity});
  }
  return particles;
}

std::vector<VoxelGrid::Voxel> voxels_of(const std::vector<VoxelGrid::Particle>& particles) {
  VoxelGrid grid(3, {1, 2, 3}, true);
  grid.add(particles);
  return grid.voxels();
}

TEST(VoxelGrid, AddsTheVoxelsOfAnother) {
  const auto particles = some_particles();
  VoxelGrid one(3, {1, 2, 3}, true), other(3, {1, 2, 3}, true);
  for (std::size_t k = 0; k < particles.size(); ++k) (k % 3 ? one : other).add({particles[k]});
  one.add_voxels(other.voxels());
  expect_same(one.voxels(), voxels_of(particles));
}

TEST(VoxelGrid, DoesNotDependOnTheOrder) {
  auto particles = some_particles();
  const auto before = voxels_of(particles);
  std::shuffle(particles.begin(), particles.end(), std::mt19937(5));
  expect_same(voxels_of(particles), before);
  std::int64_t count = 0;
  for (const VoxelGrid::Voxel& voxel : before) count += voxel.count;
  EXPECT_EQ(count, 20000);
}

}  // namespace
}  // namespace meniscus
