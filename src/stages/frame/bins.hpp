// bins: which particles may show in which bin of 8 x 8 samples. What draws particles or
// triangles into maps (visible, spheres, region) gives each bin to one group of work-items, which
// needs no atomics.
#pragma once

#include <functional>

#include "device/device.hpp"
#include "device/records.hpp"
#include "stages/stage_data.hpp"

namespace meniscus {

/// Bins of 8 x 8 samples, row by row.
struct BinGrid {
  int nx = 0, ny = 0;
  std::size_t size() const { return static_cast<std::size_t>(nx) * static_cast<std::size_t>(ny); }
};
inline constexpr int kBinSide = records::BIN;  // samples
BinGrid bins_of(const SampleGrid& grid);

/// What the particles may cover. Arrays of `stride` values, `count` of them used.
struct Outlines {
  Buffer<cl_int> box;  // [4][stride] first and last sample along i and along j, all included; a
                       // last below its first: nothing
  Buffer<float> key;   // [stride] in no bin whose bound is less
  int count = 0, stride = 0;
};

/// The same for kernels that draw on a grid.
records::Outlined outlined_on(const SampleGrid& grid, const Outlines& outlines);

/// Where particles hide what is behind them. Arrays of `stride` values.
struct Covers {
  Buffer<cl_int> cells;   // [4][stride] first and last cell along i and along j; as Outlines::box
  Buffer<float> deepest;  // [stride] depth of the particle in these cells, at most; positive
  int count = 0, stride = 0;
};

/// Cells of 1 << cover_shift(radius) samples a side, 2, 4 or 8, are such that a disc of `radius`
/// samples holds one or a few.
int cover_shift(double radius);

/// Cells of 1 << shift samples a side, and how many of them are to be kNoSurface before
/// bound_bins().
struct BoundCells {
  Buffer<float> bound;
  int shift;
  std::size_t blank;
};
BoundCells room_for_cells(Device& device, int particles, const SampleGrid& grid, int shift);

/// The deepest that each bin's map can be: [bins], kNoSurface where a sample may stay without
/// surface. Does not wait.
Buffer<float> bound_bins(Device& device, const Covers& covers, const SampleGrid& grid,
                         const BoundCells& cells);

/// The same with blank cells of its own.
Buffer<float> bound_bins(Device& device, const Covers& covers, const SampleGrid& grid, int shift);

/// Particles of consecutive bins.
struct BinLists {
  Buffer<cl_int> end;  // [bins] where each listed bin's entries end; they begin at the one before
  Buffer<cl_int2> entry;       // particle; its box within the bin, packed (bins.cl)
  records::ListedBins bins{};  // that are listed
};

/// Lists the particles of all bins and calls `draw` for some bins at a time, so that device memory
/// stays bounded. Lists are in no particular order.
///
///   bound         [bins] particles with a greater key are left out
///   most_entries  of the lists at a time (8 bytes each), or fewer where the device's buffers hold
///                 fewer; one bin may have more
///
/// Waits. Throws DeviceError.
void draw_bins(Device& device, const Outlines& outlines, const Buffer<float>& bound,
               const SampleGrid& grid, const std::function<void(const BinLists&)>& draw,
               std::size_t most_entries = std::size_t{1} << 24);

/// The range of a kernel that draws the bins of `lists`: an item of `width` lanes takes the whole
/// bin, an item of one lane one sample.
Range bin_items(const BinLists& lists, int width);

}  // namespace meniscus
