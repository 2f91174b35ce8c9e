// space_grid: a grid of cubic cells that exists near the surface alone. F is evaluated at the
// corners of cells.
#pragma once

#include <array>
#include <bit>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <string>
#include <vector>

#include "base/key_table.hpp"
#include "stages/closed/implicit.hpp"

namespace meniscus {

inline constexpr int kBlockSide = 4;  // corners
inline constexpr std::int32_t kNoBlock = -1;

/// 4 x 4 x 4 corners. Bit i + 4 j + 16 k of a mask, and as many values, stand for the corner (i, j,
/// k) from the block's first one on.
struct CornerBlock {
  std::array<std::int32_t, 3> at{};  // the first corner is (4 at) cells from the origin
  std::uint64_t wanted = 0;          // corners whose values matter
  std::uint64_t known = 0;           // corners whose values are there
  std::uint64_t inside = 0;          // those of them that are below 0
  /// Of each axis the crossed edges whose cells want_closed() has gone through.
  std::array<std::uint64_t, 3> closed{};
  std::array<float, 64> value{};  // F
};

/// The (i, j, k) of the corner that a bit stands for.
constexpr std::array<int, 3> place_in_block(int bit) { return {bit & 3, bit >> 2 & 3, bit >> 4}; }

/// Corners from `low` on and before `high`, counted from the origin; all there are.
struct CornerBox {
  static constexpr std::int64_t kAll = std::int64_t{1} << 40;
  std::array<std::int64_t, 3> low{-kAll, -kAll, -kAll}, high{kAll, kAll, kAll};

  bool holds(std::int64_t i, std::int64_t j, std::int64_t k) const {
    return i >= low[0] && i < high[0] && j >= low[1] && j < high[1] && k >= low[2] && k < high[2];
  }
  /// Which corners of the block at `at` it holds.
  std::uint64_t mask_of(const std::array<std::int32_t, 3>& at) const;
};

/// Blocks in one number that is ordered by z, then y, then x.
std::uint64_t key_of(const std::array<std::int32_t, 3>& at);

struct SpaceGrid {
  double cell = 1;   // side of a cell, particle radii
  CornerBox within;  // no other corner is ever wanted
  std::vector<CornerBlock> blocks;
  KeyTable numbers;  // of blocks, by key_of() their places
  /// The blocks around each, (dx + 1) + 3 (dy + 1) + 9 (dz + 1), kNoBlock where there is none.
  std::vector<std::array<std::int32_t, 27>> around;

  /// The position of a corner of a block, particle radii.
  Vec3d position(std::size_t block, int bit) const {
    const CornerBlock& b = blocks[block];
    const auto [i, j, k] = place_in_block(bit);
    return {cell * (kBlockSide * b.at[0] + i), cell * (kBlockSide * b.at[1] + j),
            cell * (kBlockSide * b.at[2] + k)};
  }
};

/// A corner as a block and the corner's bit in it.
struct Corner {
  std::int32_t block = kNoBlock;
  int bit = 0;
};

/// Where a corner lies as seen from a block: in which block, a place in SpaceGrid::around, and its
/// bit there.
struct CornerPlace {
  std::uint8_t around = 0, bit = 0;
};

/// That of the corner (i, j, k) from the block's first one, -4 .. 7 each.
constexpr CornerPlace corner_place(int i, int j, int k) {
  const int x = (i + 4) >> 2, y = (j + 4) >> 2, z = (k + 4) >> 2;
  return {static_cast<std::uint8_t>(x + 3 * y + 9 * z),
          static_cast<std::uint8_t>((i & 3) + 4 * (j & 3) + 16 * (k & 3))};
}

/// The corner itself; without a block where there is none.
inline Corner corner_at(const SpaceGrid& grid, std::size_t block, int i, int j, int k) {
  const CornerPlace place = corner_place(i, j, k);
  return {grid.around[block][place.around], place.bit};
}

/// F at a corner whose block is there.
inline float value_at(const SpaceGrid& grid, const Corner& corner) {
  return grid.blocks[static_cast<std::size_t>(corner.block)]
      .value[static_cast<std::size_t>(corner.bit)];
}

/// The block behind a block along an axis, and the one before it; kNoBlock where there is none.
inline std::int32_t next_block(const SpaceGrid& grid, std::size_t block, int axis) {
  constexpr std::array<std::size_t, 3> kNext{14, 16, 22};
  return grid.around[block][kNext[static_cast<std::size_t>(axis)]];
}
inline std::int32_t block_before(const SpaceGrid& grid, std::size_t block, int axis) {
  constexpr std::array<std::size_t, 3> kBefore{12, 10, 4};
  return grid.around[block][kBefore[static_cast<std::size_t>(axis)]];
}

/// The mask of a block, moved so that each corner has the bit of the next one along an axis. Those
/// of the last layer have that of the next block's first layer.
inline std::uint64_t of_next(std::uint64_t own, std::uint64_t next, int axis) {
  if (axis == 0) return (own >> 1 & 0x7777777777777777u) | (next & 0x1111111111111111u) << 3;
  if (axis == 1) return (own >> 4 & 0x0fff0fff0fff0fffu) | (next & 0x000f000f000f000fu) << 12;
  return own >> 16 | next << 48;
}
/// The same of the corner before.
inline std::uint64_t of_before(std::uint64_t own, std::uint64_t before, int axis) {
  if (axis == 0) return (own & 0x7777777777777777u) << 1 | (before >> 3 & 0x1111111111111111u);
  if (axis == 1) return (own & 0x0fff0fff0fff0fffu) << 4 | (before >> 12 & 0x000f000f000f000fu);
  return own << 16 | before >> 48;
}

/// The particles that see air: the density at them is below .9, or its slope above .1 (1 / particle
/// radii). A face has .85 and .25, a single layer .70 and 0.
///
///   gradients  [4][n] of measure_gradients over these cells
Points near_air(const Cells& cells, const float* gradients);

/// How far from the origin a point may lie along an axis so that there are corners within `reach`
/// of it; particle radii, as its arguments.
double farthest_point(double reach, double cell);

/// A grid whose corners within `reach` of one of the points (particle radii) are wanted, of those
/// in `within`. Throws InvalidArgument where that is more than the program can hold.
SpaceGrid grid_around(const Points& points, double reach, double cell,
                      const CornerBox& within = {});

/// Fills in the corners that are wanted and not known, block by block: `value_at` is given a
/// million points at a time and returns F at each. Those of a block begin at a multiple of
/// `together` (points_together()).
void fill_corners(SpaceGrid& grid, std::size_t together,
                  const std::function<std::vector<float>(const Points& points)>& value_at);

/// Wants all corners of all cells around the edges that cross the surface, as far as corners are
/// known. Returns whether any of them is not known. Once none is, the surface of these edges is
/// closed. What an earlier call wanted is to be filled in before: it is not looked at again.
bool want_closed(SpaceGrid& grid);

/// Forgets the values of all corners outside a box.
void forget_outside(SpaceGrid& grid, const CornerBox& box);

/// The corners of a block from which an edge whose ends lie on both sides of the surface goes on
/// along an axis; of edges whose ends are known.
std::uint64_t crossed_from(const SpaceGrid& grid, std::size_t block, int axis);

/// Calls visit(bit) for each bit of a mask, ascending.
template <class Visit>
void each_bit(std::uint64_t mask, Visit&& visit) {
  for (; mask != 0; mask &= mask - 1) visit(std::countr_zero(mask));
}

/// Throws InvalidArgument: cells of this side (particle radii) make too many of something.
[[noreturn]] void refuse_cells(double cell, const std::string& what);

}  // namespace meniscus
