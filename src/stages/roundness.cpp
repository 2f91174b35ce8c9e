#include "stages/roundness.hpp"

#include <algorithm>
#include <array>
#include <cmath>

#include "base/exact_math.hpp"
#include "device/kernels.hpp"
#include "device/together.hpp"
#include "stages/sheet.hpp"

namespace meniscus {
namespace {

constexpr std::size_t kModel = 12;  // floats of a trial fit, as in roundness.cl
// Over which fits evidence is averaged, and over which the bent places' scores. Fits beyond a rim
// count up to 100 degrees: a rim turns by 180.
constexpr SheetWeights kNear{kEvidenceSheet, -0.6f, -0.2f}, kFar{kBentSheet, -0.6f, -0.2f};
static_assert(kEvidenceSheet <= kResidualReach);

// Squared distances (radii^2) and bends that noise leaves, so that logarithms stay finite. How well
// two sheets follow says little: they follow a rounded edge, too; how badly they do says that there
// are none. So their noise is higher.
constexpr double kNoise = 0.002, kNoiseOfTwo = 0.02;
// No surface follows noise: it adds to both squares and would look like two sheets. Irregular
// particles add this times d (1 - d / 2), d their disorder up to 1 (the more there is, the more
// it was evened out); it is taken from what lies above that of orderly ones (radii^2).
constexpr double kOfDisorder = 0.045, kOrderly = 0.011;
// Where bends begin to tell, and which scores speak for one quadric. See docs/method.md for how
// these were found.
constexpr double kBentFrom = 0.005, kBentTo = 0.02;
constexpr double kRoundFrom = 1.8, kRoundTo = 1.95;

// How much of a say a bend has where scores are averaged. Waves beside an edge score like round
// water, and so do the corners where edges meet: the most say have bends of about .04. Never none,
// so that a mean goes steadily with the particles where only slight bends are near.
float say_of(float bend) {
  constexpr double kFrom = 0.01, kTo = 0.04, kLeast = 0.01;
  return static_cast<float>(smooth_step(kFrom, kTo, bend) + kLeast) / std::sqrt(bend);
}

// What is found of the evidence, in the sheet of the wide fits: one quadric, two sheets, bend
// twice.
constexpr int kValues = 4;

// Makes the trial fits, the wide ones and the narrow ones, and puts their evidence into the sheet.
void compare_trials(Device& device, const Projected& projected, const Visible& seen,
                    const SurfaceParticles& around, const FitNeighbours& neighbours,
                    const FitParams& params, const BlendParams& blend, const LaneSheet& sheet) {
  constexpr int kTrials = 2;
  const FitSurface surface = upload_surface(device, projected, around, kTrials);
  std::vector<FitLanes> parts;
  const std::size_t count = seen.index.size();
  const std::vector<float> rho(count, static_cast<float>(kTrialReach));
  const std::array roundness{std::vector<float>(count, 1.0f), std::vector<float>(count, 0.0f)};
  for (const FitNeighbours::Part& part : neighbours.parts)
    parts.emplace_back(device, part, kTrials).set(device, rho, roundness, seen);
  const std::size_t values = kTrials * (static_cast<std::size_t>(surface.nobody) + 1);
  const auto models = allocate<float>(device, kModel * values);
  const Buffer<float> weight = upload(device, std::vector<float>(values, 0.0f));
  // Two passes are to come as far as the kernel is told: residuals and weights are not wanted.
  for (std::size_t part = 0; part < parts.size(); ++part)
    fit_lanes(device, surface, parts[part], sheet, part, surface.normal, surface.turned, {0, 2},
              params);
  const int width = device.state().wide_width();
  const auto trial = [&](const FitLanes& lanes, float reach) {
    return records::Trial{lanes.count(),
                          surface.nobody,
                          sheet.fits(),
                          reach,
                          static_cast<float>(blend.same_low),
                          static_cast<float>(blend.same_high)};
  };
  for (const FitLanes& lanes : parts)
    launch(device, kernels::place_models, width, range_of_trials(device, lanes), surface.place,
           surface.turned, *lanes.part, lanes.quadric, lanes, models, weight,
           trial(lanes, kEdgeReach));
  for (std::size_t part = 0; part < parts.size(); ++part)
    launch(device, kernels::measure_evidence, width, range_of_lanes(device, parts[part]),
           surface.place, surface.turned, models, weight, *parts[part].part,
           part_in_sheet(sheet, part), trial(parts[part], kEvidenceReach));
}

}  // namespace

Evidence measure_evidence(Device& device, const Projected& projected, const Visible& seen,
                          const SurfaceParticles& around, const FitNeighbours& neighbours,
                          const FitParams& params, const BlendParams& blend) {
  const std::size_t count = seen.index.size();
  const std::vector<float> none(count);
  Evidence evidence{none, none, none, std::vector<Vec3d>(count), none};
  if (count == 0) return evidence;
  const LaneSheet sheet(device, neighbours.sheet, kValues);
  compare_trials(device, projected, seen, around, neighbours, params, blend, sheet);
  const ViewTogether found(device, sheet.found);
  const float *const toward = found.data<0>(), *const share = found.data<1>(),
                     *const value = found.data<2>();
  for (std::size_t p = 0; p < count; ++p) {
    const std::size_t k = static_cast<std::size_t>(sheet.cells->host.item[p]);
    evidence.normal[k] = {toward[p], toward[count + p], toward[2 * count + p]};
    evidence.share[k] = share[p];
    evidence.one[k] = value[p];
    evidence.two[k] = value[count + p];
    evidence.bend[k] = value[2 * count + p];
  }
  return evidence;
}

std::vector<float> measure_roundness(Device& device, const Projected& projected,
                                     const Visible& seen, const SurfaceParticles& around,
                                     const FitNeighbours& neighbours, const FitParams& params,
                                     const BlendParams& blend, double disorder) {
  const std::size_t count = seen.index.size();
  if (count == 0) return {};
  const LaneSheet sheet(device, neighbours.sheet, kValues);
  compare_trials(device, projected, seen, around, neighbours, params, blend, sheet);
  average_lanes(device, sheet, kNear);
  // While the device is at them.
  std::vector<Vec3d> position;
  position.reserve(count);
  for (const std::int32_t i : seen.index)
    position.push_back(projected.eye(static_cast<std::size_t>(i)));

  // Bent places alone have something to say, and to ask.
  std::vector<std::size_t> bent;
  std::vector<Vec3d> at, normal;
  std::vector<float> share, score, gate;
  {
    const ViewTogether found(device, sheet.found);
    const float *const toward = found.data<0>(), *const shares = found.data<1>(),
                       *const one = found.data<3>(), *const two = one + count,
                       *const bend = two + count;
    const double most = std::min(disorder, 1.0), noise = kOfDisorder * most * (1 - most / 2);
    const auto orderly = [&](double square) {
      return std::max(square - noise, std::min(square, kOrderly));
    };
    std::vector<std::size_t> bucket_of(count);
    for (std::size_t p = 0; p < count; ++p)
      bucket_of[static_cast<std::size_t>(sheet.cells->host.item[p])] = p;
    for (std::size_t k = 0; k < count; ++k) {
      const std::size_t p = bucket_of[k];
      const double bends = smooth_step(kBentFrom, kBentTo, bend[p]);
      if (!(bends > 0)) continue;
      bent.push_back(k);
      at.push_back(position[k]);
      normal.push_back({toward[p], toward[count + p], toward[2 * count + p]});
      gate.push_back(static_cast<float>(bends));
      share.push_back(shares[p] * gate.back() * say_of(bend[p]));
      score.push_back(static_cast<float>(2 * logarithm(orderly(two[p]) + kNoiseOfTwo) -
                                         4 * logarithm(orderly(one[p]) + kNoise) +
                                         1.5 * logarithm(bend[p] + kNoise)));
    }
  }
  const std::vector<float> mean =
      average_in_cells(device, make_cells(at, kFar.reach), normal, share, {score}, kFar)[0];
  std::vector<float> roundness(count, 0.0f);
  for (std::size_t b = 0; b < bent.size(); ++b)
    roundness[bent[b]] = gate[b] * static_cast<float>(smooth_step(kRoundFrom, kRoundTo, mean[b]));
  return roundness;
}

}  // namespace meniscus
