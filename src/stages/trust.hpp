// trust: which fits speak for the fluid (paper, end of 3).
//
// The paper fits only where there are particles enough. A particle in a spray has neighbours enough
// for ten coefficients, but its quadric is a petal in the air. Two measures tell them apart: how
// far the surroundings lie from the quadric when all of them count, and the density at the fits'
// feet, which is 1/2 on the face of a fluid and less on a petal.
#pragma once

#include <vector>

#include "stages/density.hpp"
#include "stages/particle_fit.hpp"

namespace meniscus {

/// Trust of each fit, 0 .. 1: smoothstep(.24, .33, C) (1 - smoothstep(.45, .75, spread))
/// smoothstep(5, 12, supporters), with C the density at the feet and the spread averaged over the
/// fits k of the same sheet within five radii, with weights (1 - l/5) smoothstep(.4, .6, n.n_k)
/// times k's firmness: on an edge of the fluid C is low, but its sheets go on. 0 where there is no
/// fit. Waits.
std::vector<double> measure_trust(Device& device, const ParticleFits& fits,
                                  const DeviceCells& cells);

}  // namespace meniscus
