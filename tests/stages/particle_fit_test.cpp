// The fits around particles against double-precision loops, on every device.
#include "stages/particle_fit.hpp"

#include <algorithm>
#include <cmath>

#include "reference/particle_fit.hpp"
#include "stages/fit_check.hpp"
#include "stages/mesh_by_hand.hpp"

namespace meniscus {
namespace {

using ParticleFit = OnDevice;
using reference::Surroundings;

double hills(double u, double v) { return 30 + 2 * std::sin(0.3 * u) + std::cos(0.25 * v); }
double roof(double u, double) { return 30 + 0.8 * std::abs(u - 21); }

// Particles of a surface, of which some are fitted.
struct Scene {
  Projected projected;
  Visible seen;
  SurfaceParticles around;
  std::vector<std::int32_t> place;  // of the seen ones in `around`

  Surroundings surroundings(const ParticleFits& fits) const {
    return reference::surroundings(projected, around, fits, place);
  }
};

// Every `step`-th particle is part of the surface alone.
Scene prepare(const Projected& projected, std::int32_t step = 5) {
  Scene scene{projected, {}, {}, {}};
  const Visible all = all_visible(projected);
  const Triangulation mesh = triangulated(projected);
  scene.around = {all.index, {}, first_normals(plain_view(), projected, all, mesh, mesh.normal)};
  Random random(3);
  for (const std::int32_t i : all.index) {
    scene.around.weight.push_back(static_cast<float>(random(0.3, 1)));
    if (i % step == step - 1) continue;
    scene.seen.index.push_back(i);
    scene.seen.owned.push_back(static_cast<float>(random(0.02, 0.12)));
  }
  scene.place = scene.seen.index;
  return scene;
}

ParticleFits fit(Device& device, const Scene& scene, const FitParams& params) {
  return fit_particles(device, scene.projected, scene.seen, scene.around, params);
}

// Weights have factors of at most 1 each. Their errors: n.n' by 6 epsilon times 2 / sigma^2; and 20
// epsilon for all but the last factor. That is exp(-x^2), whose slope is 0.86 at most, with x = h /
// 0.6 in the first pass, h good to 6 epsilon of a distance of rho; and later f / tau, f good to 10
// epsilon of its terms, which add up to 1.5 rho.
double weight_error(const FitParams& params, int pass) {
  const double x = pass == 1 ? 6 * params.support / 0.6 : 15 * params.support / params.tau;
  return kEpsilon * (12 / (params.normal_sigma * params.normal_sigma) + 0.86 * x + 20);
}

// Checks the fits of pass `pass` against the normal equations with the weights that those of the
// pass before give; `before` is empty in the first.
void expect_pass(const Scene& scene, const ParticleFits& before, const ParticleFits& after,
                 const FitParams& params, int pass) {
  const Surroundings all = scene.surroundings(before);
  ASSERT_EQ(after.size(), scene.seen.index.size());
  for (std::size_t k = 0; k < after.size(); ++k) {
    const std::size_t i = static_cast<std::size_t>(scene.place[k]);
    const double rho = after.support[k];
    reference::FitProblem problem{after.position[k], rho, {}};
    std::vector<double> weights;
    for (std::size_t j = 0; j < all.position.size(); ++j) {
      const Vec3d x = all.position[j] - problem.centre;
      if (length(x) >= rho) continue;
      // A full weight of 1, so that weight_error is in units of it.
      problem.points.push_back({all.position[j], all.normal[j], 1});
      const double w = reference::common_weight(x, all.normal[i], all.normal[j], all.weight[j], rho,
                                                params.normal_sigma);
      weights.push_back(
          w * (pass == 1
                   ? reference::flatness(x, all.normal[i])
                   : reference::robustness(
                         -reference::value_at(before.quadric[k], x) - params.offset, params.tau)));
    }
    ASSERT_GE(after.residual[k], 0);
    expect_solves(problem, after.quadric[k], params.offset, weights, params,
                  weight_error(params, pass));
    const auto& c = after.quadric[k];
    const Vec3d gradient = normalized({c[1], c[2], c[3]});
    EXPECT_GT(dot(after.normal[k], all.normal[i]), 0);
    // The gradient divided by its length: three roundings.
    EXPECT_NEAR(std::abs(dot(after.normal[k], gradient)), 1, 6 * kEpsilon);
  }
}

TEST_P(ParticleFit, EachPassWeighsByThePassBefore) {
  for (const auto& surface : {hills, roof}) {
    const Scene scene = prepare(field(11, 2, surface));
    FitParams params;
    params.least_support = 1;
    ParticleFits before;
    for (params.passes = 1; params.passes <= 3; ++params.passes) {
      const ParticleFits after = fit(device_, scene, params);
      for (const double rho : after.support) EXPECT_EQ(rho, params.support);
      expect_pass(scene, before, after, params, params.passes);
      before = after;
    }
  }
}

// Half of the field is a plane, half a wave that is too short for a quadric of the full support.
double half_wave(double u, double v) {
  return 30 + 0.1 * v + (u < 32 ? 0 : 1.2 * (1 - std::cos((u - 32) * 2 * std::acos(-1) / 12)));
}

TEST_P(ParticleFit, SupportsNarrowWhereOneQuadricCannotFollow) {
  FitParams full;
  full.least_support = 1;
  full.passes = 2;
  const FitParams params;
  ASSERT_LT(params.least_support, 1);
  // Noise of 0.5 has residuals by which 1.5 r_05 exceeds the 0.14 that decide without it.
  for (const double noise : {0.0, 0.5}) {
    Random random(11);
    const Scene scene = prepare(
        field(22, 6, [&](double u, double v) { return half_wave(u, v) + random(-noise, noise); }));
    const ParticleFits before = fit(device_, scene, full);
    const ParticleFits after = fit(device_, scene, params);
    const Surroundings all = scene.surroundings(before);
    std::size_t between = 0, flat = 0, wavy = 0;
    for (std::size_t k = 0; k < after.size(); ++k) {
      const std::size_t i = static_cast<std::size_t>(scene.place[k]);
      const double expected = reference::narrowed_support(all, i, params);
      // All double but for the result.
      EXPECT_NEAR(after.support[k], expected, expected * 2 * kEpsilon);
      between += expected > 1.01 * params.least_support * params.support &&
                 expected < 0.99 * params.support;
      if (noise > 0) continue;
      const double u = scene.projected.u[i];
      if (u < 32 - params.support - 6) {
        ++flat;
        EXPECT_EQ(after.support[k], params.support) << u;
      }
      if (u > 38 && u < 50) {
        ++wavy;
        EXPECT_LT(after.support[k], 0.8 * params.support) << u;
      }
    }
    EXPECT_GT(between, 10u);
    EXPECT_TRUE(noise > 0 || (flat > 10 && wavy > 10));
    expect_pass(scene, before, after, params, params.passes);
  }
}

TEST_P(ParticleFit, EdgesSpreadAndSupportersMatchTheReference) {
  double least = 1, most = 0, narrowest = 1e9;
  for (const auto& surface : {roof, half_wave}) {
    const Scene scene = prepare(field(18, 4, surface));
    const FitParams params;
    const ParticleFits fits = fit(device_, scene, params);
    const Surroundings all = scene.surroundings(fits);
    std::size_t decided = 0;
    for (std::size_t k = 0; k < fits.size(); ++k) {
      const auto expected = reference::measure(all, static_cast<std::size_t>(scene.place[k]),
                                               fits.support[k], fits.quadric[k], params);
      if (expected.margin < 1e-5) continue;  // a neighbour more or less
      ++decided;
      const double n = expected.neighbours;
      // The share is a quotient of sums of n terms of some 10 roundings; agreement is steep, 1.5 /
      // 0.1 times n.n', good to 4 epsilon. smoothstep's slope is 1.5 / 0.3 at most.
      EXPECT_NEAR(fits.edge[k], expected.edge, kEpsilon * (2 * n + 20 + 60) * 1.5 / 0.3);
      // f is good to 20 epsilon of its terms, which add up to 1.5 rho; the weights, as in
      // weight_error without its last factor, move a mean of squares below 4.
      const double f = 20 * kEpsilon * 1.5 * params.support;
      const double square = 4 * kEpsilon * (2 * n + 12 / 0.25 + 20) + 2 * 2 * f;
      EXPECT_NEAR(fits.spread[k] * fits.spread[k], expected.spread * expected.spread, square);
      EXPECT_NEAR(fits.supporters[k], expected.supporters, expected.supporters * n * kEpsilon);
      least = std::min(least, fits.edge[k]);
      most = std::max(most, fits.edge[k]);
      narrowest = std::min(narrowest, fits.support[k]);
    }
    EXPECT_GT(decided, fits.size() * 9 / 10);
  }
  EXPECT_LT(least, 0.1);  // on the ridge
  EXPECT_EQ(most, 1);
  EXPECT_LT(narrowest, 0.8 * FitParams{}.support);
}

// The sphere's own f = (x^2 - R^2) / 2R, at rest, misses the rows f(q +- delta n) = +-delta by
// delta^2 / 2R and pays the ridge on three coefficients of rho / 2R. The fit's sum of squares is
// not larger, and the points' share of it not either.
TEST_P(ParticleFit, ASphereStaysASphere) {
  constexpr double kRadius = 60;
  const Scene scene = prepare(field(12, 5, [](double u, double v) {
    return 90 - std::sqrt(kRadius * kRadius - (u - 21) * (u - 21) - (v - 21) * (v - 21));
  }));
  const Vec3d middle = point_at(plain_view(), 21, 21, 90);
  const FitParams params;
  const ParticleFits fits = fit(device_, scene, params);
  const double bulge = std::pow(params.off_surface, 2) / (2 * kRadius);
  const double bent = params.support / (2 * kRadius);
  const double bound =
      std::sqrt(2 * bulge * bulge + 3 * params.ridge * std::pow(bent * params.support, 2));
  ASSERT_LT(bound, 0.2);
  for (std::size_t k = 0; k < fits.size(); ++k) {
    EXPECT_GE(fits.residual[k], 0);
    EXPECT_LT(fits.residual[k], bound);
    EXPECT_NEAR(length(fits.foot[k] - middle), kRadius + params.offset, 2 * bound);
  }
}

TEST_P(ParticleFit, CarriesWhatIsKnownOfTheParticles) {
  const Scene scene = prepare(field(9, 7, hills));
  const ParticleFits fits = fit(device_, scene, {});
  for (std::size_t k = 0; k < fits.size(); ++k) {
    const std::size_t i = static_cast<std::size_t>(scene.seen.index[k]);
    EXPECT_EQ(fits.position[k], scene.projected.eye(i));
    EXPECT_EQ(fits.visible[k], visibility(scene.seen.owned[k]));
    EXPECT_EQ(fits.surface[k], scene.around.weight[scene.place[k]]);
    // The foot lies on the normal, an offset and the quadric's height above the particle.
    const Vec3d up = fits.foot[k] - fits.position[k];
    EXPECT_NEAR(length(cross(up, fits.normal[k])), 0, 1e-12);
    EXPECT_NEAR(dot(up, fits.normal[k]), -fits.quadric[k][0], 8 * kEpsilon);
  }
}

TEST_P(ParticleFit, FewerThanThreeNeighboursHaveNoFit) {
  std::vector<Vec3d> uvt{{20, 20, 30}, {60, 60, 30}, {62, 60, 30}};
  for (int k = 0; k < 5; ++k)
    for (int j = 0; j < 5; ++j) uvt.push_back({30 + 2.0 * k, 80 + 2.0 * j, 30});
  const Scene scene = prepare(place(uvt), 100);
  const ParticleFits fits = fit(device_, scene, {});
  for (std::size_t k = 0; k < fits.size(); ++k) {
    EXPECT_EQ(fits.residual[k] >= 0, k >= 3) << k;
    if (k >= 3) continue;
    EXPECT_EQ(fits.foot[k], fits.position[k]);
    EXPECT_EQ(fits.normal[k], Vec3d(Vec3(scene.around.normal[k])));
  }
  EXPECT_EQ(fit_particles(device_, scene.projected, {}, scene.around, {}).size(), 0u);
}

TEST_P(ParticleFit, VectorsOfAnyWidthGiveTheSameBits) {
  const Scene scene = prepare(field(13, 9, half_wave));
  use_width(1);
  const ParticleFits one = fit(device_, scene, {});
  use_width(8);
  const ParticleFits eight = fit(device_, scene, {});
  EXPECT_EQ(one.quadric, eight.quadric);
  EXPECT_EQ(one.residual, eight.residual);
  EXPECT_EQ(one.normal, eight.normal);
  EXPECT_EQ(one.support, eight.support);
  EXPECT_EQ(one.edge, eight.edge);
  EXPECT_EQ(one.spread, eight.spread);
}

MENISCUS_ON_EVERY_DEVICE(ParticleFit);

}  // namespace
}  // namespace meniscus
