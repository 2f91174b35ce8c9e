// dual_faces: the triangles of a closed surface (dual_mesh.hpp): a quadrangle around each crossed
// edge, between the vertices of the four cells around it.
#pragma once

#include <cstdint>
#include <vector>

#include "stages/closed/dual_mesh.hpp"

namespace meniscus {

/// A quadrangle around each crossed edge, in two triangles: of both diagonals the one whose middle
/// is nearer to the surface. Adds the vertices between doubled neighbours. Edges that do not begin
/// in `within` are left out.
void join_vertices(const SpaceGrid& grid, const CrossedEdges& edges, DualMesh& mesh,
                   const CornerBox& within = {});

/// The same around some of the edges, ascending, whose cells have their vertices. The mesh is open
/// where others are left out.
void join_vertices(const SpaceGrid& grid, const CrossedEdges& edges,
                   const std::vector<std::uint32_t>& some, DualMesh& mesh);

}  // namespace meniscus
