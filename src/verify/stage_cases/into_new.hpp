// Stages that write into what a frame keeps, here into new buffers: cases and tests keep nothing.
#pragma once

#include "stages/frame/density.hpp"
#include "stages/frame/minima.hpp"
#include "stages/frame/visible.hpp"
#include "stages/sample/behind.hpp"
#include "stages/sample/region.hpp"
#include "stages/sample/samples.hpp"

namespace meniscus {

/// The occupied blocks of a map that is written everywhere, and of one in which nothing is so far.
inline OccupiedBlocks any_blocks(Device& device, const SampleGrid& grid) {
  return constant<cl_int>(device, blocks_in(grid), 1);
}
inline OccupiedBlocks no_blocks(Device& device, const SampleGrid& grid) {
  return filled<cl_int>(device, blocks_in(grid), 0);
}

/// A map to draw into: of `value` where the device lowers or raises it by atomics, else of
/// anything.
inline Buffer<float> map_to_draw(Device& device, const SampleGrid& grid, float value) {
  return draws_by_minima(device) ? filled(device, grid.size(), value)
                                 : allocate<float>(device, grid.size());
}

inline Fronts splat_fronts(Device& device, const SplatParticles& particles, const SampleGrid& grid,
                           double footprint, double bulge) {
  const Fronts maps{map_to_draw(device, grid, kNoSurface), no_blocks(device, grid)};
  splat_fronts(device, particles, grid, footprint, bulge, maps);
  return maps;
}

inline Extent splat_extent(Device& device, const SplatParticles& particles, const SampleGrid& grid,
                           double footprint, const OccupiedBlocks& needed) {
  const Extent extent{map_to_draw(device, grid, kNoSurface), map_to_draw(device, grid, 0.0f),
                      no_blocks(device, grid)};
  splat_extent(device, particles, grid, footprint, needed, extent);
  return extent;
}

inline Buffer<float> splat_behind(Device& device, const DiscsBehind& discs,
                                  const SampleLists& samples, const Buffer<float>& behind,
                                  double gap) {
  const Buffer<float> depth = map_to_draw(device, samples.grid, kNoSurface);
  splat_behind(device, discs, samples, behind, gap, depth);
  return depth;
}

inline Buffer<float> draw_triangles(Device& device, const View& view, const Triangulation& mesh,
                                    const SampleGrid& grid, const OccupiedBlocks& needed) {
  const Buffer<float> depth = map_to_draw(device, grid, kNoSurface);
  draw_triangles(device, view, upload_triangles(device, mesh), grid, needed, depth);
  return depth;
}

/// Of a map that is written everywhere.
inline GapLists list_gaps(Device& device, const SampleGrid& grid, const Buffer<float>& open,
                          double gap) {
  return list_gaps(device, grid, open, any_blocks(device, grid), blocks_of(device, grid, false),
                   gap);
}

inline DeviceCells level_cells(Device& device, const DeviceCells& cells, const RegionParams& params,
                               double lone = 1) {
  return level_cells(device, cells, Measured::everywhere, params,
                     allocate<float>(device, 4 * cells.x.size), lone);
}

}  // namespace meniscus
