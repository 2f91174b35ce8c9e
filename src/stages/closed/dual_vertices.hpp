// dual_vertices: the vertices of a closed surface (dual_mesh.hpp): one for each piece of surface in
// a cell, where the planes at its crossings meet.
#pragma once

#include <cstdint>
#include <vector>

#include "stages/closed/dual_mesh.hpp"
#include "stages/closed/implicit.hpp"

namespace meniscus {

/// How vertices are placed.
struct Placing {
  double flat = 0.05;      // planes that all are within about 15 degrees of their mean are one
                           // smooth sheet
  double most_off = 0.05;  // F at a crossing is off by at most this, particle radii; where it is
                           // more, F jumps there
  double margin = 0.01;    // vertices keep this share of a cell from its faces, so that no two of
                           // them coincide; below 0: leave it by as much
  bool quick = false;      // without eigenvalues, and nearly the same: one smooth sheet's vertex
                           // moves along the mean of its normals, others by nearest_damped(); none
                           // is told to be sharp
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

}  // namespace meniscus
