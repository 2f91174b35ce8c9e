// The density field in double precision: a loop over all particles.
#pragma once

#include <cmath>
#include <numbers>
#include <vector>

#include "stages/project.hpp"
#include "verify/reference/epsilon.hpp"

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

/// Particles that add to the field at x, and some at the very rim.
inline double near_count(const Projected& p, const Vec3d& x) {
  double near = 0;
  for (std::size_t i = 0; i < p.size(); ++i) near += length(x - p.eye(i)) < 4.001;
  return near;
}

/// How far a density in floats may be from the reference's. A share's terms are at most 1.5 / pi in
/// size and its argument carries 4 epsilon, which the spline's slope (at most 1) passes on: 16
/// epsilon / pi for each particle in reach; the sum and the norm round once a particle and once
/// more.
inline double density_error(const Projected& p, const Vec3d& x, double density) {
  const double near = near_count(p, x);
  return kEpsilon * (16 / std::numbers::pi * near + (near + 2) * density);
}

/// The same of a component of the gradient. A term is at most 1 / (2 pi) in size and rounds eight
/// times in its factors and, with a slope of 3 / (4 pi) a radius, eight times more in the distance
/// of four radii; the sum rounds once a particle.
inline double gradient_error(const Projected& p, const Vec3d& x) {
  const double near = near_count(p, x);
  return kEpsilon * near * (near + 16 + 8) / (2 * std::numbers::pi);
}

}  // namespace meniscus::reference
