#include "stages/density.hpp"

namespace meniscus {
namespace {

// A kept triangle's depth within this many particle radii of a sample vouches for it without
// measuring the density.
constexpr float kTriangleReach = 3;

Range tiles(const SampleGrid& grid) {
  return {static_cast<std::size_t>(grid.nx), static_cast<std::size_t>(grid.ny), 16, 4};
}

}  // namespace

DeviceCells upload_cells(Device& device, const Cells& cells) {
  return {upload(device, cells.x),     upload(device, cells.y), upload(device, cells.z),
          upload(device, cells.start), cells.inverse_cell,      cells.mask};
}

Buffer<float> cut_contour(Device& device, const View& view, const DeviceCells& cells,
                          const Buffer<float>& triangle_depth, const Buffer<float>& reference,
                          const SurfaceBuffers& surface, const RegionParams& params) {
  const SampleGrid& grid = surface.grid;
  const auto behind = allocate<float>(device, grid.size());
  launch(device, "density.cl", "cut_contour", tiles(grid), "", triangle_depth, reference,
         surface.depth, behind, cells.x, cells.y, cells.z, cells.start, cells.inverse_cell,
         cells.mask, cl_int2{{grid.nx, grid.ny}}, grid.first, grid.step, kernel_rays(view),
         static_cast<cl_float>(params.contour_density), kTriangleReach);
  return behind;
}

void draw_splash(Device& device, const View& view, const DeviceCells& cells,
                 const SplatParticles& splash, const SurfaceBuffers& surface,
                 const RegionParams& params) {
  if (splash.count == 0) return;
  const SampleGrid& grid = surface.grid;
  // The field of a lone particle reaches one particle radius; among others it reaches farther.
  constexpr double kBlobReach = 2;
  const Buffer<float> from = splat_depth(device, splash, grid, kBlobReach);
  const Buffer<float> to = splat_far(device, splash, grid, kBlobReach);
  launch(device, "density.cl", "march_density", tiles(grid), "", from, to, surface.depth,
         surface.normal, surface.group, surface.kind, cells.x, cells.y, cells.z, cells.start,
         cells.inverse_cell, cells.mask, cl_int2{{grid.nx, grid.ny}}, grid.first, grid.step,
         kernel_rays(view), static_cast<cl_float>(params.blob_density));
}

}  // namespace meniscus
