// samples: lists of the samples that a stage has to work on (samples.cl).
#pragma once

#include "device/device.hpp"
#include "stages/frame/occupied_blocks.hpp"
#include "stages/stage_data.hpp"

namespace meniscus {

/// Samples of a grid, by tile of 16 x 16.
struct SampleLists {
  SampleGrid grid;
  int nx = 0, ny = 0;     // tiles
  Buffer<cl_int> sample;  // [tiles][256] indices into the grid, small blocks of the screen in a row
  Buffer<cl_int> count;   // [2][tiles] how many are in use; of a second list (samples.cl)
  std::size_t tiles() const { return static_cast<std::size_t>(nx) * static_cast<std::size_t>(ny); }
};

/// Blocks of 8 x 8 samples, four to a tile, row by row: 1 where one of them has been listed.
using ListedBlocks = Buffer<cl_uchar>;

/// All of a grid, with or without samples.
ListedBlocks blocks_of(Device& device, const SampleGrid& grid, bool listed);

/// Samples that show nothing so far, and what bounds fronts that may show behind them.
struct GapLists {
  SampleLists lists;
  SampleLists again;    // the same, for who works on them a second time: with an empty second list
  Buffer<float> bound;  // [bins] discs with a greater key (Drawn::behind) are left out
};

/// All samples where `open` is finite; notes their blocks. Fronts count that are deeper there than
/// open + gap (particle radii). Does not wait.
GapLists list_gaps(Device& device, const SampleGrid& grid, const Buffer<float>& open,
                   const OccupiedBlocks& occupied, const ListedBlocks& blocks, double gap);

/// Samples that may show surface, and those that may show splash.
struct LayerSamples {
  SampleLists surface, splash;
};

/// Maps that say where there may be surface and splash, and in which blocks they are finite.
struct FrontMaps {
  const Buffer<float>&reference, &splash;
  const OccupiedBlocks &occupied, &splash_occupied;
};

/// The samples where either is finite, of every `every`th row and column (a power of
/// two, kTile at most). Does not wait.
LayerSamples list_fronts(Device& device, const SampleGrid& grid, const FrontMaps& fronts,
                         int every);

/// The samples that interpolation leaves (interpolate.cl); notes their blocks. Does not wait.
///
///   wanted  [rows][stride] of cells: bits say which of their three samples may show surface and,
///           from the fourth on, splash; 0 beyond the last cells, up to whole tiles of samples
///   stride  a multiple of 8
LayerSamples list_between(Device& device, const SampleGrid& grid, const Buffer<cl_uchar>& wanted,
                          int stride, int every, const ListedBlocks& blocks);

/// Whether samples that a kernel would leave alone are taken from its list first: vectors are to be
/// full. Where an item takes one sample, it sees for itself that it has nothing to do.
inline bool vectors_are_filled(Device& device) { return device.state().vector_width > 1; }

/// Those of `lists` where `nearer` is less than `depth`. Does not wait.
SampleLists keep_samples(Device& device, const SampleLists& lists, const Buffer<float>& nearer,
                         const Buffer<float>& depth);

/// Those of `lists` where `nearer` is less than `depth` and `unwanted` is not finite. Does not
/// wait.
SampleLists keep_samples(Device& device, const SampleLists& lists, const Buffer<float>& nearer,
                         const Buffer<float>& depth, const Buffer<float>& unwanted);

/// The range of a kernel that takes `width` places of the lists at a time. Where that is one place,
/// a work-item for each, in groups of one tile or a part of it; else one item goes through the
/// list, because most lists are short and CPUs run the items of a group one after another; the
/// last items of the range may be beyond all tiles.
Range range_of(const SampleLists& lists, int width);

}  // namespace meniscus
