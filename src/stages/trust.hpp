// trust: which groups' quadrics speak for the fluid (paper, end of 3).
//
// The paper fits only where there are particles enough. A group of particles in a spray has enough
// of them for ten coefficients, but its quadric is a petal in the air. Two measures tell them
// apart: how far the particles lie from the quadric when all of them count, and the density at the
// quadric's own points, which is 1/2 on the face of a fluid and less on a petal.
#pragma once

#include <vector>

#include "stages/density.hpp"
#include "stages/fit.hpp"
#include "stages/group.hpp"

namespace meniscus {

/// f of a group's quadric at X from its centre (particle radii).
double evaluate(const std::array<float, 10>& quadric, const Vec3d& x);

/// Gradient of the same.
Vec3d gradient(const std::array<float, 10>& quadric, const Vec3d& x);

/// Trust of each group, 0 .. 1: 1 - smoothstep(0.45, 0.75, RMS distance of the fit's points,
/// clamped to two radii) times smoothstep(0.24, 0.33, mean density at the members' feet on the
/// quadric) times smoothstep(5, 12, number of the fit's points). 0 where there is no fit. Waits.
std::vector<double> measure_trust(Device& device, const Triangulation& mesh, const Groups& groups,
                                  const std::vector<FitProblem>& problems, const Quadrics& quadrics,
                                  const DeviceCells& cells, double offset);

}  // namespace meniscus
