// faces: the faces beside bevels, continued to where these are. Along a sharp edge fits are bevels
// (kernel measure_edges), which count little, and on a block's lattice nothing: near a corner no
// fit of a face would be within reach.
#pragma once

#include <vector>

#include "stages/particle_fit.hpp"

namespace meniscus {

/// How far from a bevel's particle those of its faces may be, particle radii.
inline constexpr float kFaceReach = 5;

/// Fits and how far they are trusted.
struct TrustedFits {
  ParticleFits fits;
  std::vector<double> trust;
};

/// At each bevel the faces on which its particle lies, at most one for each direction: of the fits
/// within kFaceReach whose normal is less than 73 degrees off the nearest, whose quadric goes on to
/// the bevel. They are seen as the bevel is, and count as far as it is one,
/// (1 - η) (1 - smoothstep(.01, .03, e)) with its roundness η. Groups have none: a small e tells
/// that they fade.
TrustedFits faces_beside_bevels(const ParticleFits& fits, const std::vector<double>& trust,
                                double offset);

}  // namespace meniscus
