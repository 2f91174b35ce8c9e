// The trial fits of a scene, as stage roundness makes them, for its reference.
#pragma once

#include "stages/fit/roundness.hpp"
#include "verify/reference/roundness.hpp"
#include "verify/stage_cases/mesh_by_hand.hpp"

namespace meniscus {

inline TrialPlaces trials_of(Device& device, const FittedSurface& scene) {
  return find_trials(device, scene.projected, scene.seen, scene.around.index);
}

/// The trial fits, narrow or wide, of the fitted particles; no other particle is a neighbour.
inline std::vector<reference::TrialFit> trial_fits(Device& device, const FittedSurface& scene,
                                                   bool wide) {
  FitParams params;
  params.support = kTrialReach;
  const std::size_t n = scene.seen.index.size(), trial = wide ? 0 : 1;
  ParticleFits fits;
  for (const std::int32_t i : scene.seen.index)
    fits.position.push_back(scene.projected.eye(static_cast<std::size_t>(i)));
  fits.normal.resize(n);
  fits.residual.resize(n);
  fits.quadric.resize(n);
  const FitSurface surface = upload_surface(device, scene.projected, scene.around);
  const TrialPlaces trials = trials_of(device, scene);
  const LaneSheet sheet(device, trials.neighbours.sheet, 1);
  for (std::size_t part = 0; part < trials.neighbours.parts.size(); ++part) {
    const FitLanes made(device, trials.neighbours.parts[part], kTrials);
    fit_lanes(device, surface, made, sheet, part, surface.normal, surface.tried, {0, 2}, params);
    const HostView quadric(device, made.quadric), residual(device, made.residual),
        turned(device, surface.tried);
    const auto lanes = static_cast<std::size_t>(made.count()),
               records = static_cast<std::size_t>(surface.nobody) + 1;
    for (std::size_t l = 0; l < lanes; ++l) {
      if (made.part->lists.fit[l] < 0) continue;
      const auto k = static_cast<std::size_t>(made.part->lists.fit[l]);
      const float* const normal =
          turned.data() + 4 * (trial * records + static_cast<std::size_t>(scene.place[k]));
      fits.normal[k] = {normal[0], normal[1], normal[2]};
      fits.residual[k] = residual.data()[trial * lanes + l];
      for (std::size_t c = 0; c < 10; ++c)
        fits.quadric[k][c] = quadric.data()[(10 * trial + c) * lanes + l];
    }
  }
  const reference::Surroundings around = scene.surroundings(fits);
  std::vector<reference::TrialFit> found;
  for (std::size_t k = 0; k < n; ++k) {
    const auto place = static_cast<std::size_t>(scene.place[k]);
    const double edge =
        wide ? 1
             : reference::measure(around, place, kTrialReach, fits.quadric[k], 0, params).agreement;
    const double weight =
        fits.residual[k] < 0 ? 0 : scene.around.weight[place] * edge * scene.seen.influence_of(k);
    found.push_back({fits.position[k], fits.normal[k], weight, fits.quadric[k]});
  }
  return found;
}

/// How far floats may be from the reference: f is good to 20 epsilon of terms that add up to 10;
/// its square, at most 1/4, to twice that times 1/2. Sums of some fifty terms round by as many
/// epsilon. Two sheets may be four times as far, and are decided where `rounded` fits move them by
/// less than it: which sheet is taken is a choice, and shares are steep.
inline constexpr double kEvidenceBound = kEpsilon * (20 * 10 + 50);

/// The same as if its numbers had been rounded some ten times.
inline std::vector<reference::TrialFit> rounded(std::vector<reference::TrialFit> fits,
                                                Random& random) {
  const auto off = [&](double size) { return 10 * kEpsilon * size * random(-1, 1); };
  for (reference::TrialFit& fit : fits) {
    fit.position += Vec3d{off(30), off(30), off(30)};
    fit.weight *= 1 + off(1);
    for (float& c : fit.quadric) c += static_cast<float>(off(std::abs(c) + 0.1));
  }
  return fits;
}

inline Evidence evidence_of(Device& device, const FittedSurface& scene) {
  return measure_evidence(device, upload_surface(device, scene.projected, scene.around),
                          trials_of(device, scene), {}, {});
}

/// What the kernels behind it make of the evidence, of the fitted particles.
struct ScoredBends {
  std::vector<float> share, score, bends, roundness;
};

inline ScoredBends scored_bends(Device& device, const FittedSurface& scene, double disorder = 0) {
  const FitSurface surface = upload_surface(device, scene.projected, scene.around);
  const TrialPlaces trials = trials_of(device, scene);
  const std::size_t n = scene.seen.index.size();
  const std::vector<float> none(n);
  ScoredBends result{none, none, none, none};
  if (n == 0) return result;
  const BendScores scored = score_bends(device, surface, trials, {}, {}, disorder);
  set_roundness(device, scored, trials, surface);
  const HostView to(device, trials.to);
  const HostView share(device, scored.share), value(device, scored.value),
      records(device, surface.normal);
  for (std::size_t p = 0; p < n; ++p) {
    const auto k = static_cast<std::size_t>(trials.neighbours.sheet.host.item[p]);
    const auto at = static_cast<std::size_t>(to.data()[p]);
    result.share[k] = share.data()[at];
    result.score[k] = value.data()[at];
    result.bends[k] = value.data()[n + at];
    result.roundness[k] = records.data()[4 * static_cast<std::size_t>(scene.place[k]) + 3];
  }
  return result;
}

/// Their roundness.
inline std::vector<float> roundness_of(Device& device, const FittedSurface& scene,
                                       double disorder = 0) {
  return scored_bends(device, scene, disorder).roundness;
}

}  // namespace meniscus
