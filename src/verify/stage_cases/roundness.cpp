// measure_evidence: what the trial fits say of each particle, given the fits themselves.
// score_bends, given the evidence; set_roundness, given the scores.
#include "verify/stage_cases/roundness.hpp"

#include <algorithm>
#include <cmath>

#include "verify/stage_cases/cases.hpp"
#include "verify/stage_cases/worst.hpp"

namespace meniscus::verify {

namespace {

// Averages as the kernels take them (docs/method.md).
constexpr SheetWeights kNear{5, -0.6f, -0.2f};
constexpr double kFar = 36;

// Next to nothing may be nothing in floats.
bool is_sure(const reference::SheetMean& mean) { return mean.weight == 0 || mean.weight > 1e-3; }

struct BendErrors {
  Worst share{"score_bends", "share"}, score{"score_bends", "score"}, bends{"score_bends", "bend"},
      round{"set_roundness", "roundness"};
};

// Of a hilly surface whose particles are rough by `noise`, so that scores are about where they
// tell.
void see_bends(Device& device, int size, double noise, double disorder, BendErrors& worst) {
  Random random(13);
  const FittedSurface scene = fitted_surface(
      field(size, 3, [&](double u, double v) { return hills(u, v) + random(-noise, noise); }));
  const std::size_t n = scene.seen.index.size();
  const Evidence evidence = evidence_of(device, scene);
  std::vector<Vec3d> position;
  for (const std::int32_t i : scene.seen.index)
    position.push_back(scene.projected.eye(static_cast<std::size_t>(i)));
  const ScoredBends scored = scored_bends(device, scene, disorder);
  const double most = std::min(disorder, 1.0), added = 0.045 * most * (1 - most / 2),
               rounder = 0.8 * most * std::sqrt(most) + 0.5 * (disorder - most);
  for (std::size_t k = 0; k < n; ++k) {
    const auto mean = [&](const std::vector<float>& values) {
      return reference::sheet_mean(position, evidence.normal, evidence.share, values, k, kNear);
    };
    const auto one = mean(evidence.one), two = mean(evidence.two), bend = mean(evidence.bend),
               apart = mean(evidence.apart);
    if (!is_sure(one)) continue;
    const auto expected =
        reference::scored_bend(one, two, bend, apart, evidence.share[k], added, rounder);
    worst.share.see(scored.share[k], expected.share.value, expected.share.error, 1);
    worst.score.see(scored.score[k], expected.score.value, expected.score.error, 1);
    worst.bends.see(scored.bends[k], expected.bends.value, expected.bends.error, 1);
    const auto score = reference::mean_around(position, scored.share, scored.score, k, kFar);
    if (!is_sure(score)) continue;
    const auto round = reference::roundness_of(score, scored.bends[k]);
    worst.round.see(scored.roundness[k], round.value, round.error, 1);
  }
}

}  // namespace

ReferenceErrors roundness_case(Device& device, int size) {
  Worst one("measure_evidence", "one quadric"), two("measure_evidence", "two sheets"),
      bend("measure_evidence", "bend"), apart("measure_evidence", "apart");
  for (const auto& surface : {hills, roof}) {
    const FittedSurface scene = fitted_surface(field(size, 2, surface));
    const Evidence evidence = evidence_of(device, scene);
    const auto wide = trial_fits(device, scene, true), narrow = trial_fits(device, scene, false);
    Random random(5);
    const auto near_narrow = rounded(narrow, random);
    for (std::size_t k = 0; k < scene.seen.index.size(); ++k) {
      one.see(evidence.one[k], reference::one_quadric(wide, k), kEvidenceBound);
      bend.see(evidence.bend[k], reference::bend_of(wide, k), kEvidenceBound);
      apart.see(evidence.apart[k], 1 - dot(wide[k].normal, narrow[k].normal), kEvidenceBound);
      const double expected = reference::two_sheets(narrow, k);
      const double moved = std::abs(reference::two_sheets(near_narrow, k) - expected);
      if (moved > kEvidenceBound) continue;
      two.see(evidence.two[k], expected, 4 * kEvidenceBound);
    }
  }
  BendErrors bends;
  // Each factor of the two kernels tells at one of these at least.
  for (const double noise : {0.25, 0.36, 0.7})
    for (const double disorder : {0.0, 1.5}) see_bends(device, size, noise, disorder, bends);
  return {one.error(),         two.error(),         bend.error(),        apart.error(),
          bends.share.error(), bends.score.error(), bends.bends.error(), bends.round.error()};
}

}  // namespace meniscus::verify
