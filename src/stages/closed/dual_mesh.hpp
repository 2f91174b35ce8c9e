// dual_mesh: a closed surface from where the edges of a grid cross it, by dual contouring (Ju,
// Losasso, Schaefer and Warren 2002), made manifold.
//
// A cell has a vertex for each piece of surface in it, as in dual marching cubes (Nielson 2004), so
// that sheets that pass through one cell stay apart. Where a face of a cell has its corners
// alternately inside and outside, both cells beside it decide alike how the surface passes (by the
// saddle of the values at its corners, Nielson and Hamann 1991). Where two vertices are neighbours
// through such a face twice, the second edge between them gets a vertex of its own in its middle.
// So every edge has two triangles, and the triangles around a vertex are one fan.
#pragma once

#include <array>
#include <bit>
#include <cstdint>
#include <vector>

#include "stages/closed/cell_pieces.hpp"
#include "stages/closed/crossings.hpp"

namespace meniscus {

/// A vertex between two doubled neighbours, in the second edge through the low face of a cell.
struct VertexBetween {
  std::uint32_t cell = 0;  // among all
  std::int32_t axis = 0;   // of the face
  std::int32_t block = 0;  // whose edges had it first
};

struct DualMesh {
  std::vector<SurfaceCell> cells;         // in the order of blocks and bits
  std::vector<std::uint64_t> mask;        // [blocks] which cells these are
  std::vector<std::uint32_t> first_cell;  // [blocks]
  std::vector<Vec3d> position;            // [vertices] particle radii
  std::vector<Vec3d> normal;              // [vertices] unit, outward
  std::vector<std::uint8_t> sharp;        // [vertices] on a crease or a corner
  std::vector<std::uint8_t> open;  // [vertices] some triangles around it are left out; or empty
  std::vector<std::array<Vec3d, 2>> bounds;  // [vertices] of the vertex's place in its cell
  std::vector<std::array<std::uint32_t, 3>> triangle;  // counter-clockwise seen from outside
  std::vector<VertexBetween> between;                  // [vertices that are no cell's]
  std::vector<std::uint32_t> triangles_of;             // [blocks] how many their edges have
};

/// How many bits of a mask come before this one. (std::popcount() is a call without SSE 4.2.)
inline std::uint32_t count_before(std::uint64_t mask, int bit) {
  std::uint64_t sum =
      mask & ((std::uint64_t{1} << bit) - 1);  // of ever more bits beside each other
  sum -= sum >> 1 & 0x5555555555555555u;
  sum = (sum & 0x3333333333333333u) + (sum >> 2 & 0x3333333333333333u);
  sum = (sum + (sum >> 4)) & 0x0f0f0f0f0f0f0f0fu;
  return static_cast<std::uint32_t>(sum * 0x0101010101010101u >> 56);
}

/// The place of a cell's crossed edge among all.
inline std::uint32_t crossing_of(const SpaceGrid& grid, const CrossedEdges& edges,
                                 const SurfaceCell& cell, int edge) {
  const Corner lower = corner_of_cell(grid, static_cast<std::size_t>(cell.block), cell.bit,
                                      kCellTables.ends[edge][0]);
  const auto block = static_cast<std::size_t>(lower.block),
             axis = static_cast<std::size_t>(edge / 4);
  return edges.first[block][axis] + count_before(edges.mask[block][axis], lower.bit);
}

/// The place of a cell among all.
inline std::uint32_t cell_at(const DualMesh& mesh, const Corner& lowest) {
  const std::size_t b = static_cast<std::size_t>(lowest.block);
  return mesh.first_cell[b] + count_before(mesh.mask[b], lowest.bit);
}

}  // namespace meniscus
