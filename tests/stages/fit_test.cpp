// The quadrics' fit against its normal equations in double precision, on every device.
#include "stages/fit.hpp"

#include <algorithm>
#include <set>

#include "stages/fit_check.hpp"
#include "stages/stage_test_support.hpp"
#include "verify/references/fits_by_hand.hpp"

namespace meniscus {
namespace {

using Fit = OnDevice;
using reference::FitPoint;
using reference::FitProblem;

TEST(FitBatches, GiveEveryPointASlotOfItsOwn) {
  const std::vector<std::size_t> sizes{5, 0, 17, 1, 9, 9, 2, 40, 3, 3, 8, 31, 0, 12, 6, 7, 1};
  const FitBatches batches = make_batches(sizes).front();
  EXPECT_EQ(batches.lanes, 24u);
  ASSERT_EQ(batches.order.size(), sizes.size());
  EXPECT_EQ(std::set<std::int32_t>(batches.order.begin(), batches.order.end()).size(),
            sizes.size());
  std::set<std::size_t> taken;
  std::size_t points = 0;
  for (std::size_t l = 0; l < sizes.size(); ++l) {
    const std::size_t n = sizes[batches.order[l]];
    points += n;
    EXPECT_LE(static_cast<cl_int>(n), batches.length[l / 8]);
    for (std::size_t k = 0; k < n; ++k) taken.insert(batches.first_slot(l) + 8 * k);
  }
  EXPECT_EQ(taken.size(), points);
  EXPECT_LT(*taken.rbegin(), batches.slots);
  // Like sizes together: no batch is longer than the shortest lane of the next.
  for (std::size_t l = 8; l < sizes.size(); ++l)
    EXPECT_LE(batches.length[l / 8 - 1], static_cast<cl_int>(sizes[batches.order[l]]));
}

TEST_P(Fit, SolvesTheNormalEquations) {
  const auto problems = problems_up_to(45);
  FitParams params;
  for (const double ridge : {1e-3, 0.05})
    for (const double off_surface : {1.0, 0.5}) {
      params.ridge = ridge;
      params.off_surface = off_surface;
      const Fitted fitted = solve(device_, problems, params);
      for (std::size_t g = 10; g < problems.size(); ++g) {
        ASSERT_GE(fitted.residual[g], 0) << g << " points";
        expect_solves(problems[g], fitted.quadric[g], 0, weights_of(problems[g]), params, 0,
                      fitted.slope[g]);
      }
    }
}

TEST_P(Fit, ResidualIsTheOneSidedRmsOfTheDistances) {
  const auto problems = problems_up_to(30);
  for (const double tau : {0.3, 1.0}) {
    FitParams params;
    params.tau = tau;
    const Fitted fitted = solve(device_, problems, params);
    for (std::size_t g = 10; g < problems.size(); ++g) {
      double sum = 0, weight = 0;
      for (const FitPoint& point : problems[g].points) {
        const double f =
            reference::value_at(fitted.quadric[g], point.position - problems[g].centre);
        const double w = point.weight * reference::robustness(-f, tau);
        sum += w * f * f;
        weight += w;
      }
      // f is off by some 20 epsilon of terms of at most 2 R; so is a root mean square of it, and
      // the weights' slope, at most 0.86 / tau, moves it by no more than that times |f| near tau.
      const double doubt = 20 * kEpsilon * 2 * problems[g].scale;
      EXPECT_NEAR(fitted.residual[g], std::sqrt(sum / weight), 4 * doubt);
    }
  }
}

TEST_P(Fit, APlaneStaysAPlane) {
  // All rows are met exactly by f = n . X, which the ridge does not touch but for its 1e-6 on the
  // linear terms: they shrink by about 1e-6 and are scaled back by the slope.
  const Vec3d normal = normalized({0.3, -0.5, 1});
  const Vec3d side = normalized(cross(normal, {0, 1, 0})), up = cross(normal, side);
  Random random(4);
  for (const std::size_t n : {4, 8, 31}) {
    FitProblem problem;
    problem.centre = {1, 2, -30};
    problem.scale = 4;
    for (std::size_t k = 0; k < n; ++k)
      problem.points.push_back(
          {problem.centre + side * random(-3, 3) + up * random(-3, 3), normal, 0.5});
    const Fitted fit = solve(device_, {problem});
    ASSERT_GE(fit.residual[0], 0);
    // The points carry rounding of 1e-7 R, the pull of 1e-6 tilts a lopsided set by no more than
    // itself times the condition of the linear terms, here below 100.
    EXPECT_LT(fit.residual[0], 1e-4);
    EXPECT_NEAR(fit.quadric[0][0], 0, 4e-4);
    EXPECT_NEAR(fit.quadric[0][1], normal.x, 1e-4);
    EXPECT_NEAR(fit.quadric[0][2], normal.y, 1e-4);
    EXPECT_NEAR(fit.quadric[0][3], normal.z, 1e-4);
    for (int k = 4; k < 10; ++k) EXPECT_NEAR(fit.quadric[0][k], 0, 1e-4);
  }
}

TEST_P(Fit, NothingToFitIsNoFit) {
  const FitProblem good = cap(20, 1);
  FitProblem weightless = good, torn = good;
  for (FitPoint& point : weightless.points) point.weight = 0;
  // Every point twice, with opposite normals: nothing says where inside is, f = 0 solves all.
  for (const FitPoint& point : good.points)
    torn.points.push_back({point.position, -point.normal, point.weight});
  const Fitted fitted = solve(device_, {good, {}, weightless, torn, good});
  EXPECT_GE(fitted.residual[0], 0);
  for (const int g : {1, 2, 3}) EXPECT_LT(fitted.residual[g], 0) << g;
  EXPECT_EQ(fitted.residual[4], fitted.residual[0]);
  EXPECT_EQ(fitted.quadric[4], fitted.quadric[0]);
}

TEST_P(Fit, EveryWidthAndAnyCompanyGiveTheSameBits) {
  const auto problems = problems_up_to(37);
  use_width(1);
  const Fitted one = solve(device_, problems);
  for (const int width : {4, 8}) {
    use_width(width);
    const Fitted wide = solve(device_, problems);
    EXPECT_EQ(one.quadric, wide.quadric);
    EXPECT_EQ(one.residual, wide.residual);
    EXPECT_EQ(one.slope, wide.slope);
    const Fitted alone = solve(device_, {problems[20]});
    EXPECT_EQ(alone.quadric[0], one.quadric[20]);
    EXPECT_EQ(alone.residual[0], one.residual[20]);
  }
}

MENISCUS_ON_EVERY_DEVICE(Fit);

}  // namespace
}  // namespace meniscus
