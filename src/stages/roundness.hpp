// roundness: whether one quadric or two sheets explain the surface around each fitted particle
// (docs/method.md, roundness). The paper ends groups where normals differ (2.2), which takes the
// far side of a drop for another sheet.
#pragma once

#include <vector>

#include "stages/particle_fit.hpp"

namespace meniscus {

/// How far the neighbours of trial fits lie, particle radii.
inline constexpr double kTrialReach = 6;

/// Over which fits evidence is averaged first, particle radii.
inline constexpr float kEvidenceSheet = 5;

/// Whose trial fits tell of a particle, and over which fits the bent places' scores are averaged,
/// particle radii.
inline constexpr float kEvidenceReach = 4.5f, kBentSheet = 32;

/// The evidence at a particle: means over the trial fits around it.
struct Evidence {
  std::vector<float> one;     // [n] squared distance of wide fits, radii^2
  std::vector<float> two;     // [n] of narrow fits in two sheets, radii^2
  std::vector<float> bend;    // [n] 1 - n.n' of the wide fits
  std::vector<Vec3d> normal;  // [n] unit, of the wide fits
  std::vector<float> share;   // [n] u, as far as it tells (Visible::tells); 0 without a wide fit
};

/// Makes the trial fits and compares them (kernel measure_evidence). Waits.
///
///   seen        the particles to fit, ascending
///   around      the surface, `seen` among it
///   neighbours  of `seen` within kTrialReach, or farther: those count nothing
Evidence measure_evidence(Device& device, const Projected& projected, const Visible& seen,
                          const SurfaceParticles& around, const FitNeighbours& neighbours,
                          const FitParams& params, const BlendParams& blend);

/// The roundness of each fitted particle, [n], 0 .. 1: 0 where two sheets meet or the surface is
/// flat, 1 where one quadric goes round a bend. With the means of the evidence over the sheet
/// within 5,
///
///   score = 2 ln(two + .02) - 4 ln(one + .002) + 1.5 ln(bend + .002),
///
/// averaged over the bent places within 32, those with bends of about .04 most;
/// smoothstep(1.8, 1.95, score) smoothstep(.005, .02, bend). Irregular particles miss any surface:
/// both squares are less by .045 d (1 - d/2), d their disorder (relax.hpp), down to .011. Waits.
/// Throws DeviceError.
std::vector<float> measure_roundness(Device& device, const Projected& projected,
                                     const Visible& seen, const SurfaceParticles& around,
                                     const FitNeighbours& neighbours, const FitParams& params,
                                     const BlendParams& blend, double disorder = 0);

}  // namespace meniscus
