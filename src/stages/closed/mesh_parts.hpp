// mesh_parts: a closed mesh that is made part by part. Space is shared out by blocks of cells; each
// part makes the vertices and the triangles of its own blocks, and together they are the mesh that
// all blocks at once would make, to the last bit and in the same order.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "stages/closed/block_box.hpp"
#include "stages/closed/dual_mesh.hpp"
#include "stages/space_box.hpp"

namespace meniscus {

/// The space of blocks and of so many corners around them, in the unit of `cell`, the side of a
/// cell.
SpaceBox space_of(const BlockBox& blocks, double cell, int more = 0);

/// The corners of these blocks, and of `more` around them.
CornerBox corners_of(const BlockBox& blocks, int more = 0);

/// One part's vertices and triangles, block by block.
struct MeshPart {
  struct Block {
    std::uint64_t key = 0;    // key_of() its place
    std::uint32_t round = 0;  // of want_closed() that added it; 0: the grid began with it
    std::uint32_t vertices = 0, between = 0, triangles = 0;
  };
  /// A vertex by its cell, whoever made it.
  struct Name {
    std::uint64_t block = 0;   // key
    std::uint32_t vertex = 0;  // four times the bit of the cell's lowest corner, and the piece
    std::uint32_t axis = 0;    // of a vertex between: of the face
  };
  std::vector<Block> blocks;         // its own, by round, then key
  std::vector<std::uint8_t> vertex;  // [vertices] as in Name, ascending in each block
  std::vector<Name> between;         // the vertices between, in the order of their first edges
  std::vector<Vec3d> position;       // [vertices, then between] particle radii
  std::vector<Vec3> normal;          // [vertices, then between] unit, outward
  std::vector<Name> others;          // vertices of other parts' cells
  std::vector<std::array<std::uint32_t, 3>> triangle;  // of vertices, between, others, as one row
};

/// What a part has of a mesh that was made of the grid around it.
///
///   added  [rounds + 1] how many blocks the grid had after each round
///   own    the part's blocks; `mesh` has all vertices of the cells around their edges
MeshPart part_of(const SpaceGrid& grid, const DualMesh& mesh, const std::vector<std::size_t>& added,
                 const BlockBox& own);

/// The whole mesh.
struct JoinedMesh {
  DualMesh mesh;  // positions, normals and triangles
  /// Of each part: the places of its vertices and of its vertices between in the mesh.
  std::vector<std::vector<std::uint32_t>> place;
};

/// Joins all parts of a mesh; takes them.
JoinedMesh join_parts(std::vector<MeshPart> parts);

}  // namespace meniscus
