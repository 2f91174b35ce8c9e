// What the tests of the blend share: its samples, and how far they may be from planes.
#pragma once

#include <cstring>
#include <functional>
#include <vector>

#include "stages/sample/blend.hpp"
#include "stages/stage_test_support.hpp"
#include "verify/stage_cases/fits_by_hand.hpp"
#include "verify/stage_cases/into_new.hpp"

namespace meniscus {

inline const FitParams kFit;
inline const BlendParams kBlend;

using Scene = GivenFits;

// The samples of the blend, with what it says of where they lie.
struct Samples {
  SurfaceMap map;
  std::vector<float> trust;  // 0 .. 1
  std::vector<bool> on_edge, ended;
};

inline Samples samples_of(Device& device, const SurfaceBuffers& surface) {
  Samples samples{download(device, surface), download(device, surface.trust), {}, {}};
  for (float& trust : samples.trust) {
    samples.ended.push_back(trust > 3.5f);
    samples.on_edge.push_back(trust > 1.5f && trust < 3.5f);
    trust -= samples.ended.back() ? 4.0f : samples.on_edge.back() ? 2.0f : 0.0f;
  }
  return samples;
}

inline Samples blended(Device& device, const View& view, const SampleGrid& grid, const Scene& scene,
                       const std::vector<float>& reference, int width) {
  device.state().vector_width = width;
  const BlendRecords records =
      make_records(scene.fits, scene.trust, kFit, kBlendReach * kBlend.radius);
  const SurfaceBuffers surface = empty_surface(device, grid);
  const auto depth = upload(device, reference);
  blend_groups(device, view, list_gaps(device, grid, depth, 0).lists,
               upload_records(device, records), list_fits(device, view, records, grid), depth,
               surface, kBlend);
  return samples_of(device, surface);
}

// The blend, with the same bits in every width.
inline Samples blended(Device& device, const View& view, const SampleGrid& grid, const Scene& scene,
                       const std::vector<float>& reference) {
  const Samples one = blended(device, view, grid, scene, reference, 1);
  const std::size_t bytes = grid.size() * sizeof(float);
  for (const int width : {8, 16}) {
    const Samples wide = blended(device, view, grid, scene, reference, width);
    EXPECT_EQ(std::memcmp(one.map.depth.data(), wide.map.depth.data(), bytes), 0) << width;
    EXPECT_EQ(std::memcmp(one.map.normal.data(), wide.map.normal.data(), 3 * bytes), 0) << width;
    EXPECT_EQ(std::memcmp(one.trust.data(), wide.trust.data(), bytes), 0) << width;
    EXPECT_EQ(one.map.group, wide.map.group) << width;
    EXPECT_EQ(one.on_edge, wide.on_edge) << width;
    EXPECT_EQ(one.ended, wide.ended) << width;
  }
  return one;
}

inline Samples blended(Device& device, const View& view, const SampleGrid& grid, const Scene& scene,
                       float reference) {
  return blended(device, view, grid, scene, std::vector<float>(grid.size(), reference));
}

// Depth at which the ray of pixel (u, v) meets the plane.
inline double plane_depth(const View& view, const Vec3d& at, const Vec3d& normal, double u,
                          double v) {
  const Vec3d from = point_at(view, u, v, 0), direction = ray_direction(view, u, v);
  return dot(at - from, normal) / dot(direction, normal);
}

// Largest error of a depth near 20 on a plane that the ray meets at a slope of at least 0.3: the
// value C of the plane at the reference is a sum of three products of numbers up to 30, whose
// factors carry five roundings each; the slope divides it; the reference is added. A mean of such
// depths adds two more.
inline constexpr double kDepthError = (3 * 8 * 30 / 0.3 + 4 * 30) * kEpsilon;
// A normal is a gradient, plus half the weights' gradients times the differences of the depths they
// weigh, which are 0 on a plane but for their rounding. Where the weight is at least a hundredth of
// its most, 1 - d^2 > 0.21 and the half gradient over the weight is at most 3 / (4.2 (1 - d^2)) <
// 3.4 a radius, times the slope of the ray, below 1.3. Two sums of them, and the length's
// roundings.
inline constexpr double kNormalError = 2 * 3.4 * 1.3 * kDepthError + 8 * kEpsilon;

inline bool near_a_fit(const View& view, const Scene& scene, double u, double v, double depth) {
  for (const Vec3d& foot : scene.fits.foot)
    if (length(point_at(view, u, v, depth) - foot) < 0.75 * kBlendReach * kBlend.radius)
      return true;
  return false;
}

// Calls check(depth, normal, u, v) at every sample with surface and returns how many there are.
using Check = std::function<void(double, const Vec3d&, double, double)>;
inline std::size_t for_each(const Samples& samples, const Check& check) {
  std::size_t count = 0;
  for (std::size_t s = 0; s < samples.map.grid.size(); ++s) {
    if (!(samples.map.depth[s] < kNoSurface)) continue;
    ++count;
    check(samples.map.depth[s], Vec3d(samples.map.normal[s]), u_of(samples.map.grid, s),
          v_of(samples.map.grid, s));
  }
  return count;
}

inline const SampleGrid kGrids[] = {{37, 21, 0.5f, 1}, {19, 11, 0, 2}, {1, 1, 15, 1}};

}  // namespace meniscus
