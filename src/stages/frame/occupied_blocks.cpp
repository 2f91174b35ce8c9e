#include "stages/frame/occupied_blocks.hpp"

namespace meniscus {

std::size_t blocks_in(const SampleGrid& grid) {
  const auto tiles = [](int side) { return static_cast<std::size_t>((side + kTile - 1) / kTile); };
  return 4 * tiles(grid.nx) * tiles(grid.ny);
}

}  // namespace meniscus
