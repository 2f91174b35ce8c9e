// merge: groups of particles of similar normal and position (paper 2.2, step 3), each of which gets
// one quadric.
//
// Departs from the paper, whose groups are triangles on the screen: they change with every step of
// the camera, and the pictures flicker. Here the particles of the surface merge, seen or not, in an
// order that the world sets and no camera, and a group that another one is about to take in fades
// (docs/method.md, method groups).
#pragma once

#include <vector>

#include "meniscus/parameters.hpp"
#include "stages/frame/near_lists.hpp"
#include "stages/sheet/surface.hpp"

namespace meniscus {

/// What is left when nothing merges any more. A group is named by its seed, the particle that took
/// its members in.
struct MergedGroups {
  /// Places in Projected, ascending; owned: the most that a member owns, or kFullyVisible or more;
  /// influence: how far it is a group of its own, (0, 1], times its seed's own.
  Visible seed;
  std::vector<double> extent;  // [groups] radius within which it takes in members, particle radii
};

/// Merges the particles of `rim` until nothing merges any more. Each begins as a group of its own;
/// group j takes in particle i as far as
///
///   t_ij = (1 - smoothstep(.95, 1, |x_j - x_i| / R_ij)) smoothstep(.6, .8, n_i.n_j)
///          (1 - smoothstep(.9, 1.4, h_ij)) smoothstep(.5, .8, u_j) c_j
///          smoothstep(-.02, .02, a_j - a_i)
///
/// with h the distance along the mean of both normals, c the influence of j (Visible::influence), a
/// the rank that the place in the world gives a particle, and R_ij = min(R_i, R_j): params.reach
/// where the surface is calm, down to params.least_reach where it bends or breaks,
///
///   R_i = least_reach + (reach - least_reach) (1 - smoothstep(.003, .03, b_i)),
///
/// b_i the mean of 1 - n_i.n_j within 5, of those j whose normals are similar: a flat face is calm
/// up to its edge. What is left of i is W_i = prod_j (1 - W_j t_ij), found in
/// sweeps through the ranks; groups of W at most .35 are gone. All goes steadily with the
/// particles, so nothing pops when they move.
///
///   rim     the particles to merge, ascending, places in Projected (with_rim)
///   around  the surface, `rim` among it: normals and weights u
///   near    the particles of `around` within merge_reach(params) of each of `rim`, or farther
///
/// The groups do not depend on the number of threads, and on the camera only where the rim ends.
MergedGroups merge_particles(const View& view, const Projected& projected, const Visible& rim,
                             const SurfaceParticles& around, const NearLists& near,
                             const MergeParams& params);

/// How far merging looks around a particle, particle radii.
double merge_reach(const MergeParams& params);

}  // namespace meniscus
