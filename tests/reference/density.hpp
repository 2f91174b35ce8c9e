// The density field in double precision: a loop over all particles.
#pragma once

#include <cmath>
#include <numbers>
#include <vector>

#include "stages/project.hpp"

namespace meniscus::reference {

/// Cubic spline kernel of smoothing length h = 2 particle radii times V = h^3, at the distance
/// q h: 1/pi (1 - 3/2 q^2 + 3/4 q^3) for q < 1, 1/(4 pi) (2 - q)^3 for q < 2, 0 beyond.
inline double share(double q) {
  if (q >= 2) return 0;
  return (q < 1 ? 1 - 1.5 * q * q + 0.75 * q * q * q : 0.25 * std::pow(2 - q, 3)) /
         std::numbers::pi;
}

/// C(x) = sum of the shares.
inline double density(const Projected& p, const Vec3d& x) {
  double sum = 0;
  for (std::size_t i = 0; i < p.size(); ++i) sum += share(length(x - p.eye(i)) / 2);
  return sum;
}

}  // namespace meniscus::reference
