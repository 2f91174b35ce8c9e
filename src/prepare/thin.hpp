// thin: replaces particles that lie closer on the screen than pixels can tell by fewer that stand
// for them, so that all later stages are bounded by pixels.
//
// The result looks like the same fluid simulated with larger particles, of spacing S: one layer of
// representatives lies half of S below the surface that the camera sees, others fill what is
// behind it. Departs from averaging alone: the mean of what a cell holds lies anywhere between the
// surface and S below it, which shows as steps (docs/method.md).
#pragma once

#include <vector>

#include "device/device.hpp"
#include "prepare/voxel_grid.hpp"
#include "stages/frame/project.hpp"

namespace meniscus {

/// A loose particle, or a drop too small for the surface: drawn as a sphere.
struct SprayDrop {
  Vec3d centre;       // world units
  double radius = 0;  // world units: that of a particle times the cube root of their number
  Vec3 velocity = kNoVelocity;  // world units per second
};

struct Thinned {
  WorldParticles particles;  // that stand for the fluid, one per side^3; each moves as the mean of
                             // what it stands for
  std::vector<SprayDrop> spray;
};

/// Particles of spacing `grid.side()` that stand for those in the grid.
///
///   radius  of the particles, world units; at most half the grid's side
///   eye     where the camera is (world units), or a point far towards it
///   offset  FitParams::offset: the surface lies this many radii outside the particles' centres
///
/// Waits. Throws DeviceError.
Thinned thin_particles(Device& device, const VoxelGrid& grid, double radius, const Vec3d& eye,
                       double offset);

}  // namespace meniscus
