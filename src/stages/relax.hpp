// relax: evens out particles that lie as irregularly as those of FLIP and MPM (docs/method.md,
// disorder).
//
// SPH pushes particles apart, FLIP and MPM do not: theirs lie almost at random. The density field,
// and with it normals and what is fitted, then has as much noise as signal. The paper takes
// particles as they are. A few steps of forces between pairs, which repel when near and attract
// when farther, bring back the order of a fluid at rest and move no particle far.
#pragma once

#include "meniscus/parameters.hpp"
#include "stages/cells.hpp"
#include "stages/project.hpp"

namespace meniscus {

/// How often relax() moves particles, and how far each looks, particle radii.
inline constexpr int kRelaxRounds = 16;
inline constexpr double kRelaxReach = 4;

/// Spread of the distances between particles and their nearest ones.
struct NearestDistances {
  double variation = 0;  // standard deviation over mean; 0 where there are too few to tell
  double spacing = 2;    // particle radii: of a lattice of cubes that is as dense as the particles
};

/// Measured at up to 1,024 of them, of these at the half with the most others within kRelaxReach.
///
///   cells  of them, of side kRelaxReach
NearestDistances measure_nearest(const Projected& particles, const Cells& cells);

/// How irregularly particles lie, 0 .. 1: smoothstep(.15, .2) of that variation. SPH leaves .05 to
/// .14, Gaussian noise of sigma s about sigma, one particle at random in each cube of a lattice
/// .28, particles anywhere .35.
double disorder_of(const NearestDistances& nearest);

/// Moves particles `spacing` apart, as far as `disorder` says. Each goes, kRelaxRounds times, by
///   disorder / 2 sum_j (x - x_j) (1 - d^2 / 1.153^2) (1 - d^2 / 4)^4,   lengths in spacings.
/// The distance 1.153, at which the force vanishes, is the one that keeps faces where they are
/// (docs/method.md). Pixels stay those of where the particles were, see project_again().
void relax(Projected& particles, double spacing, double disorder);

/// Relaxes particles as far as params.disorder says, which takes them to be two particle radii
/// apart; or as they themselves say where it is below 0. Returns how far that is.
///
///   cells  of the particles, of side kRelaxReach; made anew where they move
double even_out(Projected& particles, Cells& cells, const Parameters& params);

/// Parameters for particles that were relaxed: supports, scales and normals as noise wants them, in
/// between for a disorder in between; `disorder` is stored with them.
Parameters for_disorder(Parameters params, double disorder);

}  // namespace meniscus
