// merge: groups of particles on the fluid's surface (paper 2.2, step 3), each of which gets one
// quadric.
#pragma once

#include <vector>

#include "meniscus/parameters.hpp"
#include "stages/surface.hpp"

namespace meniscus {

/// The groups that are left when nothing merges any more. A group is named by its seed, the
/// particle that took the others in.
struct MergedGroups {
  Visible seed;                // places in Projected, ascending; the most that a member owns
  std::vector<double> share;   // [n] how far the group is one of its own, (0, 1]
  std::vector<double> extent;  // [n] radius within which it took others in, particle radii
};

MergedGroups merge_surface(const View& view, const Projected& projected, const Visible& rim,
                           const SurfaceParticles& around, const MergeParams& params);

}  // namespace meniscus
