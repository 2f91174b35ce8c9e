// behind: the layer behind one that has ended: the fronts of the particles deeper than it
// (behind.cl).
#pragma once

#include <vector>

#include "stages/frame/visible.hpp"
#include "stages/sample/samples.hpp"

namespace meniscus {

/// The discs that may show behind some samples.
struct DiscsBehind {
  SplatParticles particles;
  cl_float2 sphere;             // footprint, particle radii, and bulge over footprint
  Buffer<float> bound;          // [bins] those with a greater key (Drawn::behind) are left out
  Discs discs;                  // of the particles; none where the device draws by atomic minima
  std::vector<BinLists> lists;  // of the bins; the same
};

/// Lists the particles that have fronts deeper than a gap behind some samples. Waits where they are
/// listed by bin.
DiscsBehind list_discs(Device& device, const SplatParticles& particles, cl_float2 sphere,
                       const GapLists& gaps);

/// The nearest front deeper than behind + gap at the listed samples, which are among those that the
/// discs were listed for; `behind` has not come nearer since. Depths in particle radii,
/// kNoSurface where nothing is; those of other samples mean nothing. Does not wait.
///
///   into  kNoSurface where the device draws by minima
void splat_behind(Device& device, const DiscsBehind& discs, const SampleLists& samples,
                  const Buffer<float>& behind, double gap, const Buffer<float>& into);

}  // namespace meniscus
