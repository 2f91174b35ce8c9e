// Where the device's coordinates begin.
#pragma once

#include <array>
#include <vector>

#include "base/notices.hpp"
#include "stages/view.hpp"

namespace meniscus {

/// The point that the device subtracts first, so that floats are finest where the particles are:
/// the middle of their bounds; along an axis on which a few strays (particles that a simulation
/// threw out) widen the bounds a hundredfold, the middle of the bulk. A float, so that host and
/// device take the same one.
///
///   low, high  bounds of all particles, world units
///   sample     some particles, in any order
std::array<double, 3> origin_of(const std::array<float, 3>& low, const std::array<float, 3>& high,
                                const std::vector<std::array<float, 3>>& sample);

/// Warns where the view's origin lies so far from the world's that coordinates, which are floats,
/// are rounded to more than a tenth of its radius. The text has the particles' own radius, world
/// units.
void warn_of_coarse_positions(const View& view, double particle_radius, Notices& notices);

}  // namespace meniscus
