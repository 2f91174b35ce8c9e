// faces: the faces beside edges, continued to where the particles on these are. Along a sharp edge
// fits are bevels (kernel measure_edges), which count little, and on a block's lattice nothing, or
// follow one of the edge's faces: near a corner no fit of the others would be within reach.
#pragma once

#include <vector>

#include "stages/fit/particle_fit.hpp"

namespace meniscus {

/// How far from a bevel's particle those of its faces may be, particle radii.
inline constexpr float kFaceReach = 5;

/// Fits and how far they are trusted.
struct TrustedFits {
  ParticleFits fits;
  std::vector<double> trust;
};

/// At each fit on an edge the faces on which its particle lies, at most one for each direction: of
/// the fits within kFaceReach whose normal is less than 96 degrees off the nearest, whose quadric
/// goes on to that particle. They are seen as it is, and count as far as the fit is at an edge,
/// (1 - η) (1 - smoothstep(.3, .6, e)) with its roundness η; those whose normal is its own, by
/// smoothstep(.72, .8) of their product, as far as it is a bevel, (1 - η) (1 - smoothstep(.01, .03,
/// e)). Groups have none: a small e tells that they fade.
TrustedFits faces_beside_edges(const ParticleFits& fits, const std::vector<double>& trust,
                               double offset);

}  // namespace meniscus
