// motion: how the surface moves, from the velocities of the particles around it.
#pragma once

#include <vector>

#include "stages/frame/cells.hpp"
#include "stages/frame/density.hpp"
#include "stages/frame/project.hpp"
#include "stages/stage_data.hpp"

namespace meniscus {

/// The particles in view whose velocity is known, in a hash grid.
struct MovingParticles {
  Cells cells;                    // of side 4
  std::vector<Vec3> velocity;     // [n] in bucket order, world units per second
  DeviceCells on_device;          // the same cells
  Buffer<float> device_velocity;  // [3][n]
};

/// How far outside the screen particles bear on the motion of what is on it, particle radii: twice
/// the support, for views up to 120 degrees wide.
inline constexpr double kMotionMargin = 8;

/// Uploads those of the particles whose velocity is known.
///
///   velocity  [particles] by their index before the projection, or kNoVelocity
MovingParticles upload_moving(Device& device, const Projected& projected,
                              const std::vector<Vec3>& velocity);

/// The velocity of the surface at the samples of a depth map and at eye-space points (particle
/// radii): the mean of the particles' velocities, each weighed by w = (1 - d^2/S^2)^4 at distance
/// d < S, with S four particle radii, or 4/3 of the distance to the nearest particle where that is
/// more than three radii away, so that it is continuous everywhere. World units per second; zero
/// where there is no surface, and where no velocity is known. Waits.
std::vector<Vec3> motion_of_samples(Device& device, const View& view, const MovingParticles& moving,
                                    const SampleGrid& grid, const std::vector<float>& depth);
std::vector<Vec3> motion_of_points(Device& device, const MovingParticles& moving,
                                   const std::vector<Vec3d>& points);

}  // namespace meniscus
