// trust: which fits are the fluid's surface (paper, end of 3).
//
// The paper fits only where there are particles enough. A particle in a spray has neighbours enough
// for ten coefficients, but its quadric is a petal in the air. Three measures tell them apart: how
// far the surroundings lie from the quadric when all of them count; the density at the fits' feet,
// which is 1/2 on the face of a fluid and less on a petal; and the density behind them. An arm two
// particles thick looks flat to a fit, which then draws a blade.
#pragma once

#include <cstdint>
#include <vector>

#include "stages/fit/particle_fit.hpp"
#include "stages/frame/density.hpp"

namespace meniscus {

/// Over which fits what trust follows from is averaged, particle radii.
inline constexpr float kTrustSheet = 5;

/// Measures what trust follows from, which download() then gives: the density at the feet, that
/// three particle radii behind them, and how far the surroundings lie from the fits (`spread`),
/// particle radii. These three are averaged over the fits k of the same sheet within five radii,
/// with weights (1 - l/5) smoothstep(.4, .6, n.n_k) times k's firmness: on an edge of the fluid the
/// density is low, but its sheets go on. Does not wait.
void measure_surroundings(Device& device, const DeviceCells& cells, DeviceFits& fits);

/// Trust of each fit of known surroundings, 0 .. 1:
///   smoothstep(.24, .33, C) (1 - smoothstep(.45, .75, spread)) smoothstep(5, 12, supporters)
///     (1 - .01 smoothstep(.3, .4, spread)) (1 - (1 - smoothstep(.5, .8, B)) (1 - sheet))
///     (1 - (1 - firmness) smoothstep(.75, .85, own spread)),
///   sheet = (1 - roundness) smoothstep(40, 80, supporters) (1 - smoothstep(.25, .4, spread))
/// with C the mean density at the feet, B that behind them, and the mean spread but for `own
/// spread`. 0 where there is no fit. Irregular particles lie farther from their fits: for a
/// disorder of 1 (relax.hpp) spreads are compared with .8, 1.2; .6, .8; .5, .8, for one of 2
/// with 1.15, 1.65; .9, 1.2; .75, 1.2.
std::vector<double> trust_of(const ParticleFits& fits, double disorder = 0);

/// Less trust to fits without air before them: particles around a gap in a lattice, as large as one
/// that is missing, seem to lie on a surface. No camera sees them. With C the density 1.5 particle
/// radii before the foot, which is 1/8 before a face, 3/8 before a concave edge, and 1 behind a
/// gap: times 1 - smoothstep(.55, .75, C). Irregular particles have wider gaps: for a disorder of 1
/// .375 and .575, for one of 2 .2 and .4. Only the `listed` fits are looked at. Waits.
void distrust_gaps(Device& device, const DeviceCells& cells, const ParticleFits& fits,
                   const std::vector<std::uint32_t>& listed, double disorder,
                   std::vector<double>& trust);

}  // namespace meniscus
