// The weighted fit of one quadric in double precision, row by row (paper 2.3, Eq. 2 with the
// design's off-surface rows, fit.cl).
#pragma once

#include <Eigen/Dense>
#include <algorithm>
#include <array>
#include <cmath>
#include <vector>

#include "meniscus/parameters.hpp"
#include "stages/vec.hpp"

namespace meniscus::reference {

/// A particle that a quadric is fitted to; lengths in particle radii.
struct FitPoint {
  Vec3d position, normal;
  double weight = 0;
};

/// The points of one quadric around `centre`, solved for in units of `scale`.
struct FitProblem {
  Vec3d centre;
  double scale = 1;
  std::vector<FitPoint> points;
};

using Basis = Eigen::Matrix<double, 10, 1>;
using Normal = Eigen::Matrix<double, 10, 10>;

inline Basis basis(const Vec3d& q) {
  Basis f;
  f << 1, q.x, q.y, q.z, q.x * q.x, q.y * q.y, q.z * q.z, q.x * q.y, q.y * q.z, q.z * q.x;
  return f;
}

/// f at X from the centre.
inline double value_at(const std::array<float, 10>& c, const Vec3d& x) {
  const Basis f = basis(x);
  double sum = 0;
  for (int k = 0; k < 10; ++k) sum += c[k] * f[k];
  return sum;
}

/// exp(-r^2 / tau^2), at least 1e-4: the share that is left of the weight of a point r behind the
/// surface.
inline double robustness(double r, double tau) {
  return std::max(std::exp(-std::pow(std::max(r, 0.0) / tau, 2)), 1e-4);
}

/// A a = b for the coefficients of f in q = (X - centre) / R, and the sums of the terms' absolute
/// values, which bound what rounding does.
struct NormalEquations {
  Normal A = Normal::Zero(), A_size = Normal::Zero();
  Basis b = Basis::Zero(), b_size = Basis::Zero();

  void add_row(double w, const Basis& f, double value) {
    A += w * f * f.transpose();
    A_size += w * (f.cwiseAbs() * f.cwiseAbs().transpose());
    b += w * value * f;
    b_size += w * std::abs(value) * f.cwiseAbs();
  }
};

/// f = 0 at each point and +-delta at delta to either side along its normal; ridge on the quadratic
/// terms, half of it on the mixed ones; every term has one of 1e-6.
///
///   weights  of the points, with the robust weights of the pass
inline NormalEquations normal_equations(const FitProblem& problem,
                                        const std::vector<double>& weights,
                                        const FitParams& params) {
  NormalEquations equations;
  const double delta = params.off_surface / problem.scale;
  double total = 0;
  for (std::size_t k = 0; k < problem.points.size(); ++k) {
    const Vec3d q = (problem.points[k].position - problem.centre) / problem.scale;
    const Vec3d& n = problem.points[k].normal;
    const double w = weights[k];
    total += w;
    equations.add_row(w, basis(q), 0);
    equations.add_row(w, basis(q + n * delta), delta);
    equations.add_row(w, basis(q - n * delta), -delta);
  }
  for (int k = 0; k < 10; ++k) {
    const double share = k < 4 ? 0 : k < 7 ? 1 : 0.5;
    equations.A(k, k) += total * (share * params.ridge + 1e-6);
  }
  return equations;
}

}  // namespace meniscus::reference
