// near_lists: who lies near each of some particles, for the host and for the lists of devices.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "device/device.hpp"
#include "stages/frame/cells.hpp"
#include "stages/frame/project.hpp"

namespace meniscus {

/// Some of the projected particles in cells of side `side`; an item is a place in `index`.
Cells cells_of(const Projected& projected, const std::vector<std::int32_t>& index, double side);

/// Who lies near each of some centres, in blocks of so many of them.
struct NearLists {
  static constexpr std::size_t kBlock = 256;
  struct Block {
    std::vector<std::size_t> start;  // [centres + 1] where those of each begin
    std::vector<cl_int> near;        // places in the surface
  };
  std::vector<Block> blocks;

  /// The places near centre k.
  std::span<const cl_int> operator[](std::size_t k) const {
    const Block& block = blocks[k / kBlock];
    const std::size_t* const own = block.start.data() + k % kBlock;
    return std::span(block.near).subspan(own[0], own[1] - own[0]);
  }
};

/// All particles of `around` within `reach` of each of `centre` (itself among them), particle
/// radii.
NearLists list_near(const Projected& projected, const std::vector<std::int32_t>& centre,
                    const std::vector<std::int32_t>& around, double reach);

/// The same among the points of cells, of side `reach` or more: items stand for places.
NearLists list_near(const Projected& projected, const std::vector<std::int32_t>& centre,
                    const Cells& cells, double reach);

}  // namespace meniscus
