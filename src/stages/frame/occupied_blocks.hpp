// occupied_blocks: which blocks of a map of samples have anything in them. The others need not be
// written, and are not read.
#pragma once

#include <cstddef>

#include "device/device.hpp"
#include "stages/stage_data.hpp"

namespace meniscus {

/// Side of a tile, samples.
inline constexpr int kTile = records::TILE;

/// Blocks of 8 x 8 samples, four to a tile, row by row: at how many of them a map is finite. Where
/// none is, the map need not be written, and is not read.
using OccupiedBlocks = Buffer<cl_int>;

/// Blocks of all tiles of a grid.
std::size_t blocks_in(const SampleGrid& grid);

}  // namespace meniscus
