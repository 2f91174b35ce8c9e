// Screen Space Meshes (Mueller, Schirm, Duthaler 2007), the paper's baseline: what the method does
// between the depth map of the spheres (visible) and the mesh.
#pragma once

#include <vector>

#include "device/device.hpp"
#include "meniscus/parameters.hpp"
#include "stages/frame/project.hpp"
#include "stages/stage_data.hpp"

namespace meniscus {

/// Normals of a depth map by differences: [3][ny*nx], unit, towards the camera, eye axes; zero
/// where there is no surface. Neighbours farther than z_max (particle radii) in depth are another
/// layer. Does not wait.
Buffer<float> depth_normals(Device& device, const View& view, const Buffer<float>& depth,
                            const SampleGrid& grid, double z_max);

/// Smooths the depth map of the particles' spheres (Mueller et al. 3.3).
///
///   depth   [ny*nx] particle radii; kNoSurface where there is none, and there it stays
///   params  sigma and z_max in particle radii; filter in cells of the node grid
///   cell    the node grid's cell size, pixels
///
/// A separable binomial filter whose window grows while both its ends lie within z_max of its
/// centre, as wide on the screen whatever the grid's step is. Does not wait.
/// Throws InvalidArgument when the map's size is not its grid's, DeviceError.
Buffer<float> smooth_depth(Device& device, const View& view, const Buffer<float>& depth,
                           const SampleGrid& grid, const SsmParams& params, double cell);

/// Cuts each silhouette edge where the particles' circles end (Mueller et al. 3.4): at the crossing
/// farthest from its front node, of the circles of particles on the front node's layer.
///
///   nodes      the smoothed node map that `edges` were found in
///   particles  those whose spheres were drawn, with `footprint`
///
/// Returns the edges with their cuts; one that no such circle crosses keeps its own. A particle is
/// on the layer when its own surface, a radius before its centre, is within z_max of the front
/// node's depth and nearer to it than to the back node's.
std::vector<SilhouetteEdge> place_circle_cuts(const SurfaceMap& nodes,
                                              std::vector<SilhouetteEdge> edges,
                                              const Projected& particles, double footprint,
                                              double z_max);

}  // namespace meniscus
