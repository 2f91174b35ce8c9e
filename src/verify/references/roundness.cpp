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
    // f is good to 20 epsilon of terms that add up to 10; its square, at most 1/4, to twice that
    // times 1/2. Sums of some fifty terms round by as many epsilon.
    const double bound = kEpsilon * (20 * 10 + 50);
    for (std::size_t k = 0; k < scene.seen.index.size(); ++k) {
      one.see(evidence.one[k], reference::one_quadric(wide, k), bound);
      bend.see(evidence.bend[k], reference::bend_of(wide, k), bound);
      // Which sheet is taken is a choice, and shares are steep: where ten roundings of the input
      // move the result by more than the bound, they move it more.
      const double expected = reference::two_sheets(narrow, k);
      const double moved = std::abs(reference::two_sheets(near_narrow, k) - expected);
      if (moved > bound) continue;
      two.see(evidence.two[k], expected, 4 * bound);
    }
  }
  return {one.error(), two.error(), bend.error()};
}

}  // namespace meniscus::verify
