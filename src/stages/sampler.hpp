// sampler: what the surface is at samples of the screen (paper 2.4). The image, the nodes of the
// mesh and single points are samples of the same surface.
#pragma once

#include <vector>

#include "base/stage_clock.hpp"
#include "meniscus/parameters.hpp"
#include "stages/blend.hpp"
#include "stages/density.hpp"
#include "stages/mesh.hpp"
#include "stages/surface_buffers.hpp"
#include "stages/triangulate.hpp"
#include "stages/visible.hpp"

namespace meniscus {

/// All that a sample of the surface is told from; nothing changes it.
struct Sampler {
  Device& device;
  const View& view;
  const Parameters& params;
  BlendRecords records;  // of the fits
  DeviceRecords fits;    // the same
  DeviceCells cells;     // all particles in view
  DeviceCells levelled;  // the same with even level
  SplatParticles body;   // seen or not: what shows behind a front layer
  SplatParticles splash;
  const Triangulation& mesh;  // of the seen particles
  double least_radius;        // of a particle on the screen, pixels
};

/// The nearest fronts of the seen particles: where samples are asked for, and their reference
/// depths.
Fronts draw_fronts(Device& device, const SplatParticles& seen, const SampleGrid& grid,
                   const Parameters& params);

/// The surface at the samples of a grid where `fronts` or splash ask for it: first those of a
/// coarse lattice, then those between that these do not tell; samples whose nearest layer ends
/// before them look again behind it. Does not wait on devices that draw by minima.
///
///   groups  whether the fits that samples show are wanted
SurfaceBuffers sample_grid(const Sampler& sampler, const SampleGrid& grid, const Fronts& fronts,
                           bool groups, StageClock& clock);

/// The surface at points, near a depth for each, without triangles that vouch for it. Waits.
///
///   grid, tiles  of list_fits(); the points lie on it
///   points       [2][n] u then v, pixels
///   near         [n] depths, particle radii
///   near_fits    [n] the same where fits are looked for, kNoSurface where the field alone counts
std::vector<SurfaceSample> sample_points(const Sampler& sampler, const SampleGrid& grid,
                                         const FitTiles& tiles, const std::vector<float>& points,
                                         const std::vector<float>& near,
                                         const std::vector<float>& near_fits);

/// Where the front layer ends between the two nodes of each silhouette edge. A point belongs to the
/// layer when the blend, or the field where the layer is splash, goes on there. Waits.
std::vector<SilhouetteEdge> cut_silhouettes(const Sampler& sampler, const SurfaceMap& nodes);

}  // namespace meniscus
