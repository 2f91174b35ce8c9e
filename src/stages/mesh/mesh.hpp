// The surface map's mesh: Screen Space Meshes (Mueller, Schirm, Duthaler 2007) on the node grid
// (paper 2.5). Host code, for every method.
#pragma once

#include <vector>

#include "meniscus/parameters.hpp"
#include "stages/stage_data.hpp"

namespace meniscus {

/// Meshes the nodes: one sheet for every layer that is connected from node to node, cut along the
/// silhouettes (Mueller et al. 3.4 to 3.6).
///
///   nodes   depth and normal are read; nodes without surface are left out
///   edges   every silhouette edge of `nodes`; a sample without surface or farther than z_max from
///           its front node is replaced by the front layer, extrapolated
///   params  silhouette_rounds; z_max in particle radii as the edges were found
///
/// Returns positions in world units, normals from the maps where they have one that no adjacent
/// triangle turns its back to, and else the sum of the adjacent triangles' normals by area. Every
/// triangle is counter-clockwise seen from the camera, every vertex is used, its triangles hang
/// together, no edge has more than two triangles, and inside a layer every edge has two. Throws
/// InvalidArgument when an edge does not join neighbours, has a cut outside [0, 1] or no surface in
/// front, or when an edge between surface and none is missing.
Mesh make_mesh(const View& view, const SurfaceMap& nodes, const std::vector<SilhouetteEdge>& edges,
               const MeshParams& params);

}  // namespace meniscus
