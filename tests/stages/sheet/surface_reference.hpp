// Which particles stand for the surface, in double precision (surface.hpp): loops over all
// particles.
#pragma once

#include <algorithm>
#include <cmath>

#include "stages/vec.hpp"
#include "verify/reference/density.hpp"

namespace meniscus::reference {

/// The density field's gradient at a point, and the sum of its terms' sizes.
struct Gradient {
  Vec3d value;
  double size = 0;
  int near = 0;  // particles in reach
};

/// W'(q) / (2 |x - x_j|) (x - x_j) summed over the particles j, q = |x - x_j| / 2.
inline Gradient gradient(const Projected& p, const Vec3d& x) {
  Gradient sum;
  for (std::size_t i = 0; i < p.size(); ++i) {
    const Vec3d apart = x - p.eye(i);
    const double distance = length(apart), q = distance / 2;
    if (q >= 2.001) continue;
    ++sum.near;
    if (q >= 2 || distance == 0) continue;
    const double slope = share_slope(q);
    sum.value += apart * (slope / (2 * distance));
    sum.size += std::abs(slope) / 2;
  }
  return sum;
}

/// smoothstep(.22, .42, hypot(|grad C|, 1.5 max(0, .97 - C))), the gradient in 1/s.
inline double openness(double steep, double density) {
  return smooth_step(0.22, 0.42, std::hypot(steep, 1.5 * std::max(0.0, 0.97 - density)));
}

}  // namespace meniscus::reference
