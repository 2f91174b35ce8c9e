#include "stages/fit/roundness.hpp"

#include <algorithm>
#include <cmath>
#include <tuple>

#include "device/kernels.hpp"
#include "device/together.hpp"
#include "stages/sheet/sheet.hpp"

namespace meniscus {
namespace {

constexpr std::size_t kModel = 12;  // floats of a trial fit, as in roundness.cl
// Over which fits evidence is averaged. Fits beyond a rim count up to 100 degrees: a rim turns by
// 180.
constexpr SheetWeights kNear{kEvidenceSheet, -0.6f, -0.2f};
static_assert(kEvidenceSheet <= kResidualReach);

// What irregular particles add to both squares (score_bends): this times d (1 - d / 2), d their
// disorder up to 1 (the more there is, the more it was evened out).
constexpr double kOfDisorder = 0.045;

// How far disorders of 1 and 2 raise scores. Noise hides the difference between a sharp edge and a
// round one. Where it does, an edge that is taken for the other kind is better round than in
// pieces.
constexpr double kRounder = 0.8, kRoundest = 1.3;

// What is found of the evidence, in the sheet of the wide fits: one quadric, two sheets, bend, and
// how far the trials turn apart.
constexpr int kValues = 4;

// Makes the trial fits, the wide ones and the narrow ones, and puts their evidence into the sheet.
void compare_trials(Device& device, const FitSurface& surface, const FitNeighbours& neighbours,
                    FitParams params, const BlendParams& blend, const LaneSheet& sheet) {
  params.support = kTrialReach;
  const std::size_t values = kTrials * (static_cast<std::size_t>(surface.nobody) + 1);
  const auto models = allocate<float>(device, kModel * values);
  const Buffer<float> weight = upload(device, std::vector<float>(values, 0.0f));
  std::vector<FitLanes> parts;
  for (const FitNeighbours::Part& part : neighbours.parts)
    parts.emplace_back(device, part, kTrials);
  // With two passes to come the kernel writes neither residuals nor weights.
  for (std::size_t part = 0; part < parts.size(); ++part)
    fit_lanes(device, surface, parts[part], sheet, part, surface.normal, surface.tried, {0, 2},
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
           surface.tried, *lanes.part, lanes.quadric, lanes.residual, models, weight,
           trial(lanes, kEdgeReach));
  for (std::size_t part = 0; part < parts.size(); ++part)
    launch(device, kernels::measure_evidence, width, range_of_lanes(device, parts[part]),
           surface.place, surface.tried, models, weight, *parts[part].part,
           part_in_sheet(sheet, part), trial(parts[part], kEvidenceReach));
}

}  // namespace

TrialPlaces upload_trials(Device& device, const Projected& projected, const NearLists& near,
                          const Visible& tried, const std::vector<std::int32_t>& around) {
  TrialPlaces trials;
  trials.neighbours = upload_neighbours(device, projected, near, tried, around);
  const Cells cells = cells_of(projected, tried.index, kBentReach);
  const std::vector<std::int32_t> place = places_in(around, tried.index);
  std::vector<cl_int> particle, bucket(place.size()), to;  // bucket: of each fit
  for (const std::int32_t k : cells.item) {
    bucket[static_cast<std::size_t>(k)] = static_cast<cl_int>(particle.size());
    particle.push_back(place[static_cast<std::size_t>(k)]);
  }
  for (const std::int32_t k : trials.neighbours.sheet.host.item)
    to.push_back(bucket[static_cast<std::size_t>(k)]);
  std::tie(trials.cells, trials.to, trials.particle) =
      upload_with_cells(device, cells, to, particle);
  return trials;
}

TrialPlaces find_trials(Device& device, const Projected& projected, const Visible& tried,
                        const std::vector<std::int32_t>& around) {
  return upload_trials(device, projected, list_near(projected, tried.index, around, kTrialReach),
                       tried, around);
}

Evidence measure_evidence(Device& device, const FitSurface& surface, const TrialPlaces& trials,
                          const FitParams& params, const BlendParams& blend) {
  const std::size_t count = trials.to.size;
  const std::vector<float> none(count);
  Evidence evidence{none, none, none, none, std::vector<Vec3d>(count), none};
  if (count == 0) return evidence;
  const LaneSheet sheet(device, trials.neighbours.sheet, kValues);
  compare_trials(device, surface, trials.neighbours, params, blend, sheet);
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
    evidence.apart[k] = value[3 * count + p];
  }
  return evidence;
}

BendScores score_bends(Device& device, const FitSurface& surface, const TrialPlaces& trials,
                       const FitParams& params, const BlendParams& blend, double disorder) {
  const LaneSheet sheet(device, trials.neighbours.sheet, kValues);
  compare_trials(device, surface, trials.neighbours, params, blend, sheet);
  const int width = device.state().wide_width();
  const std::size_t n = trials.to.size;
  const double most = std::min(disorder, 1.0), noise = kOfDisorder * most * (1 - most / 2),
               rounder =
                   kRounder * most * std::sqrt(most) + (kRoundest - kRounder) * (disorder - most);
  const auto& [toward, share, value, none] = sheet.found.parts;
  const BendScores scores{allocate<float>(device, n), allocate<float>(device, 2 * n)};
  launch(device, kernels::score_bends, width, range_of_blocks(n, width), sheet.cells->cells, toward,
         share, value, trials.to, scores.share, scores.value,
         records::BendScoring{sheet.fits(), kNear, static_cast<float>(noise),
                              static_cast<float>(rounder)});
  return scores;
}

void set_roundness(Device& device, const BendScores& scores, const TrialPlaces& trials,
                   const FitSurface& surface) {
  const int width = device.state().wide_width();
  const std::size_t n = trials.to.size;
  launch(device, kernels::set_roundness, width, range_of_blocks(n, width), surface.normal,
         trials.cells, scores.share, scores.value, trials.particle,
         records::ScoreMeans{static_cast<cl_int>(n), kBentReach});
}

}  // namespace meniscus
