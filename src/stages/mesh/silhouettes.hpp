// silhouettes: where the front layer ends between two nodes, by bisection (paper 2.5).
#pragma once

#include <functional>
#include <vector>

#include "stages/stage_data.hpp"

namespace meniscus {

/// What a surface shows at points of the screen ([2][n] u, v, pixels), near a depth for each.
using SampleNear = std::function<std::vector<SurfaceSample>(const std::vector<float>& points,
                                                            const std::vector<float>& near)>;

/// Bisects each edge six times: a point belongs to the front layer when the surface goes on there
/// within z_max (particle radii) of the last point that did.
///
///   nodes  depth and normal are read
///   edges  of find_silhouette_edges(nodes, z_max)
///
/// Returns the edges with their cuts and the front layer's samples there.
std::vector<SilhouetteEdge> bisect_silhouettes(const SurfaceMap& nodes,
                                               std::vector<SilhouetteEdge> edges, double z_max,
                                               const SampleNear& sample);

}  // namespace meniscus
