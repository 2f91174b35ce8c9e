// sampler: what the surface is at samples of the screen (paper 2.4). The image, the nodes of the
// mesh and single points are samples of the same surface.
#pragma once

#include <vector>

#include "device/stage_clock.hpp"
#include "meniscus/parameters.hpp"
#include "stages/frame/density.hpp"
#include "stages/frame/visible.hpp"
#include "stages/sample/blend.hpp"
#include "stages/sample/region.hpp"
#include "stages/sample/surface_buffers.hpp"

namespace meniscus {

/// All that a sample of the surface is computed from; nothing changes it.
struct Sampler {
  Device& device;
  const View& view;
  const Parameters& params;
  BlendRecords records;  // of the fits
  DeviceRecords fits;    // the same
  DeviceCells cells;     // all particles in view
  DeviceCells levelled;  // the same with even level
  SplatParticles body;   // seen or not: what shows behind a front layer
  double least_radius;   // of a particle on the screen, pixels
};

/// The maps of a grid before its samples are made, by two fills. Where the device draws by minima,
/// what is to be lowered or raised begins as kNoSurface or 0, too.
struct Backdrop {
  Fronts fronts;  // of the seen particles: where samples are asked for, and their reference
                  // depths
  Buffer<float> triangles;            // depth of the kept ones
  Extent splash;                      // between which depths its blobs may be seen
  ListedBlocks listed;                // none
  Buffer<float> open;                 // nowhere
  std::vector<Buffer<float>> behind;  // of each look behind the front layer: nothing
  SurfaceBuffers surface;             // none: for the samples
};

/// Draws the fronts of the seen particles, the triangles and the splash particles. Waits, but for
/// atomic minima.
Backdrop draw_backdrop(Device& device, const View& view, const SplatParticles& seen,
                       const KeptTriangles& triangles, const SplatParticles& splash,
                       const SampleGrid& grid, const Parameters& params);

/// The surface at the samples of a grid where fronts or splash are: first those of a
/// coarse lattice, then those between that these do not give; samples whose nearest layer ends
/// before them look again behind it. Does not wait on devices that draw by minima.
///
///   backdrop  of the grid, drawn for this alone
///   groups    whether the fits that samples show are wanted
SurfaceBuffers sample_grid(const Sampler& sampler, const SampleGrid& grid, const Backdrop& backdrop,
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

}  // namespace meniscus
