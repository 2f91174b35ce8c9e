// The weighted fit of one quadric in double precision, row by row (paper 2.3, Eq. 2 with the
// design's off-surface rows, fit.cl).
#pragma once

#include <Eigen/Dense>
#include <algorithm>
#include <array>
#include <cmath>
#include <optional>
#include <vector>

#include "meniscus/parameters.hpp"
#include "stages/vec.hpp"
#include "verify/reference/epsilon.hpp"

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

/// Its gradient there.
inline Vec3d gradient_at(const std::array<float, 10>& c, const Vec3d& x) {
  return {c[1] + 2.0 * c[4] * x.x + double{c[7]} * x.y + double{c[9]} * x.z,
          c[2] + 2.0 * c[5] * x.y + double{c[7]} * x.x + double{c[8]} * x.z,
          c[3] + 2.0 * c[6] * x.z + double{c[8]} * x.y + double{c[9]} * x.x};
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

/// What is left of each equation, how much may be, and the sum of its terms' sizes.
struct Residuals {
  Basis error, bound, size;
};

/// What a fit leaves of its normal equations, and how much it may.
///
/// A single pass is a linear solve. Its result a satisfies (A + E) a = b + e for small E and e
/// whatever A's condition is; so what is checked is A a - b, against
///   - the sums: a point is rounded to float (1), its monomials are products of up to four factors
///     and a weight, the moments are sums over up to 3 n rows: |E| <= (3 n + 12) epsilon |A|, where
///     |A| is made of the terms' absolute values;
///   - Cholesky's backward error, 11 epsilon |L| |L'| with (|L| |L'|)_ij <= sqrt(A_ii A_jj), and as
///     much for each of the two substitutions;
///   - `weight_doubt`, the error of the robust weights in units of the full weights;
///   - the way back: a is divided by R, R^2 and the slope and multiplied here again, 6 epsilon a.
/// The kernel divides by the slope |grad f(centre)|. Where that is not known, it is the factor that
/// fits b best; of ten equations nine remain.
inline Residuals residuals(const FitProblem& problem, const std::array<float, 10>& quadric,
                           double offset, const std::vector<double>& weights,
                           const FitParams& params, double weight_doubt = 0,
                           std::optional<double> known_slope = {}) {
  const auto equations = normal_equations(problem, weights, params);
  std::vector<double> full;  // without robust weights
  for (const FitPoint& point : problem.points) full.push_back(point.weight);
  const auto largest = normal_equations(problem, full, params);
  const double R = problem.scale;
  Basis a;
  for (int k = 0; k < 10; ++k) a[k] = quadric[k] * (k == 0 ? 1 / R : k < 4 ? 1 : R);
  a[0] += offset / R;
  const Basis image = equations.A * a;
  const double slope = known_slope ? *known_slope : image.dot(equations.b) / image.dot(image);
  const Basis error = slope * image - equations.b;
  const double n = static_cast<double>(problem.points.size());
  const Basis a_size = slope * a.cwiseAbs();
  const Basis pivots = equations.A.diagonal().cwiseSqrt();
  // The offset is subtracted from f(centre): one rounding of the larger of the two.
  const double lost =
      2 * kEpsilon * std::abs(slope) * (std::abs(offset) + std::abs(quadric[0])) / R;
  const Basis bound = kEpsilon * ((3 * n + 18) * (equations.A_size * a_size + equations.b_size) +
                                  33 * pivots * pivots.dot(a_size)) +
                      lost * equations.A.col(0).cwiseAbs() +
                      weight_doubt * (largest.A_size * a_size + largest.b_size);
  return {error, bound, equations.A_size * a_size + equations.b_size};
}

}  // namespace meniscus::reference
