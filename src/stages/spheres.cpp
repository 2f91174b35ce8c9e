#include "stages/spheres.hpp"

#include <climits>
#include <cmath>

#include "stages/surface_buffers.hpp"

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

}  // namespace

DeviceSpheres upload_spheres(Device& device, const View& view, const Projected& particles,
                             double footprint) {
  const std::size_t n = particles.size(), stride = (n + 63) / 64 * 64;
  std::vector<float> values(8 * stride, 0.0f);
  for (std::size_t k = 0; k < n; ++k) {
    const double radius = footprint * particles.scale[k];
    const PixelPosition at = project(view, particles.eye(k));
    // A hundredth of a pixel for what the kernel rounds.
    const double hu = half_extent(view.u_row, view.w_row, at.u, at.w, radius) + 0.01;
    const double hv = half_extent(view.v_row, view.w_row, at.v, at.w, radius) + 0.01;
    const double row[8] = {
        particles.x[k], particles.y[k], -particles.z[k], radius, at.u, at.v, hu, hv};
    for (std::size_t r = 0; r < 8; ++r) values[r * stride + k] = static_cast<float>(row[r]);
  }
  return {upload(device, values), static_cast<int>(n), static_cast<int>(stride)};
}

Buffer<float> cast_spheres(Device& device, const View& view, const DeviceSpheres& spheres,
                           const SampleGrid& grid) {
  const auto depth = filled<float>(device, grid.size(), kNoSurface);
  launch(device, "spheres.cl", "cast_spheres", {static_cast<std::size_t>(spheres.count)}, "",
         spheres.values, depth, spheres.count, spheres.stride, cl_int2{{grid.nx, grid.ny}},
         cl_float2{{grid.first, grid.step}}, kernel_rays(view));
  return depth;
}

Buffer<float> sphere_normals(Device& device, const View& view, const DeviceSpheres& spheres,
                             const Buffer<float>& depth, const SampleGrid& grid) {
  const auto owner = filled<cl_int>(device, grid.size(), INT_MAX);
  const auto normal = allocate<float>(device, 3 * grid.size());
  const cl_int2 samples{{grid.nx, grid.ny}};
  const cl_float2 lattice{{grid.first, grid.step}};
  launch(device, "spheres.cl", "find_sphere", {static_cast<std::size_t>(spheres.count)}, "",
         spheres.values, depth, owner, spheres.count, spheres.stride, samples, lattice,
         kernel_rays(view));
  launch(device, "spheres.cl", "sphere_normals",
         {static_cast<std::size_t>(grid.nx), static_cast<std::size_t>(grid.ny), 8, 8}, "",
         spheres.values, depth, owner, normal, spheres.stride, samples, lattice, kernel_rays(view));
  return normal;
}

}  // namespace meniscus
