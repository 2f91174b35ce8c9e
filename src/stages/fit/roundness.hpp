// roundness: whether one quadric or two sheets explain the surface around each fitted particle
// (docs/method.md, roundness). The paper ends groups where normals differ (2.2), which takes the
// far side of a drop for another sheet.
#pragma once

#include <vector>

#include "stages/fit/particle_fit.hpp"

namespace meniscus {

/// How far the neighbours of trial fits lie, particle radii.
inline constexpr double kTrialReach = 6;

/// Over which fits evidence is averaged first, particle radii.
inline constexpr float kEvidenceSheet = 5;

/// Whose trial fits count for a particle, and over which fits the bent places' scores are averaged,
/// particle radii.
inline constexpr float kEvidenceReach = 4.5f, kBentReach = 36;

/// What trial fits need of places alone.
struct TrialPlaces {
  FitNeighbours neighbours;  // within kTrialReach, or farther: those count nothing
  DeviceCells cells;         // the fits in cells of side kBentReach, without weights
  Buffer<cl_int> to;         // [n] where each one, in the order of neighbours.sheet, is in these
  Buffer<cl_int> particle;   // [n] places in the surface, in the order of `cells`
};

/// The same on the device, of lists that list_near() made of these arrays. Throws DeviceError.
///
///   tried   the particles whose roundness is wanted, ascending
///   around  the surface, `tried` among it
TrialPlaces upload_trials(Device& device, const Projected& projected, const NearLists& near,
                          const Visible& tried, const std::vector<std::int32_t>& around);

/// The same with a search within kTrialReach.
TrialPlaces find_trials(Device& device, const Projected& projected, const Visible& tried,
                        const std::vector<std::int32_t>& around);

/// The evidence at a particle: means over the trial fits around it.
struct Evidence {
  std::vector<float> one;     // [n] squared distance of wide fits, radii^2
  std::vector<float> two;     // [n] of narrow fits in two sheets, radii^2
  std::vector<float> bend;    // [n] 1 - n.n' of the wide fits
  std::vector<float> apart;   // [n] 1 - n.n' of the particle's own two trials
  std::vector<Vec3d> normal;  // [n] unit, of the wide fits
  std::vector<float> share;   // [n] u times Visible::influence; 0 without a wide fit
};

/// Makes the trial fits and compares them (kernel measure_evidence). Waits.
Evidence measure_evidence(Device& device, const FitSurface& surface, const TrialPlaces& trials,
                          const FitParams& params, const BlendParams& blend);

/// What score_bends() finds of each fit, in the order of TrialPlaces::cells.
struct BendScores {
  Buffer<float> share;  // [n] how much its score counts; 0 where nothing bends
  Buffer<float> value;  // [2][n] score; how far it bends, smoothstep(.005, .02, bend)
};

/// Makes and compares the trial fits, and scores them: with the means of the evidence over the
/// sheet within 5,
///
///   score = 1.5 ln((two + 1.5 apart + .02) (min(bend, B) + .002)) - 4 ln(one + .008)
///           + 30 max(two - .03 - 2 a, 0) + 20 apart + b,
///
/// which is the log-odds of one quadric, up to a factor and a constant (docs/method.md). Bends of
/// about .04 count most (kernel score_bends). Irregular particles miss any surface: both squares
/// are less by a = .045 d (1 - d/2), d their disorder (relax.hpp) up to 1, down to .011. They bend
/// by more: B is .12 + 10 a. They count as rounder: b is .8 d^1.5 up to d = 1 and goes to 1.3 at
/// d = 2. Does not wait. Throws DeviceError.
BendScores score_bends(Device& device, const FitSurface& surface, const TrialPlaces& trials,
                       const FitParams& params, const BlendParams& blend, double disorder = 0);

/// Puts the roundness of each particle that is tried, 0 .. 1, behind its normal (FitSurface): 0
/// where two sheets meet or the surface is flat, 1 where one quadric goes round a bend. With the
/// mean score of the bent places within 36: smoothstep(3.48, 3.62, score) as far as it bends
/// (kernel set_roundness). Does not wait. Throws DeviceError.
void set_roundness(Device& device, const BendScores& scores, const TrialPlaces& trials,
                   const FitSurface& surface);

/// Both.
inline void measure_roundness(Device& device, const FitSurface& surface, const TrialPlaces& trials,
                              const FitParams& params, const BlendParams& blend,
                              double disorder = 0) {
  if (trials.to.size == 0) return;
  set_roundness(device, score_bends(device, surface, trials, params, blend, disorder), trials,
                surface);
}

}  // namespace meniscus
