// The velocity of the surface in double precision: a loop over all particles.
#pragma once

#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

#include "stages/vec.hpp"
#include "verify/reference/epsilon.hpp"

namespace meniscus::reference {

struct MovingParticle {
  Vec3d at;        // particle radii
  Vec3d velocity;  // world units per second
};

/// The mean velocity around a point, and what it was made of.
struct Motion {
  Vec3d velocity;
  double weight = 0;   // sum of weights
  double nearest = 0;  // distance, particle radii
  // For tolerances: sums over particles of |v - V| + |V|, times w and times (1 - d^2/S^2)^3; and of
  // |v - V| times the latter and 8 d / S^2, by which V changes per radius, times the weight.
  double by_weight = 0, by_cube = 0, slope = 0;
  int count = 0;  // of particles within the support
};

/// V(x) = sum of w v / sum of w, w = (1 - d^2/S^2)^4, S = max(4, 4/3 of the nearest d).
inline Motion motion(const std::vector<MovingParticle>& particles, const Vec3d& x) {
  Motion motion;
  motion.nearest = std::numeric_limits<double>::infinity();
  for (const MovingParticle& p : particles)
    motion.nearest = std::min(motion.nearest, length(p.at - x));
  const double support = std::max(4.0, 4.0 / 3 * motion.nearest);
  const auto inner = [&](const MovingParticle& p) {
    return std::max(0.0, 1 - std::pow(length(p.at - x) / support, 2));
  };
  for (const MovingParticle& p : particles) {
    const double w = std::pow(inner(p), 4);
    motion.weight += w;
    motion.velocity += p.velocity * w;
  }
  motion.velocity = motion.velocity / motion.weight;
  for (const MovingParticle& p : particles) {
    const double cube = std::pow(inner(p), 3), apart = length(p.velocity - motion.velocity);
    if (!(cube > 0)) continue;
    ++motion.count;
    motion.by_weight += cube * inner(p) * (apart + length(motion.velocity));
    motion.by_cube += cube * (apart + length(motion.velocity));
    motion.slope += cube * apart * 8 * length(p.at - x) / (support * support);
  }
  return motion;
}

/// How far a velocity may be from the reference's in one component. The squared distance rounds
/// five times and is at most 1 where it counts, so that 1 - d^2/16 carries 6 epsilon and its fourth
/// power 24 (1 - d^2/16)^3 and three roundings more; sums and the quotient round once a particle
/// and four times more. All of it is weighed by the velocities. `shift`: of the point, radii.
inline double motion_error(const Motion& m, double shift = 0) {
  return (kEpsilon * (24 * m.by_cube + (m.count + 7) * m.by_weight) + shift * m.slope) / m.weight;
}

}  // namespace meniscus::reference
