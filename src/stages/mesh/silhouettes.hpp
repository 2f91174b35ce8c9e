// silhouettes: between which nodes the front layer ends (paper 2.5), and where, by bisection.
#pragma once

#include <functional>
#include <vector>

#include "stages/stage_data.hpp"

namespace meniscus {

/// Throws InvalidArgument when a map's size is not its grid's.
void check_nodes(const SurfaceMap& nodes);

/// The neighbouring nodes between which the silhouette passes: depths that differ by more than
/// `z_max`, or a surface beside none (Mueller et al. 3.4).
///
///   nodes  depth is read, particle radii
///   z_max  particle radii, > 0
///
/// Returns them ordered by their upper left node, the edge to the right before the edge down, with
/// the cut half way and no surface sample: whoever knows better sets `cut` and `surface`.
/// Throws InvalidArgument when z_max is not positive or the map's size is not its grid's.
std::vector<SilhouetteEdge> find_silhouette_edges(const SurfaceMap& nodes, double z_max);

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
