// gather: streams particles through the device and hands on those that may matter.
#pragma once

#include <functional>
#include <vector>

#include "device/device.hpp"
#include "meniscus/source.hpp"
#include "prepare/survey.hpp"
#include "stages/view.hpp"

namespace meniscus {

/// A map of the screen and a border around it, in cells of a fixed number of pixels.
struct FrontMap {
  double cell = 1;          // pixels
  int border = 0;           // cells beyond each edge of the screen
  int nx = 0, ny = 0;       // cells
  double margin = 0;        // particles whose disc of so many radii meets the screen are in view
  Buffer<cl_float4> layer;  // [ny*nx] nearest depth, its slopes along u and v (per cell, of the
                            // flatter side), and how thick the front layer is in depth
  int block = 1;            // cells along a side of what shares a limit
  int blocks_x = 1, blocks_y = 1;
  std::vector<float> limit;  // [blocks_y*blocks_x] deepest depth of interest, particle radii
};

/// How fronts are looked for. Lengths are in pixels, or in particle radii.
struct FrontSearch {
  double cell = 1;       // pixels, side of a cell
  double border = 0;     // pixels around the screen
  double margin = 0;     // radii, see FrontMap
  double block = 1;      // pixels, side of what shares a limit
  double around = 0;     // pixels: the farthest front within this sets a block's limit
  double reach = 0;      // radii: the limit lies this far behind that front
  double thickness = 0;  // radii, of the front layer along its normal
};

/// What a map of such cells takes of the device's memory with the limits of its blocks, bytes.
std::size_t map_size(const View& view, double cell, double border);

/// How many particles a chunk has so that the buffers of a pass, beside `map_bytes` of maps, fit
/// `memory` bytes of the device. Throws InvalidArgument, saying how much is the least.
std::size_t chunk_size(std::size_t memory, std::size_t map_bytes);

/// A map with no fronts, whose limits let everything in view pass.
FrontMap empty_map(Device& device, const View& view, double margin);

/// The nearest particles in cells on the screen and around it, and limits behind them, of all
/// particles in all processes of the source's team. A block has no limit where a part of what is
/// within `around` of it is empty. A lone empty cell does not count as such.
FrontMap find_fronts(Device& device, const View& view, const ParticleSource& source,
                     std::size_t chunk, const FrontSearch& search);

/// Calls take(chunk, places) for every chunk of this process's share that has any, with the places
/// of the particles in view before their block's limit, in any order; the highest bit marks those
/// of the front layer. The device looks at the next chunk meanwhile.
void select_near(
    Device& device, const View& view, const ParticleSource& source, std::size_t chunk,
    const FrontMap& map, const ChunkValues& also,
    const std::function<void(const ParticleChunk&, const std::vector<cl_uint>&)>& take);

inline constexpr cl_uint kIsSeen = 0x80000000u;

}  // namespace meniscus
