// The density field in double precision: a loop over all particles.
#pragma once

#include <algorithm>
#include <cmath>
#include <numbers>

#include "stages/frame/project.hpp"
#include "verify/reference/epsilon.hpp"

namespace meniscus::reference {

/// The cubic spline kernel of smoothing length h, times h^3, at the distance q h (Monaghan and
/// Lattanzio 1985): what the field is meant to be.
inline double cubic_spline(double q) {
  const double w =
      q < 1 ? 1 - 1.5 * q * q + 0.75 * q * q * q : 0.25 * std::pow(2 - std::min(q, 2.0), 3);
  return w / std::numbers::pi;
}

/// The share of a particle at the distance q h, with h = 2 particle radii and v = 1 - q^2 / 4:
/// (.243067 v^3 + .456322 v^4 - .84229 v^5 + 1.142901 v^6) / pi for q < 2, 0 beyond. Within .004 /
/// pi of the cubic spline kernel of smoothing length h times h^3.
inline double share(double q) {
  const double v = std::max(0.0, 1 - q * q / 4);
  return v * v * v * (0.243067 + v * (0.456322 + v * (-0.84229 + v * 1.142901))) / std::numbers::pi;
}

/// Its derivative by q.
inline double share_slope(double q) {
  const double v = std::max(0.0, 1 - q * q / 4);
  return -q / 2 * v * v *
         (3 * 0.243067 + v * (4 * 0.456322 + v * (-5 * 0.84229 + v * 6 * 1.142901))) /
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

/// How far a density in floats may be from the reference's. Of the share's terms, .3, .5, .9 and
/// 1.2 over pi at most, each carries five epsilon; v carries one and five of q^2 / 4, which the
/// steepest slope, 5.2 / pi where q is 0, passes on: 24 epsilon / pi for each particle in reach;
/// the sum and the norm round once a particle and once more.
inline double density_error(const Projected& p, const Vec3d& x, double density) {
  const double near = near_count(p, x);
  return kEpsilon * (24 / std::numbers::pi * near + (near + 2) * density);
}

/// The same of a component of the gradient. A term is at most .52 / pi in size and rounds four
/// times in its last factors. Its slope's terms, .4, 1, 2.2 and 3.5 times v^2 d / 4, each with
/// three epsilon, come to 6 epsilon / pi at most; v's error, passed on by the second derivative,
/// to 5. The sum rounds once a particle.
inline double gradient_error(const Projected& p, const Vec3d& x) {
  const double near = near_count(p, x);
  return kEpsilon * near * (near + 28) / (1.9 * std::numbers::pi);
}

}  // namespace meniscus::reference
