#include "stages/other_methods/spheres.hpp"

#include <algorithm>
#include <climits>
#include <cmath>

#include "base/parallel.hpp"
#include "base/rounded_up.hpp"
#include "device/kernels.hpp"
#include "stages/frame/bins.hpp"
#include "stages/frame/minima.hpp"
#include "stages/sample/surface_buffers.hpp"

namespace meniscus {
namespace {

// Half of what a sphere covers along an axis of the screen, at most: the pixel coordinate is
// u = (row.e) / (w_row.e), so that a step d from the centre changes it by
// (row - u w_row).d / (w + w_row.d), and |d| <= radius.
double half_extent(const std::array<double, 4>& row, const std::array<double, 4>& w_row, double u,
                   double w, double radius) {
  const Vec3d along{row[0] - u * w_row[0], row[1] - u * w_row[1], row[2] - u * w_row[2]};
  const double nearest = w - radius * length(Vec3d{w_row[0], w_row[1], w_row[2]});
  constexpr double kWholeScreen = 1e6;  // pixels
  return nearest > 0 ? std::min(radius * length(along) / nearest, kWholeScreen) : kWholeScreen;
}

// The spheres as the kernels take them.
struct Outlined {
  Buffer<float> records;  // [stride][8] see outline_spheres
  Outlines outlines;
  Buffer<float> bound;  // [bins]
};

Outlined outline_spheres(Device& device, const View& view, const DeviceSpheres& spheres,
                         const SampleGrid& grid) {
  const std::size_t stride = static_cast<std::size_t>(spheres.stride);
  const int width = device.state().vector_width;
  // The largest sums of the terms of |ox| + |oy| and of |dx| + |dy| at a sample.
  const double last_u = grid.first + double{grid.step} * (grid.nx - 1);
  const double last_v = grid.first + double{grid.step} * (grid.ny - 1);
  const auto terms = [&](std::size_t k) {
    return std::abs(view.ray[k]) + std::abs(view.ray[k + 1]) * last_u +
           std::abs(view.ray[k + 2]) * last_v;
  };
  const cl_float2 largest{
      {static_cast<float>(terms(0) + terms(3)), static_cast<float>(terms(6) + terms(9))}};

  Outlined outlined{allocate<float>(device, 8 * stride),
                    {allocate<cl_int>(device, 4 * stride), allocate<float>(device, stride),
                     spheres.count, spheres.stride},
                    {}};
  const Covers covers{allocate<cl_int>(device, 4 * stride), allocate<float>(device, stride),
                      spheres.count, spheres.stride};
  const int shift = cover_shift(spheres.pixels / grid.step);
  launch(device, kernels::outline_spheres, width, {stride / static_cast<std::size_t>(width)},
         spheres.values, outlined.records, outlined.outlines, covers, spheres.stride,
         screen_of(view, grid), largest, shift);
  outlined.bound = bound_bins(device, covers, grid, shift);
  return outlined;
}

// Draws all bins with a kernel of spheres.cl.
void draw(Device& device, const auto& kernel, const View& view, const Outlined& spheres,
          const SampleGrid& grid, const Buffer<float>& result) {
  const int width = device.state().vector_width;
  draw_bins(device, spheres.outlines, spheres.bound, grid, [&](const BinLists& lists) {
    launch(device, kernel, width, bin_items(lists, width), spheres.records, lists, result,
           lists.bins, screen_of(view, grid));
  });
}

// The same as the kernels cast_spheres and sphere_normals, by atomic minima.
Buffer<float> lower_spheres(Device& device, const View& view, const Outlined& spheres,
                            const SampleGrid& grid) {
  const auto depth = filled<float>(device, grid.size(), kNoSurface);
  draw_minima(device, kernels::lower_spheres, spheres.records, spheres.outlines, spheres.bound,
              grid, std::tie(depth), screen_of(view, grid));
  return depth;
}

Buffer<float> normals_by_minima(Device& device, const View& view, const Outlined& spheres,
                                const SampleGrid& grid) {
  const Buffer<float> depth = lower_spheres(device, view, spheres, grid);
  const auto owner = filled<cl_int>(device, grid.size(), INT_MAX);
  draw_minima(device, kernels::own_spheres, spheres.records, spheres.outlines, spheres.bound, grid,
              std::tie(depth, owner), screen_of(view, grid));
  const auto normal = allocate<float>(device, 3 * grid.size());
  const std::size_t width = static_cast<std::size_t>(device.state().vector_width);
  launch(device, kernels::normals_of_owners, static_cast<int>(width),
         {(static_cast<std::size_t>(grid.nx) + width - 1) / width,
          static_cast<std::size_t>(grid.ny), 16, 4},
         spheres.records, depth, owner, normal, screen_of(view, grid));
  return normal;
}

}  // namespace

DeviceSpheres upload_spheres(Device& device, const View& view, const Projected& particles,
                             double footprint) {
  const std::size_t n = particles.size(), stride = rounded_up(n, 64);
  std::vector<float> values(8 * stride, 0.0f);
  constexpr std::size_t kGrain = 4096;  // particles that are worth a thread
  parallel_for(n, kGrain, [&](std::size_t begin, std::size_t end) {
    for (std::size_t k = begin; k < end; ++k) {
      const double radius = footprint * particles.scale[k];
      const PixelPosition at = project(view, particles.eye(k));
      // A hundredth of a pixel for what the kernel rounds.
      const double hu = half_extent(view.u_row, view.w_row, at.u, at.w, radius) + 0.01;
      const double hv = half_extent(view.v_row, view.w_row, at.v, at.w, radius) + 0.01;
      const double row[8] = {
          particles.x[k], particles.y[k], -particles.z[k], radius, at.u, at.v, hu, hv};
      for (std::size_t r = 0; r < 8; ++r) values[r * stride + k] = static_cast<float>(row[r]);
    }
  });
  double pixels = 0;
  for (std::size_t k = 0; k < n; ++k)
    pixels += std::min(values[6 * stride + k], values[7 * stride + k]);
  return {upload(device, values), static_cast<int>(n), static_cast<int>(stride),
          n > 0 ? pixels / static_cast<double>(n) : 0};
}

Buffer<float> cast_spheres(Device& device, const View& view, const DeviceSpheres& spheres,
                           const SampleGrid& grid) {
  if (spheres.count == 0) return filled<float>(device, grid.size(), kNoSurface);
  const Outlined outlined = outline_spheres(device, view, spheres, grid);
  if (draws_by_minima(device)) return lower_spheres(device, view, outlined, grid);
  const auto depth = allocate<float>(device, grid.size());
  draw(device, kernels::cast_spheres, view, outlined, grid, depth);
  return depth;
}

Buffer<float> sphere_normals(Device& device, const View& view, const DeviceSpheres& spheres,
                             const SampleGrid& grid) {
  if (spheres.count == 0) return filled<float>(device, 3 * grid.size(), 0.0f);
  const Outlined outlined = outline_spheres(device, view, spheres, grid);
  if (draws_by_minima(device)) return normals_by_minima(device, view, outlined, grid);
  const auto normal = allocate<float>(device, 3 * grid.size());
  draw(device, kernels::sphere_normals, view, outlined, grid, normal);
  return normal;
}

}  // namespace meniscus
