// The quadrics' fit against its normal equations in double precision, on every device.
#include "stages/fit.hpp"

#include "stages/fit_check.hpp"
#include "stages/stage_test_support.hpp"

namespace meniscus {
namespace {

using Fit = OnDevice;

// n points near a cap of a sphere of 12 radii, with normals off by a little; a few lie deeper.
FitProblem cap(std::size_t n, unsigned seed) {
  Random random(seed);
  FitProblem problem;
  problem.centre = {random(-5, 5), random(-5, 5), random(-40, -20)};
  problem.scale = random(3, 6);
  const Vec3d up = normalized({random(-1, 1), random(-1, 1), 1.5});
  for (std::size_t k = 0; k < n; ++k) {
    const Vec3d side{random(-0.6, 0.6), random(-0.6, 0.6), random(-0.6, 0.6)};
    const Vec3d outward = normalized(up * 2 + side);
    const double deep = k % 7 == 6 ? random(1, 2) : random(-0.1, 0.1);
    const Vec3d normal = normalized(outward + Vec3d{random(-1, 1), random(-1, 1), 0} * 0.1);
    problem.points.push_back(
        {problem.centre - up * 12 + outward * (12 - deep), normal, random(0.05, 0.75)});
  }
  return problem;
}

// Problems of every size from 0 to `most` points.
std::vector<FitProblem> problems_up_to(std::size_t most) {
  std::vector<FitProblem> problems;
  for (std::size_t n = 0; n <= most; ++n) problems.push_back(cap(n, static_cast<unsigned>(n)));
  return problems;
}

// Weights of the pass after the one that gave `quadric`: a point r behind the surface (without the
// offset) has exp(-r^2 / tau^2) of its weight, but at least 1e-4.
std::vector<double> robust_weights(const FitProblem& problem, const std::array<float, 10>& quadric,
                                   const FitParams& params) {
  std::vector<double> weights;
  for (const FitPoint& point : problem.points) {
    const double f = value_at(quadric, point.position - problem.centre) + params.offset;
    const double behind = std::max(0.0, -f) / params.tau;
    weights.push_back(point.weight * std::max(std::exp(-behind * behind), 1e-4));
  }
  return weights;
}

TEST_P(Fit, OnePassSolvesTheNormalEquations) {
  const auto problems = problems_up_to(45);
  FitParams params;
  params.robust_passes = 0;
  for (const double offset : {0.0, 1.0})
    for (const double off_surface : {1.0, 0.5}) {
      params.offset = offset;
      params.off_surface = off_surface;
      const Quadrics quadrics = fit_quadrics(device_, problems, params);
      for (std::size_t g = 3; g < problems.size(); ++g) {
        std::vector<double> weights;
        for (const FitPoint& point : problems[g].points) weights.push_back(point.weight);
        expect_solves(problems[g], quadrics.coefficient[g], offset, weights, params);
      }
    }
}

TEST_P(Fit, EachPassWeighsByThePassBefore) {
  const auto problems = problems_up_to(45);
  FitParams params;
  params.offset = 0.5;
  for (int passes = 1; passes <= 3; ++passes) {
    params.robust_passes = passes - 1;
    const Quadrics before = fit_quadrics(device_, problems, params);
    params.robust_passes = passes;
    const Quadrics after = fit_quadrics(device_, problems, params);
    for (std::size_t g = 3; g < problems.size(); ++g) {
      // The weights themselves come from f in float: f is off by some 20 epsilon of its terms, at
      // most about 2 R, which moves exp(-f^2 / tau^2) by 2 |f| / tau^2 times that; that is at most
      // 0.86 / tau, where the exponential's own slope is steepest. Its share of A is checked by
      // letting the reference's weights be as far off.
      const double doubt = 0.86 / params.tau * 20 * kEpsilon * 2 * problems[g].scale;
      ASSERT_LT(doubt, 1e-4);
      std::vector<double> weights = robust_weights(problems[g], before.coefficient[g], params);
      expect_solves(problems[g], after.coefficient[g], params.offset, weights, params, doubt);
    }
  }
}

TEST_P(Fit, ResidualIsTheWeightedRmsOfTheDistances) {
  const auto problems = problems_up_to(30);
  FitParams params;
  params.offset = 0;
  const Quadrics quadrics = fit_quadrics(device_, problems, params);
  for (std::size_t g = 0; g < problems.size(); ++g) {
    if (g < 3) {
      EXPECT_LT(quadrics.residual[g], 0) << "fewer than three points have no fit";
      continue;
    }
    const auto weights = robust_weights(problems[g], quadrics.coefficient[g], params);
    double sum = 0, weight = 0;
    for (std::size_t k = 0; k < weights.size(); ++k) {
      const Vec3d x = problems[g].points[k].position - problems[g].centre;
      sum += weights[k] * std::pow(value_at(quadrics.coefficient[g], x), 2);
      weight += weights[k];
    }
    // f is off by some 20 epsilon of terms of at most 2 R; so is a root mean square of it, and the
    // weights move it by no more (see above).
    const double doubt = 20 * kEpsilon * 2 * problems[g].scale;
    EXPECT_NEAR(quadrics.residual[g], std::sqrt(sum / weight), 4 * doubt);
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
    const Quadrics fit = fit_quadrics(device_, {problem}, {});
    ASSERT_GE(fit.residual[0], 0);
    // The points carry rounding of 1e-7 R, the pull of 1e-6 tilts a lopsided set by no more than
    // itself times the condition of the linear terms, here below 100.
    EXPECT_LT(fit.residual[0], 1e-4);
    EXPECT_NEAR(fit.coefficient[0][0], -1, 4e-4);
    EXPECT_NEAR(fit.coefficient[0][1], normal.x, 1e-4);
    EXPECT_NEAR(fit.coefficient[0][2], normal.y, 1e-4);
    EXPECT_NEAR(fit.coefficient[0][3], normal.z, 1e-4);
    for (int k = 4; k < 10; ++k) EXPECT_NEAR(fit.coefficient[0][k], 0, 1e-4);
  }
}

TEST_P(Fit, EveryWidthAndAnyCompanyGiveTheSameBits) {
  const auto problems = problems_up_to(37);
  use_width(1);
  const Quadrics one = fit_quadrics(device_, problems, {});
  use_width(8);
  const Quadrics eight = fit_quadrics(device_, problems, {});
  EXPECT_EQ(one.coefficient, eight.coefficient);
  EXPECT_EQ(one.residual, eight.residual);
  const Quadrics alone = fit_quadrics(device_, {problems[20]}, {});
  EXPECT_EQ(alone.coefficient[0], eight.coefficient[20]);
  EXPECT_EQ(alone.residual[0], eight.residual[20]);
  EXPECT_TRUE(fit_quadrics(device_, {}, {}).coefficient.empty());
}

TEST(GroupProblems, WeighByTheSplineOfTheDistance) {
  Triangulation mesh;
  mesh.position = {{0, 0, -20}, {2, 0, -20}, {0, 4, -20}, {-1, 0, -20}};
  Groups groups;
  groups.centre = {{0, 0, -20}};
  groups.normal = {{0, 0, 1}};
  groups.radius = {2};
  groups.triangles = {1};
  groups.members = {2};
  groups.start = {0, 4};
  groups.point = {0, 1, 2, 3};
  const std::vector<Vec3d> normals(4, Vec3d{0, 0, 1});
  const auto problems = group_problems(mesh, groups, normals);
  ASSERT_EQ(problems.size(), 1u);
  EXPECT_DOUBLE_EQ(problems[0].scale, 1.05 * 4);
  ASSERT_EQ(problems[0].points.size(), 4u);
  const double R = 1.05 * 4;
  const auto t = [&](double distance) { return 1.5 * distance / R; };
  EXPECT_DOUBLE_EQ(problems[0].points[0].weight, 0.75);
  EXPECT_DOUBLE_EQ(problems[0].points[1].weight, 0.5 * std::pow(1.5 - t(2), 2));
  EXPECT_DOUBLE_EQ(problems[0].points[2].weight, 0.5 * std::pow(1.5 - t(4), 2));
  EXPECT_DOUBLE_EQ(problems[0].points[3].weight, 0.75 - t(1) * t(1));
}

MENISCUS_ON_EVERY_DEVICE(Fit);

}  // namespace
}  // namespace meniscus
