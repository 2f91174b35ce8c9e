// measure_evidence: what the trial fits say of each particle, given the fits themselves.
#include "verify/references/roundness.hpp"

#include "verify/references/cases.hpp"
#include "verify/references/worst.hpp"

namespace meniscus::verify {

ReferenceErrors roundness_case(Device& device, int size) {
  Worst one("measure_evidence", "one quadric"), two("measure_evidence", "two sheets"),
      bend("measure_evidence", "bend");
  for (const auto& surface : {hills, roof}) {
    const FittedSurface scene = fitted_surface(field(size, 2, surface));
    const Evidence evidence = evidence_of(device, scene);
    const auto wide = trial_fits(device, scene, true), narrow = trial_fits(device, scene, false);
    Random random(5);
    const auto near_narrow = rounded(narrow, random);
    for (std::size_t k = 0; k < scene.seen.index.size(); ++k) {
      one.see(evidence.one[k], reference::one_quadric(wide, k), kEvidenceBound);
      bend.see(evidence.bend[k], reference::bend_of(wide, k), kEvidenceBound);
      const double expected = reference::two_sheets(narrow, k);
      const double moved = std::abs(reference::two_sheets(near_narrow, k) - expected);
      if (moved > kEvidenceBound) continue;
      two.see(evidence.two[k], expected, 4 * kEvidenceBound);
    }
  }
  return {one.error(), two.error(), bend.error()};
}

}  // namespace meniscus::verify
