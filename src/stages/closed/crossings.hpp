// crossings: where edges between corners of a grid in space cross the surface (space_grid.hpp).
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "stages/closed/implicit.hpp"
#include "stages/closed/space_grid.hpp"

namespace meniscus {

/// Edges of the grid whose ends lie on both sides of the surface, by block, axis and bit.
struct CrossedEdges {
  /// Of each block and axis: the corners from which such an edge goes on along the axis, and the
  /// place of the first of these edges.
  std::vector<std::array<std::uint64_t, 3>> mask;
  std::vector<std::array<std::uint32_t, 3>> first;

  std::vector<std::int32_t> block;  // [edges] ascending
  std::vector<std::uint8_t> bit;    // [edges] the corner at the lower end
  std::vector<std::uint8_t> axis;   // [edges]
  std::vector<float> at;            // [edges] 0 at the lower end .. 1
  std::vector<Vec3d> position;      // [edges] particle radii
  std::vector<Vec3d> normal;        // [edges] unit, outward
  std::vector<float> value;         // [edges] F there: about zero
  std::size_t size() const { return block.size(); }
};

/// The edges of a grid whose surface is closed, in order. Where they cross it is not known yet.
/// Throws InvalidArgument where there are more than the program can hold.
CrossedEdges list_crossings(const SpaceGrid& grid);

/// Where they cross the surface if F is linear along them. Normals are left empty.
void guess_crossings(const SpaceGrid& grid, CrossedEdges& edges);

/// The outward normal at a crossing, by F at the corners around its edge.
Vec3d guess_normal(const SpaceGrid& grid, const CrossedEdges& edges, std::size_t e);

/// The cells around some of the crossings: masks of their lowest corners, by block.
std::vector<std::uint64_t> cells_of(const SpaceGrid& grid, const CrossedEdges& edges,
                                    const std::vector<std::uint32_t>& some);

/// Some crossings, ascending, and all others of the cells that these belong to.
std::vector<std::uint32_t> of_same_cells(const SpaceGrid& grid, const CrossedEdges& edges,
                                         const std::vector<std::uint32_t>& some);

/// F and its gradient's way at some of the crossings. Waits.
void measure_crossings(Device& device, const ImplicitFunction& function,
                       const std::vector<std::uint32_t>& some, CrossedEdges& edges);

/// Where they cross the surface: F is evaluated at up to six points of each, until it is less than
/// .004 particle radii. Waits.
void find_crossings(Device& device, const ImplicitFunction& function, const SpaceGrid& grid,
                    CrossedEdges& edges);

}  // namespace meniscus
