// Checks a fit against its normal equations.
#pragma once

#include <optional>

#include "stages/stage_test_support.hpp"
#include "verify/reference/fit.hpp"

namespace meniscus {

// That a quadric solves the normal equations of a problem, whose weights may be off by
// `weight_doubt` full weights.
inline void expect_solves(const reference::FitProblem& problem,
                          const std::array<float, 10>& quadric, double offset,
                          const std::vector<double>& weights, const FitParams& params,
                          double weight_doubt = 0, std::optional<double> known_slope = {}) {
  const auto left =
      reference::residuals(problem, quadric, offset, weights, params, weight_doubt, known_slope);
  for (int k = 0; k < 10; ++k)
    EXPECT_LE(std::abs(left.error[k]), left.bound[k])
        << "equation " << k << " of a fit of " << problem.points.size() << " points";
  const Eigen::Vector3d gradient(quadric[1], quadric[2], quadric[3]);
  EXPECT_NEAR(gradient.norm(), 1, 8 * kEpsilon);
}

}  // namespace meniscus
