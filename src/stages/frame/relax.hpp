// relax: evens out particles that lie as irregularly as those of FLIP and MPM (docs/method.md,
// disorder).
//
// SPH pushes particles apart, FLIP and MPM do not: theirs lie almost at random. The density field,
// and with it normals and what is fitted, then has as much noise as signal. The paper takes
// particles as they are. A few steps of forces between pairs, which repel when near and attract
// when farther, bring back the order of a fluid at rest and move no particle far.
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "meniscus/parameters.hpp"
#include "stages/frame/cells.hpp"
#include "stages/frame/project.hpp"
#include "stages/space_box.hpp"

namespace meniscus {

/// How often relax() moves particles, and how far each looks, particle radii.
inline constexpr int kRelaxRounds = 16;
inline constexpr double kRelaxReach = 4;

/// How orderly particles lie. Variation: standard deviation over mean; 0 where there are too few to
/// tell.
struct ParticleOrder {
  double distances = 0;  // variation of the distances between particles and their nearest ones
  double density = 0;    // variation of sum_j (1 - d_j^2 / (1.5 spacing)^2)^3 at particles
  double spacing = 2;    // particle radii: of a lattice of cubes that is as dense as the particles
};

/// Measured at some particles, of these at the half with the most others within kRelaxReach.
///
///   sampled  indices of the some
///   cells  of all particles, of side kRelaxReach
ParticleOrder measure_order(const Projected& particles, const std::vector<std::int32_t>& sampled,
                            const Cells& cells);

/// The same at up to kOrderSample of all particles, spread over their order.
inline constexpr std::size_t kOrderSample = 1024;
ParticleOrder measure_order(const Projected& particles, const Cells& cells);

/// How irregularly particles lie, and what follows from it.
struct Disorder {
  /// 0: as SPH leaves them, 1: anywhere in their cubes of a lattice, 2: anywhere.
  double amount = 0;
  double spacing = 2;  // as in ParticleOrder

  /// Both 0 .. 1: up to one particle anywhere in each cube, and from there to particles anywhere.
  double within_cubes() const { return std::min(amount, 1.0); }
  double anywhere() const { return std::max(amount - 1, 0.0); }
  /// What lies anywhere tells of no detail as small as a particle. The unit of length in which all
  /// is made, particle radii (View::radius): 1, and up to 1.4 from an amount of 1 to 2.
  double unit() const;
  /// What a particle adds to the density field where lengths are in this unit.
  float mass() const;
  bool operator==(const Disorder&) const = default;
};

/// The amount from 0 to 1: the distances' variation from .065 to .265, or that of the density from
/// .085 to .195, linearly; the lower one. From 1 to 2: alike from .285 to .315 and from .215 to
/// .255. SPH leaves uneven distances, .07 to .12, but an even density, .02 to .08; thin water has
/// an uneven density, but even distances. Gaussian noise of .1 s gives .10 and .11, one particle at
/// random in each cube of a lattice .28 and .21, frames of FLIP .28 to .33 and .20 to .29, and
/// particles anywhere (MPM) .36 and .30.
double disorder_of(const ParticleOrder& order);

/// The disorder of particles: params.disorder, which takes them to be two particle radii apart, or
/// what they themselves say where it is below 0.
///
///   cells  of the particles, of side kRelaxReach
Disorder find_disorder(const Projected& particles, const Cells& cells, const Parameters& params);

/// Evens out particles that lie `spacing` apart, as far as `disorder` (0 .. 1) says. Each goes,
/// kRelaxRounds times, by
///   disorder / 2 sum_j (x - x_j) (1 - d^2 / q^2) (1 - d^2 / 4)^4,   lengths in spacings.
/// The distance q, at which the force vanishes, is 1.161 to 1.153 by the disorder (docs/method.md).
/// Then what it has moved in common with those near it is taken back: the value at it of the linear
/// function of the place that is nearest to how far they have moved. Pixels stay those of where the
/// particles were, see project_again().
///
///   wanted  those elsewhere end up anywhere, and cost less the farther away they are
void relax(Projected& particles, double spacing, double disorder, const SpaceBox& wanted = {});

/// What lies farther away does not change where even_out() puts a particle; in the disorder's unit
/// of length.
double relax_influence(const Disorder& disorder);

/// Relaxes particles as far as their disorder says, where there is any; they are in its unit of
/// length.
///
///   wanted  as in relax()
void even_out(Projected& particles, const Disorder& disorder, const SpaceBox& wanted = {});

/// Parameters of the density field alone: its level is higher, because a particle that lies by
/// itself is rather one that noise has moved than a drop.
RegionParams for_disorder(RegionParams params, const Disorder& disorder);

/// How many times its weight a lone particle counts in the levelled field (level_cells()), so that
/// it is drawn as large as a lone orderly one, and from a disorder of 1 on as large as it is,
/// whatever for_disorder() makes of the level; 1 without disorder.
double lone_factor(const RegionParams& params, const Disorder& disorder);

/// Parameters for particles that were relaxed, in the disorder's unit of length: supports, scales
/// and normals as noise wants them, in between for a disorder in between; its amount is stored with
/// them.
Parameters for_disorder(Parameters params, const Disorder& disorder);

}  // namespace meniscus
