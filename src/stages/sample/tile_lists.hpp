// tile_lists: what may show in each tile of 16 x 16 samples, by boxes on the screen
// (tile_lists.cl).
#pragma once

#include <vector>

#include "device/device.hpp"
#include "stages/sample/fit_records.hpp"
#include "stages/sample/samples.hpp"

namespace meniscus {

/// A box on the screen, in samples; both ends included. Empty when i1 < i0.
struct ScreenBox {
  int i0, i1, j0, j1;
};

/// The box around the projections of a box in eye space, from its middle and half sides. At one
/// depth a pixel coordinate is linear in x and y.
ScreenBox box_of(const View& view, const Vec3d& centre, const Vec3d& half, const SampleGrid& grid);

/// Which boxes meet each tile.
struct TileLists {
  int nx = 0, ny = 0;         // tiles
  std::vector<cl_int> start;  // [tiles + 1]
  std::vector<cl_int> box;    // ascending in each tile
};

/// Lists the boxes that are wanted.
TileLists list_boxes(const std::vector<ScreenBox>& boxes, const std::vector<char>& wanted,
                     const SampleGrid& grid);

/// The fits of each tile on the device.
struct FitList {
  Buffer<cl_int> start, fit;  // [tiles + 1]; ascending in each tile
  Buffer<float> place;        // [rows][fit.size] where the listed fits lie, see tile_lists.cl
};

/// Those that rays may meet (kernel blend_groups, record 11), and those that may be steep to
/// rays, or turn away from the eye, within their reach (record 13).
struct FitTiles {
  int nx = 0, ny = 0;  // tiles
  FitList met, rim;
};

FitTiles list_fits(Device& device, const View& view, const BlendRecords& records,
                   const SampleGrid& grid);

}  // namespace meniscus
