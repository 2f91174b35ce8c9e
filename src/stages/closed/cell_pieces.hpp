// cell_pieces: how the surface passes through a cell, from the values at its corners: which of the
// crossed edges belong to one piece of it, as in dual marching cubes (Nielson 2004). Where a face
// has its corners alternately inside and outside, both cells beside it decide alike how the surface
// passes, by the saddle of the values at its corners (Nielson and Hamann 1991).
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

#include "stages/closed/space_grid.hpp"

namespace meniscus {

/// A cell that the surface passes through.
struct SurfaceCell {
  std::int32_t block = 0;
  std::uint8_t bit = 0;       // of its lowest corner
  std::uint8_t pieces = 0;    // of surface, one vertex each; 1 to 4
  std::uint8_t doubled = 0;   // faces, a bit each, that one piece crosses twice
  std::uint16_t crossed = 0;  // which of the 12 edges are, a bit each
  std::uint32_t piece = 0;    // of each of them, two bits each
  std::uint32_t first = 0;    // its first vertex
};

/// How a cell's corners, edges and faces lie to each other. Corners are i + 2 j + 4 k; edges 0 to 3
/// along x, then y, then z, in the order of their lower corners; faces 2 axis + side.
struct CellTables {
  std::array<std::array<int, 2>, 12> ends{};    // corners of an edge
  std::array<std::array<int, 4>, 6> corners{};  // of a face, all around
  std::array<std::array<int, 4>, 6> edges{};    // edge q lies between corners q and q + 1
  std::array<std::array<int, 2>, 12> faces{};   // on which an edge lies
  std::array<std::array<int, 8>, 8> edge_between{};
};

extern const CellTables kCellTables;

/// The edge of a cell along `axis` whose lower corner has these coordinates along the next axes.
int edge_of(int axis, int b, int c);

using CornerValues = std::array<float, 8>;

inline bool is_inside(float value) { return value < 0; }

/// Where corner c of the cell whose lowest corner has a bit in a block lies.
inline constexpr auto kCornersOfCells = [] {
  std::array<std::array<CornerPlace, 8>, 64> all{};
  for (int bit = 0; bit < 64; ++bit)
    for (int c = 0; c < 8; ++c) {
      const auto [i, j, k] = place_in_block(bit);
      all[bit][c] = corner_place(i + (c & 1), j + (c >> 1 & 1), k + (c >> 2));
    }
  return all;
}();

inline Corner corner_of_cell(const SpaceGrid& grid, std::size_t block, int bit, int c) {
  const CornerPlace& place =
      kCornersOfCells[static_cast<std::size_t>(bit)][static_cast<std::size_t>(c)];
  return {grid.around[block][place.around], place.bit};
}

/// The values at a cell's corners, which are all known.
CornerValues values_of(const SpaceGrid& grid, std::size_t block, int bit);

/// Of a face whose corners are alternately inside and outside: which edge (a place in
/// CellTables::edges) each one goes on to.
std::array<int, 4> partners(const CornerValues& value, int face);

/// Numbers the pieces of surface of a cell, and marks the faces that one of them crosses twice.
void find_pieces(const CornerValues& value, SurfaceCell& cell);

/// The piece that a crossed edge belongs to.
inline std::uint32_t piece_of(const SurfaceCell& cell, int edge) {
  return cell.piece >> 2 * edge & 3;
}

}  // namespace meniscus
