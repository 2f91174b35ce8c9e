// The weighted fit of one group in double precision, row by row (paper 2.3, Eq. 2 with the design's
// off-surface rows, fit.hpp).
#pragma once

#include <Eigen/Dense>

#include "stages/fit.hpp"

namespace meniscus::reference {

using Basis = Eigen::Matrix<double, 10, 1>;
using Normal = Eigen::Matrix<double, 10, 10>;

inline Basis basis(const Vec3d& q) {
  Basis f;
  f << 1, q.x, q.y, q.z, q.x * q.x, q.y * q.y, q.z * q.z, q.x * q.y, q.y * q.z, q.z * q.x;
  return f;
}

/// Derivatives of the basis along x, y and z.
inline Eigen::Matrix<double, 10, 3> basis_slopes(const Vec3d& q) {
  Eigen::Matrix<double, 10, 3> d;
  d.setZero();
  d(1, 0) = d(2, 1) = d(3, 2) = 1;
  d(4, 0) = 2 * q.x;
  d(5, 1) = 2 * q.y;
  d(6, 2) = 2 * q.z;
  d(7, 0) = d(8, 2) = q.y;
  d(7, 1) = d(9, 2) = q.x;
  d(8, 1) = d(9, 0) = q.z;
  return d;
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

/// Eight points or more: f = 0 at each point and +-delta at delta to either side along its normal,
/// ridge on the quadratic terms. Fewer: f = 0, and grad f = n weighted by 0.05, ridge 0.01. The
/// ridge counts half on the mixed terms; every term has one of 1e-6.
///
///   weights  of the points, with the robust weights of the pass
inline NormalEquations normal_equations(const FitProblem& problem,
                                        const std::vector<double>& weights,
                                        const FitParams& params) {
  NormalEquations equations;
  const bool few = problem.points.size() < 8;
  const double delta = params.off_surface / problem.scale;
  double total = 0;
  for (std::size_t k = 0; k < problem.points.size(); ++k) {
    const Vec3d q = (problem.points[k].position - problem.centre) / problem.scale;
    const Vec3d& n = problem.points[k].normal;
    const double w = weights[k];
    total += w;
    equations.add_row(w, basis(q), 0);
    if (few) {
      const auto slopes = basis_slopes(q);
      const double values[3] = {n.x, n.y, n.z};
      for (int axis = 0; axis < 3; ++axis)
        equations.add_row(0.05 * w, slopes.col(axis), values[axis]);
    } else {
      equations.add_row(w, basis(q + n * delta), delta);
      equations.add_row(w, basis(q - n * delta), -delta);
    }
  }
  const double ridge = few ? 1e-2 : params.ridge;
  for (int k = 0; k < 10; ++k) {
    const double share = k < 4 ? 0 : k < 7 ? 1 : 0.5;
    equations.A(k, k) += total * (share * ridge + 1e-6);
  }
  return equations;
}

}  // namespace meniscus::reference
