// fit_groups: problems of few points and of many, each against its normal equations.
#include "stages/fit.hpp"

#include "verify/references/cases.hpp"
#include "verify/references/fits_by_hand.hpp"
#include "verify/references/worst.hpp"

namespace meniscus::verify {

ReferenceErrors fit_case(Device& device, int size) {
  const std::vector<reference::FitProblem> problems =
      problems_up_to(static_cast<std::size_t>(size));
  const FitParams params;
  const Fitted fitted = solve(device, problems, params);
  Worst equation("fit_groups", "normal equations"), residual("fit_groups", "residual");
  for (std::size_t g = 10; g < problems.size(); ++g) {
    const auto left = reference::residuals(problems[g], fitted.quadric[g], 0,
                                           weights_of(problems[g]), params, 0, fitted.slope[g]);
    for (int k = 0; k < 10; ++k) equation.see(left.error[k], 0, left.bound[k], left.size[k]);
    double sum = 0, weight = 0;
    for (const reference::FitPoint& point : problems[g].points) {
      const double f = reference::value_at(fitted.quadric[g], point.position - problems[g].centre);
      const double w = point.weight * reference::robustness(-f, params.tau);
      sum += w * f * f;
      weight += w;
    }
    // f is off by some 20 epsilon of terms of at most 2 R; so is a root mean square of it, and the
    // weights' slope, at most 0.86 / tau, moves it by no more than that times |f| near tau.
    residual.see(fitted.residual[g], std::sqrt(sum / weight),
                 4 * 20 * kEpsilon * 2 * problems[g].scale, problems[g].scale);
  }
  return {equation.error(), residual.error()};
}

}  // namespace meniscus::verify
