// Fewer particles that stand for many.
#include "prepare/thin.hpp"

#include <gmock/gmock.h>

#include <algorithm>
#include <cmath>

#include "output/spray.hpp"
#include "stages/orthographic_view.hpp"
#include "stages/stage_test_support.hpp"

namespace meniscus {
namespace {

using Thin = OnDevice;

constexpr double kRadius = 0.5;  // of the particles

TEST_P(Thin, LoneParticlesAndSmallDropsStayWhatTheyAre) {
  VoxelGrid grid(4, {0, 0, 0});
  grid.add({{100, 0, 0, true}});
  for (int k = 0; k < 8;
       ++k)  // a cube of eight, near the middle of a voxel: (2, 2, 2) along the axes
    grid.add({{static_cast<float>(22.0 / 7 + (k & 1 ? .1 : -.1)),
               static_cast<float>(-2.0 / 7 + (k & 2 ? .1 : -.1)),
               static_cast<float>(10.0 / 7 + (k & 4 ? .1 : -.1)), true}});
  grid.add({{-100, 0, 0, false}});  // nobody sees it
  const Thinned thinned = thin_particles(device_, grid, kRadius, {0, 0, 1000}, 1);
  EXPECT_TRUE(thinned.particles.x.empty());
  ASSERT_EQ(thinned.spray.size(), 2u);
  const bool first_is_lone = thinned.spray[0].radius < 0.7;
  const SprayDrop& lone = thinned.spray[first_is_lone ? 0 : 1];
  const SprayDrop& drop = thinned.spray[first_is_lone ? 1 : 0];
  EXPECT_DOUBLE_EQ(lone.radius, kRadius);
  EXPECT_NEAR(lone.centre.x, 100, 1e-5);
  EXPECT_DOUBLE_EQ(drop.radius, 2 * kRadius);  // the cube root of eight
  EXPECT_NEAR(drop.centre.x, 22.0 / 7, 1e-5);
}

// A pool of particles under z = 0, as relaxed as a jittered lattice is, seen from above: the
// representatives' first layer lies S/2 below the surface, and the offset of one of their radii
// brings it back. The layer's own noise is averaged; what is left is that of the mean of some
// (S/s)^2 particles and the direction of the field's gradient.
TEST_P(Thin, APoolKeepsItsSurface) {
  constexpr double kSide = 3.5;
  VoxelGrid grid(kSide, {0, 0, 0});
  Random random(7);
  for (int k = 0; k < 24; ++k)
    for (int j = -30; j < 30; ++j)
      for (int i = -30; i < 30; ++i)
        grid.add({{static_cast<float>(i + random(-.1, .1)), static_cast<float>(j + random(-.1, .1)),
                   static_cast<float>(-0.5 - k + random(-.1, .1)), k == 0}});
  const Thinned thinned = thin_particles(device_, grid, kRadius, {0, 0, 1000}, 1);
  EXPECT_TRUE(thinned.spray.empty());
  const WorldParticles& p = thinned.particles;
  std::vector<Vec3d> first;
  int inner = 0;
  for (std::size_t i = 0; i < p.x.size(); ++i) {
    if (std::hypot(p.x[i], p.y[i]) > 20) continue;  // away from the pool's sides
    EXPECT_LT(p.z[i], -kSide / 2 + 0.1);
    if (p.z[i] > -0.8 * kSide) first.push_back({p.x[i], p.y[i], p.z[i]});
    // Half of the inside, where neither surface is near.
    inner += p.z[i] < -2.5 * kSide && p.z[i] > -4.5 * kSide;
  }
  double sum = 0, nearest = 1e9;
  for (const Vec3d& a : first) {
    sum += a.z;
    EXPECT_NEAR(a.z, -kSide / 2, 0.15);
    for (const Vec3d& b : first)
      if (&a != &b) nearest = std::min(nearest, length(a - b));
  }
  // Jitter has .058 s, the mean of a hundred .006 s; the radius of a tilted direction adds little.
  EXPECT_NEAR(sum / static_cast<double>(first.size()), -kSide / 2, 0.03);
  EXPECT_GE(nearest, 0.6 * kSide);
  // One per S^2 in a densest packing of this distance has 1.15 / .65^2 at most, at least half of
  // it.
  const double area = 3.14159 * 400 / (kSide * kSide);
  EXPECT_GT(static_cast<double>(first.size()), 0.6 * area);
  EXPECT_LT(static_cast<double>(first.size()), 2.8 * area);
  // Inside there is one per voxel.
  EXPECT_NEAR(inner, 2 * area, 0.15 * 2 * area);
}

// A sheet of one layer is no spray, whatever the ratio, and particles scattered as thinly are.
TEST_P(Thin, TellsSheetsFromSpray) {
  for (const double side : {2.0, 4.0, 6.0}) {
    VoxelGrid sheet(side, {0, 0, 0}), spray(side, {0, 0, 0});
    Random random(9);
    for (int j = -40; j < 40; ++j)
      for (int i = -40; i < 40; ++i) {
        sheet.add({{static_cast<float>(i), static_cast<float>(j), 0.5f, true}});
        if ((i + j) % 8 == 0)
          spray.add({{static_cast<float>(random(-40, 40)), static_cast<float>(random(-40, 40)),
                      static_cast<float>(random(-40, 40)), true}});
      }
    const Thinned a = thin_particles(device_, sheet, kRadius, {0, 0, 1000}, 1);
    for (const SprayDrop& drop : a.spray)  // its edge may be
      EXPECT_GT(std::max(std::abs(drop.centre.x), std::abs(drop.centre.y)), 40 - 1.5 * side)
          << side;
    EXPECT_GT(a.particles.x.size(), 0.6 * 6400 / (side * side)) << side;
    const Thinned b = thin_particles(device_, spray, kRadius, {0, 0, 1000}, 1);
    EXPECT_TRUE(b.particles.x.empty()) << side;
    EXPECT_GT(b.spray.size(), 400u) << side;
  }
}

// Particles that all move alike are replaced by some that move like them, drops too.
TEST_P(Thin, RepresentativesMoveAsWhatTheyStandFor) {
  const Vec3 velocity{1.5f, -2, 0.1f};
  VoxelGrid grid(3, {0, 0, 0}, true), still(3, {0, 0, 0});
  for (int k = 0; k < 12; ++k)
    for (int j = -15; j < 15; ++j)
      for (int i = -15; i < 15; ++i)
        for (VoxelGrid* each : {&grid, &still})
          each->add({{static_cast<float>(i), static_cast<float>(j), static_cast<float>(-k), k == 0,
                      velocity}});
  for (VoxelGrid* each : {&grid, &still}) each->add({{0, 0, 50, true, velocity}});
  const Thinned thinned = thin_particles(device_, grid, kRadius, {0, 0, 1000}, 1);
  EXPECT_TRUE(thinned.particles.moving);
  ASSERT_GT(thinned.particles.x.size(), 100u);
  ASSERT_EQ(thinned.particles.velocity.size(), thinned.particles.x.size());
  ASSERT_EQ(thinned.spray.size(), 1u);
  std::vector<Vec3> all = thinned.particles.velocity;
  all.push_back(thinned.spray[0].velocity);
  for (const Vec3& v : all) {  // to half a step of the sums and a rounding
    EXPECT_NEAR(v.x, velocity.x, 3 * 0x1p-21 + 2 * kEpsilon);
    EXPECT_NEAR(v.y, velocity.y, 3 * 0x1p-21 + 2 * kEpsilon);
    EXPECT_NEAR(v.z, velocity.z, 3 * 0x1p-21 + 2 * kEpsilon);
  }
  const Thinned without = thin_particles(device_, still, kRadius, {0, 0, 1000}, 1);
  EXPECT_FALSE(without.particles.moving);
  EXPECT_TRUE(without.particles.velocity.empty());
  EXPECT_EQ(without.particles.x, thinned.particles.x);
}

TEST_P(Thin, NothingComesOfNothing) {
  const Thinned thinned = thin_particles(device_, VoxelGrid(1, {0, 0, 0}), 0.1, {0, 0, 1}, 1);
  EXPECT_TRUE(thinned.particles.x.empty());
  EXPECT_TRUE(thinned.spray.empty());
}

MENISCUS_ON_EVERY_DEVICE(Thin);

SurfaceMap empty_image(int nx, int ny) {
  SurfaceMap image;
  image.grid = {nx, ny, 0.5f, 1.0f};
  image.depth.assign(image.grid.size(), kNoSurface);
  image.normal.resize(image.grid.size());
  image.group.assign(image.grid.size(), 7);
  image.kind.assign(image.grid.size(), Kind::none);
  return image;
}

// An orthographic camera that shows a world unit as four pixels.
View spray_view() { return orthographic_view(40, 32, {0.2, 0.25, -0.02}, 0.5); }

TEST(Spray, DrawsASphereByHand) {
  SurfaceMap image = empty_image(40, 32);
  // Its centre lies at (20.5, 16.5), the centre of a pixel; its radius of .5 spans two pixels.
  draw_spray(spray_view(), {{{0.125, -0.125, -10}, 0.5}}, image);
  int covered = 0;
  for (int j = 0; j < 32; ++j)
    for (int i = 0; i < 40; ++i) {
      const std::size_t s = static_cast<std::size_t>(j) * 40 + i;
      const double d = std::hypot(i - 20, j - 16) / 2;
      if (d >= 1) {
        EXPECT_EQ(image.depth[s], kNoSurface);
        continue;
      }
      ++covered;
      EXPECT_NEAR(image.depth[s], 20 - std::sqrt(1 - d * d), 1e-5);  // in radii of .5
      EXPECT_NEAR(image.normal[s].x, (i - 20) / 2.0, 1e-5);
      EXPECT_NEAR(image.normal[s].y, -(j - 16) / 2.0, 1e-5);
      EXPECT_EQ(image.group[s], -1);
      EXPECT_EQ(image.kind[s], Kind::splash);
    }
  EXPECT_EQ(covered, 9);
}

TEST(Spray, MovesItsPixels) {
  SurfaceMap image = empty_image(40, 32);
  image.velocity.assign(image.grid.size(), Vec3{9, 9, 9});
  draw_spray(spray_view(), {{{0.125, -0.125, -10}, 0.5, {1, -2, 3}}, {{2, 2, -10}, 0.5}}, image);
  int moved = 0, unknown = 0;
  for (std::size_t s = 0; s < image.grid.size(); ++s) {
    if (image.kind[s] != Kind::splash) {
      EXPECT_EQ(image.velocity[s], (Vec3{9, 9, 9}));
      continue;
    }
    moved += image.velocity[s] == Vec3{1, -2, 3};
    unknown += image.velocity[s] == Vec3{};
  }
  EXPECT_EQ(moved, 9);
  EXPECT_GT(unknown, 5);
}

TEST(Spray, IsNeverLostBetweenPixels) {
  for (const double shift : {0.0, 0.05, 0.124, 0.2}) {
    SurfaceMap image = empty_image(40, 32);
    draw_spray(spray_view(), {{{shift, shift, -10}, 0.01}}, image);
    EXPECT_EQ(std::count(image.kind.begin(), image.kind.end(), Kind::splash), 1) << shift;
  }
}

TEST(Spray, StaysBehindWhatIsNearer) {
  SurfaceMap image = empty_image(40, 32);
  image.depth.assign(image.grid.size(), 15.0f);
  draw_spray(spray_view(), {{{0, 0, -10}, 0.5}, {{50, 0, -5}, 0.5}, {{0, 0, 5}, 0.5}}, image);
  EXPECT_EQ(std::count(image.kind.begin(), image.kind.end(), Kind::splash), 0);
  draw_spray(spray_view(), {{{0, 0, -5}, 0.5}}, image);
  EXPECT_GT(std::count(image.kind.begin(), image.kind.end(), Kind::splash), 5);
}

}  // namespace
}  // namespace meniscus
