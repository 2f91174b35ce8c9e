// Boxes of the blocks of corners in which a grid is kept (space_grid.hpp).
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

namespace meniscus {

/// Blocks of cells from `low` on and before `high`.
struct BlockBox {
  static constexpr std::int32_t kAll = std::int32_t{1} << 28;  // farther than any block
  std::array<std::int32_t, 3> low{-kAll, -kAll, -kAll}, high{kAll, kAll, kAll};
  bool holds(const std::array<std::int32_t, 3>& at) const {
    for (std::size_t axis = 0; axis < 3; ++axis)
      if (at[axis] < low[axis] || at[axis] >= high[axis]) return false;
    return true;
  }
};

}  // namespace meniscus
