#include "stages/settle.hpp"

#include "device/kernels.hpp"

namespace meniscus {
namespace {

// A kept triangle's depth within this many particle radii of a sample vouches for it without
// measuring the density.
constexpr float kTriangleReach = 3;

// The density field is sought this many particle radii before and twice as many behind the blend or
// the reference depth; in gaps, which have nothing behind them, farther.
constexpr float kSearch = 2;
constexpr float kFarSearch = 12;

cl_float4 limits_of(const RegionParams& params) {
  return {{static_cast<float>(params.contour_density), static_cast<float>(params.blob_density),
           kTriangleReach, kSearch}};
}

}  // namespace

void settle_samples(Device& device, const View& view, const SampleLists& lists,
                    const DeviceCells& cells, const DeviceCells& levelled,
                    const Buffer<float>& triangle_depth, const Buffer<float>& reference,
                    const SurfaceBuffers& surface, const Buffer<float>& behind,
                    const RegionParams& params, bool only_gaps) {
  const SampleGrid& grid = surface.grid;
  const auto left = allocate<cl_int>(device, lists.sample.size);
  const int width = device.state().vector_width, wide = device.state().wide_width();
  launch(device, kernels::settle_samples, width, range_of(lists, width), lists.sample, lists.count,
         triangle_depth, reference, surface.trust, surface.depth, behind, left, cells.x, cells.y,
         cells.z, cells.tag, cells.start, cells.inverse_cell, cells.mask, cells.weight,
         cl_int2{{grid.nx, grid.ny}}, grid.first, grid.step, kernel_rays(view), limits_of(params),
         static_cast<cl_int>(only_gaps));
  launch(device, kernels::follow_field, wide, range_of(lists, wide), left, lists.count, reference,
         surface.trust, surface.depth, surface.normal, surface.group, surface.kind, behind, cells.x,
         cells.y, cells.z, cells.tag, cells.start, cells.inverse_cell, cells.mask, cells.weight,
         levelled.weight, cl_int2{{grid.nx, grid.ny}}, grid.first, grid.step, kernel_rays(view),
         limits_of(params), static_cast<cl_float>(only_gaps ? kFarSearch : 2 * kSearch));
}

void settle_points(Device& device, const View& view, const DeviceCells& cells,
                   const DeviceCells& levelled, const Buffer<float>& points,
                   const Buffer<float>& reference, const SurfaceBuffers& surface,
                   const RegionParams& params) {
  const std::size_t n = surface.grid.size();
  const auto no_triangle = filled<float>(device, n, kNoSurface);
  const auto behind = allocate<float>(device, n);
  launch(device, kernels::settle_points, 1, {n}, no_triangle, reference, surface.trust,
         surface.depth, surface.normal, surface.group, surface.kind, behind, points, cells.x,
         cells.y, cells.z, cells.tag, cells.start, cells.inverse_cell, cells.mask, cells.weight,
         levelled.weight, static_cast<cl_int>(n), kernel_rays(view), limits_of(params), kSearch);
}

Extent splash_extent(Device& device, const SplatParticles& splash, const SampleGrid& grid,
                     const OccupiedBlocks& asked) {
  // The field of a lone particle reaches one particle radius; among others it reaches farther.
  constexpr double kBlobReach = 2;
  return splat_extent(device, splash, grid, kBlobReach, asked);
}

void draw_splash(Device& device, const View& view, const SampleLists& lists,
                 const DeviceCells& levelled, const Extent& extent, const SurfaceBuffers& surface,
                 const RegionParams& params, const Buffer<float>* open) {
  const SampleGrid& grid = surface.grid;
  const int width = device.state().wide_width();
  // One sample an item sees for itself that it has nothing to do; vectors are to be full.
  const SampleLists nearer = width == 1 ? lists
                             : open ? keep_samples(device, lists, extent.from, surface.depth, *open)
                                    : keep_samples(device, lists, extent.from, surface.depth);
  launch(device, kernels::draw_splash, width, range_of(nearer, width), nearer.sample, nearer.count,
         extent.from, extent.to, surface.depth, surface.normal, surface.group, surface.kind,
         levelled.x, levelled.y, levelled.z, levelled.weight, levelled.tag, levelled.start,
         levelled.inverse_cell, levelled.mask, cl_int2{{grid.nx, grid.ny}}, grid.first, grid.step,
         kernel_rays(view), static_cast<cl_float>(params.blob_density),
         open ? *open : surface.depth, cl_int{open == nullptr});
}

}  // namespace meniscus
