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
#include <cstdint>
#include <vector>

#include "stages/space_grid.hpp"

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

/// How vertices are placed.
struct Placing {
  double flat = 0.05;      // planes that all are within about 15 degrees of their mean are one
                           // smooth sheet
  double most_off = 0.05;  // F at a crossing is off by at most this, particle radii; where it is
                           // more, F jumps there
  double margin = 0.01;    // vertices keep this share of a cell from its faces, so that no two of
                           // them coincide; below 0: leave it by as much
  bool sheets_by_mean = false;  // one smooth sheet's vertex moves along the mean of its normals,
                                // not along the eigenvector: quicker, and nearly the same
};

/// The vertices of a grid's surface: each is where the planes of its piece's crossings meet, as far
/// as they tell, and else in the middle of the crossings; within its cell (the smallest squared
/// distance from the planes, directions with less than `flat` of the largest eigenvalue left out).
DualMesh place_vertices(const SpaceGrid& grid, const CrossedEdges& edges, const Placing& placing);

/// Those of the cells around some of the edges.
DualMesh place_vertices(const SpaceGrid& grid, const CrossedEdges& edges,
                        const std::vector<std::uint32_t>& some, const Placing& placing);

/// Moves vertices that are on no crease onto F = 0, within their cells, and gives them F's normals.
/// Waits.
void settle_vertices(Device& device, const ImplicitFunction& function, DualMesh& mesh);

/// A quadrangle around each crossed edge, in two triangles: of both diagonals the one whose middle
/// is nearer to the surface. Adds the vertices between doubled neighbours. Edges that do not begin
/// in `within` are left out.
void join_vertices(const SpaceGrid& grid, const CrossedEdges& edges, DualMesh& mesh,
                   const CornerBox& within = {});

/// The same around some of the edges, ascending, whose cells have their vertices. The mesh is open
/// where others are left out.
void join_vertices(const SpaceGrid& grid, const CrossedEdges& edges,
                   const std::vector<std::uint32_t>& some, DualMesh& mesh);

/// Leaves out pieces of the mesh that enclose less fluid, or less air, than so much (particle radii
/// cubed), and the vertices that are theirs. Open pieces stay. Returns which vertices are left,
/// ascending.
std::vector<std::uint32_t> drop_crumbs(DualMesh& mesh, double least_fluid, double least_air);

}  // namespace meniscus
