// stable: the surface of one quadric per visible particle (paper 2.4.1 and 2.4.2 without 2.2's
// groups).
#pragma once

#include "device/device.hpp"
#include "meniscus/parameters.hpp"
#include "stages/fit/particle_fit.hpp"
#include "stages/sample/blend.hpp"
#include "stages/sample/surface_buffers.hpp"
#include "stages/sheet/triangulate.hpp"

namespace meniscus {

/// The records of fits, all of them trusted, as the kernels of stable.cl take them. The weight of
/// one reaches as make_records says.
GroupRecords stable_records(const ParticleFits& fits, const FitParams& fit, double radius);

/// Which samples have surface, and whose it is.
struct StableRegion {
  SampleGrid grid;
  Buffer<float> reference;  // [samples] depth near the surface, particle radii; kNoSurface: none
  Buffer<float> front;      // [samples] depth to show where no fit is met
  Buffer<cl_int> owner;     // [samples] fitted particle, -1 where there is no surface
};

/// Triangles and ghosts, owned by the corner with the largest barycentric coordinate times edge
/// factor; capsules along the contour; closed by a disc (docs/method.md). Does
/// not wait.
///
///   mesh     its vertices are fitted particles
///   fitted   the particles of `fits`
///   records  of `fits`, on the device
StableRegion draw_stable_region(Device& device, const View& view, const Triangulation& mesh,
                                const Visible& fitted, const ParticleFits& fits,
                                const Buffer<float>& records, const SampleGrid& grid,
                                const Parameters& params);

/// Blends the particles' quadrics at every sample of the region and writes depth, normal and group
/// (the heaviest particle). Does not wait.
SurfaceBuffers blend_particles(Device& device, const View& view, const StableRegion& region,
                               const Buffer<float>& records, const TileLists& tiles,
                               const BlendParams& params);

}  // namespace meniscus
