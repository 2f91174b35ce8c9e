// The cast spheres against double-precision rays, on every device.
#include "stages/other_methods/spheres.hpp"

#include <gtest/gtest.h>

#include <cmath>

#include "stages/stage_test_support.hpp"
#include "verify/reference/spheres.hpp"

namespace meniscus {
namespace {

using Spheres = OnDevice;

struct Case {
  const char* name;
  Camera (*camera)(int, int);
  SampleGrid grid;
  double footprint;

  View view() const {
    return make_view(
        camera(static_cast<int>(grid.nx * grid.step), static_cast<int>(grid.ny * grid.step)), 0.5,
        {0, 0, 0});
  }
};

const Case kCases[] = {
    {"pixels", perspective_camera, {67, 43, 0.5f, 1}, 1.5},
    {"nodes", off_centre_camera, {40, 31, 0, 2}, 1},
    {"ortho", orthographic_camera, {51, 33, 0.5f, 1}, 1.2},
};

TEST_P(Spheres, MatchTheReference) {
  for (const Case& c : kCases) {
    SCOPED_TRACE(c.name);
    const View view = c.view();
    const Projected particles = spheres_around(view, 60, 2);
    ASSERT_GT(particles.size(), 30u);
    const DeviceSpheres spheres = upload_spheres(device_, view, particles, c.footprint);
    const Buffer<float> device_depth = cast_spheres(device_, view, spheres, c.grid);
    const auto depth = download(device_, device_depth);
    const auto normal = download(device_, sphere_normals(device_, view, spheres, c.grid));
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
  const Projected particles = project_particles(view, one, 3);
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

// What many spheres show is, to the bit, the nearest of what each shows alone, and the normals are
// those of the first of the nearest: nothing that shows is ever left out, whatever it hides or is
// hidden by.
TEST_P(Spheres, HiddenSpheresAreLeftOutExactly) {
  struct Scene {
    int count;
    double footprint;
    bool near;  // some around and behind the eye
  };
  for (const Case& c : kCases)
    for (const Scene& scene : {Scene{1, 1.4, false},
                               {1, 40, false},
                               {90, 1.4, false},
                               {90, 0.2, false},
                               {40, 6, false},
                               {60, 1.4, true}})
      for (const unsigned seed : {21u, 22u}) {
        SCOPED_TRACE(c.name);
        const View view = c.view();
        WorldParticles world;
        Random random(seed);
        for (int k = 0; k < scene.count; ++k) {
          const bool again = k % 10 == 9;  // every tenth twice
          const double spread = scene.near ? 10 : 4;
          const auto next = [&](std::vector<float>& values, double low, double high) {
            values.push_back(again ? values.back() : static_cast<float>(random(low, high)));
          };
          next(world.x, -4, 4);
          next(world.y, -3, 3);
          next(world.z, -spread, spread);
          next(world.scale, 0.6, 1.5);
        }
        const Projected all = project_particles(view, world, 2);
        const std::size_t size = c.grid.size();
        std::vector<float> nearest(size, kNoSurface), normal(3 * size, 0.0f);
        for (std::size_t i = 0; i < all.size(); ++i) {
          Projected one;
          for (const auto part : {&Projected::x, &Projected::y, &Projected::z, &Projected::u,
                                  &Projected::v, &Projected::ku, &Projected::kv, &Projected::scale})
            (one.*part).push_back((all.*part)[i]);
          const auto sphere = upload_spheres(device_, view, one, scene.footprint);
          const auto depth = download(device_, cast_spheres(device_, view, sphere, c.grid));
          const auto own = download(device_, sphere_normals(device_, view, sphere, c.grid));
          for (std::size_t k = 0; k < size; ++k) {
            if (!(depth[k] < nearest[k])) continue;
            nearest[k] = depth[k];
            for (std::size_t axis = 0; axis < 3; ++axis)
              normal[axis * size + k] = own[axis * size + k];
          }
        }
        const auto spheres = upload_spheres(device_, view, all, scene.footprint);
        for (const int width : {1, 8}) {
          use_width(width);
          EXPECT_EQ(download(device_, cast_spheres(device_, view, spheres, c.grid)), nearest);
          EXPECT_EQ(download(device_, sphere_normals(device_, view, spheres, c.grid)), normal);
        }
      }
}

MENISCUS_ON_EVERY_DEVICE(Spheres);

}  // namespace
}  // namespace meniscus
