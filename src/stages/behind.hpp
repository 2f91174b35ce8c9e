// behind: the layer behind one that has ended: the fronts of the particles deeper than it
// (behind.cl).
#pragma once

#include <vector>

#include "stages/samples.hpp"
#include "stages/visible.hpp"

namespace meniscus {

/// The discs that may show behind some samples.
struct DiscsBehind {
  Discs discs;
  Buffer<float> bound;          // [bins] those with a greater key are left out
  std::vector<BinLists> lists;  // of the bins; none where the device draws by atomic minima
};

/// Lists the discs (Drawn::behind) that have fronts deeper than a gap behind some samples. Waits
/// where they are listed by bin.
DiscsBehind list_discs(Device& device, const Discs& discs, const GapLists& gaps);

/// The nearest front deeper than behind + gap at the listed samples, which are among those that the
/// discs were listed for; `behind` has not come nearer since. Depths in particle radii,
/// kNoSurface where nothing is; those of other samples mean nothing. Does not wait.
///
///   into  kNoSurface where the device draws by minima
void splat_behind(Device& device, const DiscsBehind& discs, const SampleLists& samples,
                  const Buffer<float>& behind, double gap, const Buffer<float>& into);

/// The same into a new map.
Buffer<float> splat_behind(Device& device, const DiscsBehind& discs, const SampleLists& samples,
                           const Buffer<float>& behind, double gap);

}  // namespace meniscus
