// behind: the layer behind one that has ended: the fronts of the particles deeper than it
// (behind.cl).
#pragma once

#include <vector>

#include "stages/samples.hpp"
#include "stages/visible.hpp"

namespace meniscus {

/// The discs that may show behind some samples, by bin.
struct DiscsBehind {
  Buffer<float> records;  // of the discs, see visible.cl
  std::vector<BinLists> lists;
};

/// Lists the discs (Drawn::behind) that have fronts deeper than behind + gap (particle radii) at the
/// listed samples, where `behind` is finite. Waits.
DiscsBehind list_discs(Device& device, const Discs& discs, const SampleLists& samples,
                       const Buffer<float>& behind, double gap);

/// The nearest front deeper than behind + gap at the listed samples, which are among those that the
/// discs were listed for; `behind` has not come nearer since. Returns depths in particle radii,
/// kNoSurface where nothing is; those of other samples mean nothing. Does not wait.
Buffer<float> splat_behind(Device& device, const DiscsBehind& discs, const SampleLists& samples,
                           const Buffer<float>& behind, double gap);

}  // namespace meniscus
