// The cast spheres against double-precision rays, on every device.
#include "stages/spheres.hpp"

#include <gtest/gtest.h>

#include <cmath>

#include "reference/spheres.hpp"
#include "stages/stage_test_support.hpp"

namespace meniscus {
namespace {

class Spheres : public OnDevice {
 protected:
  Projected projected(const View& view, int count, unsigned seed) {
    WorldParticles particles;
    Random random(seed);
    for (int k = 0; k < count; ++k) {
      particles.x.push_back(static_cast<float>(random(-4, 4)));
      particles.y.push_back(static_cast<float>(random(-3, 3)));
      particles.z.push_back(static_cast<float>(random(-4, 4)));
      particles.scale.push_back(static_cast<float>(random(0.6, 1.5)));
    }
    return project_particles(device_, view, particles, 2);
  }
};

struct Case {
  const char* name;
  Camera (*camera)(int, int);
  SampleGrid grid;
  double footprint;
};

const Case kCases[] = {
    {"pixels", perspective_camera, {67, 43, 0.5f, 1}, 1.5},
    {"nodes", off_centre_camera, {40, 31, 0, 2}, 1},
    {"ortho", orthographic_camera, {51, 33, 0.5f, 1}, 1.2},
};

TEST_P(Spheres, MatchTheReference) {
  for (const Case& c : kCases) {
    SCOPED_TRACE(c.name);
    const View view = make_view(c.camera(static_cast<int>(c.grid.nx * c.grid.step),
                                         static_cast<int>(c.grid.ny * c.grid.step)),
                                0.5, {0, 0, 0});
    const Projected particles = projected(view, 60, 2);
    ASSERT_GT(particles.size(), 30u);
    const DeviceSpheres spheres = upload_spheres(device_, view, particles, c.footprint);
    const Buffer<float> device_depth = cast_spheres(device_, view, spheres, c.grid);
    const auto depth = download(device_, device_depth);
    const auto normal =
        download(device_, sphere_normals(device_, view, spheres, device_depth, c.grid));
    const std::size_t size = c.grid.size();
    ASSERT_EQ(depth.size(), size);
    int hits = 0, near_rims = 0;
    for (int j = 0; j < c.grid.ny; ++j)
      for (int i = 0; i < c.grid.nx; ++i) {
        const std::size_t k = static_cast<std::size_t>(j) * c.grid.nx + i;
        const auto hit =
            reference::cast_ray(view, particles, c.footprint, c.grid.first + c.grid.step * i,
                                c.grid.first + c.grid.step * j);
        // Coordinates are below 64 radii and round some ten times: off by `offset`. Across a
        // sphere of radius R at the distance (1 - m) R from its axis, depth changes by less than
        // 1 / sqrt(m) as much, twice that with R's own rounding.
        constexpr double offset = 10 * 64 * kEpsilon;
        constexpr double kRim = 1e-3;
        if (hit.margin < kRim) {
          ++near_rims;
          continue;
        }
        const double tolerance = 4 * offset / std::sqrt(hit.margin);
        if (!std::isfinite(hit.depth)) {
          ASSERT_EQ(depth[k], kNoSurface) << i << ' ' << j;
          EXPECT_EQ(normal[k], 0);
          continue;
        }
        ++hits;
        ASSERT_NEAR(depth[k], hit.depth, tolerance) << i << ' ' << j;
        // Where two spheres are this near to equal, either's normal is right.
        const Vec3d actual{normal[k], normal[size + k], normal[2 * size + k]};
        EXPECT_NEAR(length(actual), 1, 4 * kEpsilon);
        if (length(actual - hit.normal) > 2 * tolerance) ++near_rims;
      }
    EXPECT_GT(hits, static_cast<int>(size) / 5);
    EXPECT_LT(near_rims, static_cast<int>(size) / 50);
  }
}

// On the axis of the camera and off it, the whole outline: nothing of a sphere is cut by the box
// of samples it is drawn in.
TEST_P(Spheres, AreWholeAtTheImagesEdges) {
  const View view =
      make_view(look_at({0, 0, 6}, {0, 0, 0}, {0, 1, 0}, 110, 160, 120), 0.5, {0, 0, 0});
  WorldParticles one;
  one.x = {6.5f};
  one.y = {4.5f};
  one.z = {0.0f};
  const Projected particles = project_particles(device_, view, one, 3);
  ASSERT_EQ(particles.size(), 1u);
  const SampleGrid grid{160, 120, 0.5f, 1};
  const auto depth = download(
      device_, cast_spheres(device_, view, upload_spheres(device_, view, particles, 3), grid));
  int covered = 0, expected = 0;
  for (int k = 0; k < 160 * 120; ++k) {
    covered += std::isfinite(depth[k]);
    expected +=
        std::isfinite(reference::cast_ray(view, particles, 3, k % 160 + 0.5, k / 160 + 0.5).depth);
  }
  EXPECT_GT(expected, 100);
  EXPECT_EQ(covered, expected);
}

MENISCUS_ON_EVERY_DEVICE(Spheres);

}  // namespace
}  // namespace meniscus
