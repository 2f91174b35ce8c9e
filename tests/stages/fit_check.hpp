// Checks a fit against its normal equations.
#pragma once

#include <optional>

#include "reference/fit.hpp"
#include "stages/stage_test_support.hpp"

namespace meniscus {

// A single pass is a linear solve. Its result a satisfies (A + E) a = b + e for small E and e
// whatever A's condition is; so what is checked is A a - b, against
//   - the sums: a point is rounded to float (1), its monomials are products of up to four factors
//     and a weight, the moments are sums over up to 3 n rows: |E| <= (3 n + 12) epsilon |A|, where
//     |A| is made of the terms' absolute values;
//   - Cholesky's backward error, 11 epsilon |L| |L'| with (|L| |L'|)_ij <= sqrt(A_ii A_jj), and as
//     much for each of the two substitutions;
//   - `weight_doubt`, the error of the robust weights in units of the full weights;
//   - the way back: a is divided by R, R^2 and the slope and multiplied here again, 6 epsilon a.
// The kernel divides by the slope |grad f(centre)|. Where that is not known, it is the factor that
// fits b best; of ten equations nine remain.
inline void expect_solves(const reference::FitProblem& problem,
                          const std::array<float, 10>& quadric, double offset,
                          const std::vector<double>& weights, const FitParams& params,
                          double weight_doubt = 0, std::optional<double> known_slope = {}) {
  const auto equations = reference::normal_equations(problem, weights, params);
  std::vector<double> full;  // without robust weights
  for (const reference::FitPoint& point : problem.points) full.push_back(point.weight);
  const auto largest = reference::normal_equations(problem, full, params);
  const double R = problem.scale;
  reference::Basis a;
  for (int k = 0; k < 10; ++k) a[k] = quadric[k] * (k == 0 ? 1 / R : k < 4 ? 1 : R);
  a[0] += offset / R;
  const reference::Basis image = equations.A * a;
  const double slope = known_slope ? *known_slope : image.dot(equations.b) / image.dot(image);
  const reference::Basis error = slope * image - equations.b;
  const double n = static_cast<double>(problem.points.size());
  const reference::Basis a_size = slope * a.cwiseAbs();
  const reference::Basis pivots = equations.A.diagonal().cwiseSqrt();
  // The offset is subtracted from f(centre): one rounding of the larger of the two.
  const double lost =
      2 * kEpsilon * std::abs(slope) * (std::abs(offset) + std::abs(quadric[0])) / R;
  const reference::Basis bound =
      kEpsilon * ((3 * n + 18) * (equations.A_size * a_size + equations.b_size) +
                  33 * pivots * pivots.dot(a_size)) +
      lost * equations.A.col(0).cwiseAbs() +
      weight_doubt * (largest.A_size * a_size + largest.b_size);
  for (int k = 0; k < 10; ++k)
    EXPECT_LE(std::abs(error[k]), bound[k])
        << "equation " << k << " of a fit of " << n << " points";
  const Eigen::Vector3d gradient(quadric[1], quadric[2], quadric[3]);
  EXPECT_NEAR(gradient.norm(), 1, 8 * kEpsilon);
}

}  // namespace meniscus
