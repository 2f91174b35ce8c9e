#include "stages/roundness.hpp"

#include <algorithm>

#include "base/exact_math.hpp"
#include "device/kernels.hpp"
#include "device/together.hpp"
#include "stages/sheet.hpp"

namespace meniscus {
namespace {

constexpr std::size_t kModel = 16;      // floats of a trial fit, as in roundness.cl
constexpr float kEvidenceReach = 4.5f;  // particle radii; whose fits tell of a particle

// Over which fits evidence is averaged, and over which the bent places' scores. Fits beyond a rim
// count up to 100 degrees: a rim turns by 180.
constexpr SheetWeights kNear{5, -0.6f, -0.2f}, kFar{24, -0.6f, -0.2f};

// Squared distances (radii^2) and bends that noise leaves, so that logarithms stay finite; where
// bends begin to tell; and which scores speak for one quadric. See docs/method.md for how they were
// found.
constexpr double kNoise = 0.002;
constexpr double kBentFrom = 0.005, kBentTo = 0.02;
constexpr double kRoundFrom = 2.4, kRoundTo = 2.9;

// Fits each particle once and puts the fits where their particles are: in `model`, which is zero.
void place_models(Device& device, const FitSurface& surface, std::vector<FitLanes>& parts,
                  bool wide, std::size_t fits, const FitParams& params,
                  const Buffer<float>& model) {
  const std::vector<float> rho(fits, static_cast<float>(kTrialReach)),
      roundness(fits, wide ? 1.0f : 0.0f);
  for (FitLanes& lanes : parts) {
    lanes.set(device, rho, roundness);
    // Another pass is to come as far as the kernel is told: residuals and weights are not wanted.
    fit_lanes(device, surface, lanes, surface.normal, surface.turned, {0, 2}, params);
  }
  for (const FitLanes& lanes : parts)
    launch(device, kernels::place_models, device.state().wide_width(),
           range_of_lanes(device, lanes), surface.place, surface.turned, *lanes.part, lanes.quadric,
           lanes.residual, model,
           records::Trial{static_cast<int>(lanes.residual.size), surface.nobody, !wide, kEdgeReach,
                          0, 0});
}

}  // namespace

Evidence measure_evidence(Device& device, const Projected& projected, const Visible& seen,
                          const SurfaceParticles& around, const FitNeighbours& neighbours,
                          const FitParams& params, const BlendParams& blend) {
  const std::size_t count = seen.index.size();
  Evidence evidence{std::vector<float>(count),
                    std::vector<float>(count),
                    std::vector<float>(count),
                    {},
                    std::vector<float>(count)};
  if (count == 0) return evidence;
  const FitSurface surface = upload_surface(device, projected, around);
  std::vector<FitLanes> parts;
  for (const FitNeighbours::Part& part : neighbours.parts) parts.emplace_back(device, part);
  const std::size_t values = kModel * (static_cast<std::size_t>(surface.nobody) + 1);
  const auto [narrow, wide] = filled_together<float, float>(device, 0.0f, {values, values});
  place_models(device, surface, parts, false, count, params, narrow);
  place_models(device, surface, parts, true, count, params, wide);
  for (const FitLanes& lanes : parts)
    launch(
        device, kernels::measure_evidence, device.state().wide_width(),
        range_of_lanes(device, lanes), surface.place, narrow, wide, *lanes.part, lanes.rows,
        records::Trial{static_cast<int>(lanes.residual.size), surface.nobody, true, kEvidenceReach,
                       static_cast<float>(blend.same_low), static_cast<float>(blend.same_high)});
  const std::vector<std::int32_t> place = places_in(around.index, seen.index);
  evidence.normal = normals_of(device, surface.turned, place);
  for (std::size_t p = 0; p < parts.size(); ++p) {
    const ViewTogether found(device, parts[p].found);
    const float *const residual = found.data<1>(), *const row = found.data<2>();
    const std::vector<std::int32_t>& fit = parts[p].part->lists.fit;
    for (std::size_t l = 0; l < fit.size(); ++l) {
      if (fit[l] < 0) continue;
      const std::size_t k = static_cast<std::size_t>(fit[l]);
      evidence.one[k] = row[l];
      evidence.two[k] = row[fit.size() + l];
      evidence.bend[k] = row[2 * fit.size() + l];
      if (!(residual[l] < 0))
        evidence.share[k] = static_cast<float>(around.weight[static_cast<std::size_t>(place[k])]);
    }
  }
  return evidence;
}

std::vector<float> measure_roundness(Device& device, const Projected& projected,
                                     const Visible& seen, const SurfaceParticles& around,
                                     const FitNeighbours& neighbours, const FitParams& params,
                                     const BlendParams& blend) {
  const Evidence evidence =
      measure_evidence(device, projected, seen, around, neighbours, params, blend);
  const std::size_t count = seen.index.size();
  std::vector<Vec3d> position;
  position.reserve(count);
  for (const std::int32_t i : seen.index)
    position.push_back(projected.eye(static_cast<std::size_t>(i)));
  const Cells near = make_cells(position, kNear.reach);
  const auto means = average_in_cells(device, near, evidence.normal, evidence.share,
                                      {evidence.one, evidence.two, evidence.bend}, kNear);
  const std::vector<float>&one = means[0], &two = means[1], &bend = means[2];

  // Bent places alone have something to say, and to ask.
  std::vector<std::size_t> bent;
  std::vector<Vec3d> at, normal;
  std::vector<float> share, score, gate;
  for (std::size_t k = 0; k < count; ++k) {
    const double bends = smooth_step(kBentFrom, kBentTo, bend[k]);
    if (!(bends > 0)) continue;
    bent.push_back(k);
    at.push_back(position[k]);
    normal.push_back(evidence.normal[k]);
    gate.push_back(static_cast<float>(bends));
    share.push_back(evidence.share[k] * gate.back());
    score.push_back(static_cast<float>(2 * logarithm(two[k] + kNoise) -
                                       4 * logarithm(one[k] + kNoise) +
                                       logarithm(bend[k] + kNoise)));
  }
  const std::vector<float> mean =
      average_in_cells(device, make_cells(at, kFar.reach), normal, share, {score}, kFar)[0];
  std::vector<float> roundness(count, 0.0f);
  for (std::size_t b = 0; b < bent.size(); ++b)
    roundness[bent[b]] = gate[b] * static_cast<float>(smooth_step(kRoundFrom, kRoundTo, mean[b]));
  return roundness;
}

}  // namespace meniscus
