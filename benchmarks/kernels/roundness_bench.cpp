// measure_evidence on the frame's trial fits, and average_on_sheets in whole frames.
#include <memory>

#include "kernels/cases.hpp"
#include "stages/fit/roundness.hpp"
#include "stages/fit/trust.hpp"

namespace meniscus::bench {
namespace {

// Pairs of a particle that is fitted and one of `others` within `reach` of it.
double count_pairs(Frame& frame, const std::vector<std::int32_t>& others, double reach) {
  double pairs = 0;
  const NearLists near = list_near(frame.projected(), frame.rim().index, others, reach);
  for (std::size_t k = 0; k < frame.rim().index.size(); ++k)
    pairs += static_cast<double>(near[k].size());
  return pairs;
}

}  // namespace

Case prepare_evidence(Frame& frame) {
  const auto surface = std::make_shared<FitSurface>(
      upload_surface(frame.device, frame.projected(), frame.surface()));
  const auto trials = std::make_shared<TrialPlaces>(
      find_trials(frame.device, frame.projected(), frame.rim(), frame.surface().index));
  const double pairs = count_pairs(frame, frame.surface().index, kEvidenceReach);
  Case result{.unit = "fits", .items = static_cast<double>(frame.rim().index.size())};
  // A neighbour's index read. Of a fit place, two normals, quadrics and weights read; a normal, a
  // share and three values written.
  result.bytes = 4 * pairs + (152 + 28) * result.items;
  // A neighbour, for each of both trials: difference 3, weight 16, slope 21, its length 7, quadric
  // 18, distance 4, gradient 3. Sums over the wide ones 7; three times over the narrow ones, sheet
  // 14 and sums 36. A fit: both gradients 20, both sheets 90.
  result.operations = (2 * 72 + 7 + 3 * 50) * pairs + 110 * result.items;
  result.launch = [&frame, surface, trials] {
    measure_evidence(frame.device, *surface, *trials, frame.params.fit, frame.params.blend);
  };
  return result;
}

Case prepare_averages(Frame& frame) {
  Case result{.unit = "fits", .items = static_cast<double>(frame.rim().index.size())};
  result.frame_ms = frame.frame_ms(Method::fit, "average_on_sheets");
  // Twice, residuals and what trust is told from: place, normal, share and 1 or 3 values read, as
  // many written.
  result.bytes = ((28 + 2 * 4) + (28 + 2 * 12)) * result.items;
  // A pair: difference 3, distance 6, n.n' 5, weight 12, sums 3; two more values 4.
  const std::vector<std::int32_t>& fits = frame.rim().index;
  result.operations =
      29 * count_pairs(frame, fits, kResidualReach) + 33 * count_pairs(frame, fits, kTrustSheet);
  return result;
}

}  // namespace meniscus::bench
