// Agreement with a reference, cameras in other units, drifting particles.
#include "accuracy/real.hpp"

#include <gtest/gtest.h>

#include <cmath>

#include "accuracy/synthetic.hpp"
#include "meniscus/camera.hpp"
#include "meniscus/error.hpp"
#include "stages/view.hpp"

namespace meniscus::accuracy {
namespace {

/// The wall of synthetic.hpp; from column 80 on its normals are turned by 40 degrees.
Map bent_wall() {
  Map map = map_of(whole_wall());
  for (int y = 0; y < kHeight; ++y)
    for (int x = 80; x < kWidth; ++x) map.normal[pixel(x, y)] = turned(40);
  return map;
}

TEST(Agreement, AnglesAreThoseBetweenTheNormals) {
  Map map = bent_wall();
  for (std::size_t p = 0; p < map.normal.size(); ++p) {
    const bool bent = p % kWidth >= 80;
    map.normal[p] =
        turned(bent ? 43 : 1);  // off by 3 degrees in half of the image, by 1 in the other
  }
  const Agreement a = agreement(wall_lens(), bent_wall(), map);
  const double rounding = 0x1p-23 / kDegree;
  EXPECT_NEAR(a.angle_p95, 3, rounding);
  EXPECT_NEAR(a.all_p95, 3, rounding);
  EXPECT_TRUE(std::abs(a.angle_median - 3) < rounding || std::abs(a.angle_median - 1) < rounding);
  EXPECT_EQ(a.iou, 1);
  // 16 pixels on either side of the bend and at each border are not smooth.
  EXPECT_NEAR(a.smooth_share, 100. * (kWidth - 4 * 16) * (kHeight - 2 * 16) / (kWidth * kHeight),
              1e-9);
  EXPECT_NEAR(a.jump_p999, 0, rounding);
}

TEST(Agreement, BendsDoNotCountAsSmooth) {
  // Wrong only near the bend, as a rounded edge is.
  Map map = bent_wall();
  for (int y = 0; y < kHeight; ++y)
    for (int x = 66; x < 94; ++x) map.normal[pixel(x, y)] = turned(20);
  const Agreement a = agreement(wall_lens(), bent_wall(), map);
  EXPECT_EQ(a.angle_p95, 0);
  EXPECT_NEAR(a.all_p95, 20, 1e-4);
}

TEST(Agreement, JumpsBetweenNeighboursCount) {
  Map map = bent_wall();
  for (int y = 0; y < kHeight; y += 25)
    for (int x = 0; x < 80; ++x) map.normal[pixel(x, y)] = turned(7);
  EXPECT_NEAR(agreement(wall_lens(), bent_wall(), map).jump_p999, 7, 1e-4);
}

TEST(Agreement, OtherLayersAreNotCompared) {
  Map map = bent_wall();
  for (int y = 0; y < kHeight / 2; ++y)
    for (int x = 0; x < kWidth; ++x) {
      map.depth[pixel(x, y)] += 2;
      map.normal[pixel(x, y)] = turned(80);
    }
  for (int x = 0; x < kWidth; ++x) map.depth[pixel(x, kHeight - 1)] = static_cast<float>(kNothing);
  const Agreement a = agreement(wall_lens(), bent_wall(), map);
  EXPECT_EQ(a.all_p95, 0);
  EXPECT_DOUBLE_EQ(a.iou, (kHeight - 1.) / kHeight);
  map.depth.pop_back();
  EXPECT_THROW(agreement(wall_lens(), bent_wall(), map), InvalidArgument);
}

TEST(LensOfCamera, IsTheCameraInOtherUnits) {
  const Camera camera = look_at({1, 2, 3}, {0.25, 0, 0.5}, {0, 1, 0}, 40, 320, 200);
  constexpr double unit = 0.05;
  const Lens lens = lens_of(camera, unit);
  const View view = make_view(camera, unit, {0, 0, 0});  // in radii of 0.05: the same units
  for (const Vec3d& world : {Vec3d{0, 0, 0}, Vec3d{0.3, -0.2, 0.4}, Vec3d{-0.1, 0.5, 0.2}}) {
    const Vec3d eye = eye_from_world(view, world);
    const PixelPosition at = project(view, eye);
    const auto pixel = lens.pixel(world / unit);
    ASSERT_TRUE(pixel.has_value());
    EXPECT_EQ(*pixel, static_cast<std::size_t>(at.v) * 320 + static_cast<std::size_t>(at.u));
    // Coordinates below 100 through some ten operations in double precision.
    EXPECT_NEAR(dot(world / unit - lens.eye, lens.forward), -eye.z, 1e-11);
  }
  Camera shifted = camera;
  shifted.projection[2] = 0.1;
  EXPECT_THROW(lens_of(shifted, unit), InvalidArgument);
  Camera stretched = camera;
  stretched.projection[5] *= 2;
  EXPECT_THROW(lens_of(stretched, unit), InvalidArgument);
}

TEST(LensOfCamera, UndoesCameraOf) {
  for (const bool orthographic : {false, true}) {
    const Lens lens = lens_of(find_scene("box"), orthographic);
    const Lens back = lens_of(camera_of(lens), 1);
    EXPECT_EQ(back.orthographic, orthographic);
    EXPECT_NEAR(back.focal, lens.focal, 1e-9);
    EXPECT_NEAR(length(back.eye - lens.eye), 0, 1e-9);
    EXPECT_NEAR(length(back.down - lens.down), 0, 1e-12);
  }
}

TEST(Particles, ScaleAndDrift) {
  Particles particles;
  particles.x = {1, 0};
  particles.y = {2, 0};
  particles.z = {3, 0};
  particles.particle_radius = 0.25;
  EXPECT_EQ(rms_speed(particles), 0);
  EXPECT_THROW(drifted(particles, 1), InvalidArgument);
  particles.vx = {3, 0};
  particles.vy = {4, 0};
  particles.vz = {0, 0};
  const Particles scaled = in_units(particles, 0.5);
  EXPECT_EQ(scaled.x[0], 2);
  EXPECT_EQ(scaled.vy[0], 8);
  EXPECT_EQ(scaled.particle_radius, 0.5);
  EXPECT_DOUBLE_EQ(rms_speed(particles), 5 / std::sqrt(2));
  EXPECT_EQ(drifted(particles, 0.5).x[0], 2.5f);
  EXPECT_EQ(drifted(particles, 0.5).y[0], 4);
  EXPECT_EQ(drifted(particles, 0.5).x[1], 0);
}

}  // namespace
}  // namespace meniscus::accuracy
