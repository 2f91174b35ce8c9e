// The fits around particles against double-precision loops, on every device.
#include "stages/fit/particle_fit.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

#include "stages/fit/fit_check.hpp"
#include "stages/stage_test_support.hpp"
#include "verify/reference/particle_fit.hpp"
#include "verify/stage_cases/fits_by_hand.hpp"
#include "verify/stage_cases/mesh_by_hand.hpp"

namespace meniscus {
namespace {

using ParticleFit = OnDevice;
using reference::Surroundings;

using Scene = FittedSurface;

ParticleFits fit(Device& device, const Scene& scene, const FitParams& params) {
  return fit_particles(device, scene.projected, scene.seen, scene.around, params);
}

// Some fits of two sheets, some of one quadric, some in between.
std::vector<float> mixed_roundness(const Scene& scene) {
  Random random(7);
  std::vector<float> roundness;
  for (std::size_t k = 0; k < scene.around.index.size(); ++k)
    roundness.push_back(k % 3 == 0 ? 0 : k % 3 == 1 ? 1 : static_cast<float>(random(0, 1)));
  return roundness;
}

// Checks the fits of a pass against the normal equations with the weights that those of the last
// two passes give; these are empty in the first.
void expect_pass(const Scene& scene, const ParticleFits& earlier, const ParticleFits& before,
                 const ParticleFits& after, const FitParams& of_sheets) {
  const Surroundings all = scene.surroundings(before), told = scene.surroundings(earlier);
  ASSERT_EQ(after.size(), scene.seen.index.size());
  for (std::size_t k = 0; k < after.size(); ++k) {
    const std::size_t i = static_cast<std::size_t>(scene.place[k]);
    const double rho = after.support[k];
    const FitParams params = reference::round_params(of_sheets, after.roundness[k]);
    const reference::PassProblem one = reference::pass_problem(
        all, before, k, i, rho, params, reference::firm_of(told, i, of_sheets, after.roundness[k]));
    ASSERT_GE(after.residual[k], 0);
    expect_solves(one.problem, after.quadric[k], params.offset, one.weights, params, 1);
    const auto& c = after.quadric[k];
    const Vec3d gradient = normalized({c[1], c[2], c[3]});
    EXPECT_NEAR(after.residual[k], reference::residual_of(one, c, params),
                reference::residual_error(one, after.quadric[k], params));
    EXPECT_GT(dot(after.normal[k], all.normal[i]), 0);
    // The gradient divided by its length: three roundings.
    EXPECT_NEAR(std::abs(dot(after.normal[k], gradient)), 1, 6 * kEpsilon);
  }
}

TEST(NearFinders, FindTheSameInAnyRange) {
  constexpr float kReach = 9;
  const Projected p = scattered(3000, 12, 5);
  const Cells cells = make_cells(p.x, p.y, p.z, kReach);
  const std::array at{cells.x[310], cells.y[310], cells.z[310]};
  std::size_t most = 0;
  for (const std::int32_t first : {0, 7, 300})
    for (const std::int32_t length : {0, 1, 15, 16, 17, 63, 64, 65, 130, 400})
      for (const std::uint32_t tag : {cells.tag[310], cells.tag[9]}) {
        std::vector<std::int32_t> expected;
        for (std::int32_t k = first; k < first + length; ++k) {
          const float dx = cells.x[k] - at[0], dy = cells.y[k] - at[1], dz = cells.z[k] - at[2];
          if (dx * dx + dy * dy + dz * dz < kReach * kReach && same_row(cells.tag[k], tag))
            expected.push_back(cells.item[k]);
        }
        most = std::max(most, expected.size());
        for (NearFinder* const find : near_finders()) {
          std::vector<std::int32_t> found(static_cast<std::size_t>(length) + kNearRoom);
          found.resize(find(cells, first, first + length, tag, at, kReach * kReach, found.data()));
          EXPECT_EQ(found, expected) << first << " + " << length;
        }
      }
  EXPECT_GT(most, 32u);  // more than two vectors
}

TEST(BeforeFinders, TellTheSameInAnyRange) {
  constexpr float kReach = 5;
  const Projected p = scattered(3000, 12, 5);
  const Cells cells = make_cells(p.x, p.y, p.z, kReach);
  for (const std::int32_t begin : {0, 7, 300})
    for (const std::int32_t length : {0, 1, 16, 17, 200}) {
      std::vector<std::uint16_t> expected(static_cast<std::size_t>(length), 0);
      for (std::int32_t k = 0; k < length; ++k)
        for (std::int32_t bit = std::max(0, kBefore - k); bit < kBefore; ++bit) {
          const std::int32_t own = begin + k, other = own - kBefore + bit;
          const float dx = cells.x[other] - cells.x[own], dy = cells.y[other] - cells.y[own],
                      dz = cells.z[other] - cells.z[own];
          if (dx * dx + dy * dy + dz * dz < kReach * kReach)
            expected[static_cast<std::size_t>(k)] |= static_cast<std::uint16_t>(1u << bit);
        }
      if (length == 200) {
        EXPECT_GT(std::count(expected.begin(), expected.end(), 0), 0);
        EXPECT_LT(std::count(expected.begin(), expected.end(), 0), 190);
      }
      for (NearBefore* const find : before_finders()) {
        std::vector<std::uint16_t> near(static_cast<std::size_t>(length), 0xffff);
        find(cells, begin, begin + length, kReach * kReach, near.data());
        EXPECT_EQ(near, expected) << begin << " + " << length;
      }
    }
}

TEST(NeighbourLists, HoldEveryNeighbourOnce) {
  constexpr float kReach = 7;
  // Two sheets, of which one is sparse, and more fits than a processor takes at a time.
  const Projected p =
      field(22, 2, [](double u, double v) { return hills(u, v) + (u > 30 ? 9 : 0); });
  const Scene scene = fitted_surface(p, 7);
  const cl_int nobody = static_cast<cl_int>(p.size());
  std::size_t of_all = 0;
  for (const std::size_t most : {std::size_t{1} << 28, std::size_t{9000}}) {
    const auto parts = list_neighbours(p, scene.seen.index, scene.around.index, kReach, most);
    EXPECT_EQ(parts.size() > 1, most == 9000);
    std::vector<int> listed(scene.seen.index.size(), 0);
    std::size_t slots = 0, taken = 0;
    for (const NeighbourLists& lists : parts) {
      EXPECT_LE(lists.neighbour.size(), most);
      slots += lists.neighbour.size();
      ASSERT_EQ(lists.fit.size(), 16 * lists.first.size());
      for (std::size_t l = 0; l < lists.fit.size(); ++l) {
        std::vector<std::int32_t> found, expected;
        for (int k = 0; k < lists.length[l / 16]; ++k) {
          const cl_int j = lists.neighbour[static_cast<std::size_t>(lists.first[l / 16]) + l % 16 +
                                           16 * static_cast<std::size_t>(k)];
          if (j != nobody) found.push_back(j);
        }
        if (lists.fit[l] < 0) {
          EXPECT_EQ(lists.particle[l], nobody);
          EXPECT_TRUE(found.empty());
          continue;
        }
        const std::size_t k = static_cast<std::size_t>(lists.fit[l]);
        ++listed[k];
        EXPECT_EQ(lists.particle[l], scene.place[k]);
        const std::size_t i = static_cast<std::size_t>(scene.seen.index[k]);
        for (std::size_t j = 0; j < p.size(); ++j) {
          const float dx = p.x[j] - p.x[i], dy = p.y[j] - p.y[i], dz = p.z[j] - p.z[i];
          if (dx * dx + dy * dy + dz * dz < kReach * kReach)
            expected.push_back(static_cast<std::int32_t>(j));
        }
        std::sort(found.begin(), found.end());
        EXPECT_EQ(found, expected) << k;
        taken += found.size();
      }
    }
    EXPECT_EQ(listed, std::vector<int>(listed.size(), 1));
    EXPECT_LT(slots, taken + taken / 10);  // those of a batch have about as many
    if (of_all == 0) of_all = taken;
    EXPECT_EQ(taken, of_all);
  }
}

TEST_P(ParticleFit, EachPassWeighsByThePassBefore) {
  FitParams others;
  others.ridge = 0.05;
  others.off_surface = 0.5;
  others.tau = 1;
  for (FitParams params : {FitParams{}, others})
    for (const auto& surface : {hills, roof}) {
      const Scene scene = fitted_surface(field(11, 2, surface));
      params.least_support = 1;
      ParticleFits earlier, before;
      for (params.passes = 1; params.passes <= 3; ++params.passes) {
        const ParticleFits after = fit(device_, scene, params);
        for (const double rho : after.support) EXPECT_EQ(rho, params.support);
        expect_pass(scene, earlier, before, after, params);
        earlier = std::exchange(before, after);
      }
    }
}

TEST_P(ParticleFit, RoundFitsCrossWiderAnglesAndSeeLess) {
  for (const auto& surface : {hills, roof}) {
    const Scene scene = fitted_surface(field(11, 2, surface));
    const std::vector<float> roundness = mixed_roundness(scene);
    FitParams params;
    params.least_support = 1;
    ParticleFits earlier, before;
    for (params.passes = 1; params.passes <= 3; ++params.passes) {
      const ParticleFits after =
          fit_particles(device_, scene.projected, scene.seen, scene.around, params, roundness);
      for (std::size_t k = 0; k < after.size(); ++k) {
        const float round = roundness[static_cast<std::size_t>(scene.place[k])];
        EXPECT_EQ(after.roundness[k], round);
        EXPECT_FLOAT_EQ(static_cast<float>(after.support[k]), 10 - 3 * round);
      }
      expect_pass(scene, earlier, before, after, params);
      earlier = std::exchange(before, after);
    }
  }
}

// Half of the field is a plane, half a wave that is too short for a quadric of the full support.
double half_wave(double u, double v) {
  return 30 + 0.1 * v + (u < 32 ? 0 : 1.2 * (1 - std::cos((u - 32) * 2 * std::acos(-1) / 9)));
}

TEST_P(ParticleFit, SupportsNarrowWhereOneQuadricCannotFollow) {
  FitParams params;
  ASSERT_LT(params.least_support, 1);
  // Noise of 0.5 has residuals by which 1.5 r_05 exceeds the 0.14 that decide without it. Fits
  // between two sheets leave out what lies off their quadric: of the wave alone, round fits have
  // residuals.
  for (const auto& [round, noise] : {std::pair{0.0f, 0.0}, {0.0f, 0.5}, {1.0f, 0.0}, {1.0f, 0.5}}) {
    Random random(11);
    const Scene scene = fitted_surface(field(22, 6, [&, noise = noise](double u, double v) {
      return half_wave(u, v) + random(-noise, noise);
    }));
    const std::vector<float> roundness(scene.around.index.size(), round);
    const auto fit_by = [&](const FitParams& by) {
      return fit_particles(device_, scene.projected, scene.seen, scene.around, by, roundness);
    };
    FitParams full = params, once = params;
    full.least_support = once.least_support = 1;
    full.passes = 2;
    once.passes = 1;
    const ParticleFits earlier = fit_by(once), before = fit_by(full), after = fit_by(params);
    const Surroundings all = scene.surroundings(before);
    const double widest = round > 0 ? params.round_support : params.support;
    std::size_t between = 0, flat = 0, wavy = 0;
    for (std::size_t k = 0; k < after.size(); ++k) {
      const std::size_t i = static_cast<std::size_t>(scene.place[k]);
      const auto [narrowed, error] = reference::narrowed_support(all, i, params);
      const double expected = std::min(narrowed, widest);
      EXPECT_NEAR(after.support[k], expected, error + 4 * kEpsilon * expected);
      between +=
          expected > 1.01 * params.least_support * params.support && expected < 0.99 * widest;
      if (noise > 0) continue;
      const double u = scene.projected.u[i];
      if (u < 32 - params.support - 6) {
        ++flat;
        EXPECT_EQ(after.support[k], widest) << u;
      }
      if (round > 0 && u > 38 && u < 48) {
        ++wavy;
        EXPECT_LT(after.support[k], 0.8 * widest) << u;
      }
    }
    EXPECT_TRUE(noise > 0 ? between > 10 : flat > 10 && (wavy > 10 || round == 0));
    expect_pass(scene, earlier, before, after, params);
  }
}

double steep_roof(double u, double) { return 30 + 2.5 * std::abs(u - 21); }

TEST_P(ParticleFit, EdgesSpreadAndSupportersMatchTheReference) {
  double least = 1, most = 0, narrowest = 1e9;
  for (const auto& surface : {roof, half_wave, steep_roof}) {
    const Scene scene = fitted_surface(field(18, 4, surface));
    const FitParams params;
    const ParticleFits fits = fit_particles(device_, scene.projected, scene.seen, scene.around,
                                            params, mixed_roundness(scene));
    const Surroundings all = scene.surroundings(fits);
    std::size_t decided = 0;
    for (std::size_t k = 0; k < fits.size(); ++k) {
      const auto expected = reference::measure(
          all, static_cast<std::size_t>(scene.place[k]), fits.support[k], fits.quadric[k],
          fits.residual[k], reference::round_params(params, fits.roundness[k]), fits.roundness[k]);
      if (expected.margin < 1e-5) continue;  // a neighbour more or less
      ++decided;
      const double bound = reference::edge_error(expected, params);
      EXPECT_NEAR(fits.edge[k], expected.edge, bound);
      EXPECT_NEAR(fits.firmness[k], expected.firmness, bound);
      EXPECT_NEAR(fits.spread[k] * fits.spread[k], expected.spread * expected.spread,
                  reference::spread_error(expected, params));
      EXPECT_NEAR(fits.supporters[k], expected.supporters,
                  expected.supporters * expected.neighbours * kEpsilon);
      least = std::min(least, fits.edge[k]);
      most = std::max(most, fits.edge[k]);
      narrowest = std::min(narrowest, fits.support[k]);
    }
    EXPECT_GT(decided, fits.size() * 9 / 10);
  }
  EXPECT_LT(least, 0.01);  // bevels on the steep ridge
  EXPECT_EQ(most, 1);
  EXPECT_LT(narrowest, 0.8 * FitParams{}.support);
}

// The sphere's own f = (x^2 - R^2) / 2R, at rest, misses the rows f(q +- delta n) = +-delta by
// delta^2 / 2R and pays the ridge on three coefficients of rho / 2R. The fit's sum of squares is
// not larger, and the points' share of it not either.
TEST_P(ParticleFit, ASphereStaysASphere) {
  constexpr double kRadius = 60;
  const Scene scene = fitted_surface(field(12, 5, [](double u, double v) {
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
  const Scene scene = fitted_surface(field(9, 7, hills));
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
  std::vector<Vec3d> uvt{{20, 20, 30}, {60, 60, 30}, {62, 60, 30}};  // and one more at the end
  for (int k = 0; k < 5; ++k)
    for (int j = 0; j < 5; ++j) uvt.push_back({30 + 2.0 * k, 80 + 2.0 * j, 30});
  uvt.push_back({61, 62, 30});
  Scene scene = fitted_surface(place(uvt), 100);
  scene.around.normal[2] = {0.8f, 0, -0.6f};  // 127 degrees off: not the same surface
  scene.around.normal[1] = scene.around.normal[28] = {0, 0, 1};
  const ParticleFits fits = fit(device_, scene, {});
  for (std::size_t k = 0; k < fits.size(); ++k) {
    const bool fitted = k >= 3 && k < 28;
    EXPECT_EQ(fits.residual[k] >= 0, fitted) << k;
    if (fitted) continue;
    EXPECT_EQ(fits.foot[k], fits.position[k]);
    EXPECT_EQ(fits.normal[k], Vec3d(Vec3(scene.around.normal[k])));
  }
  EXPECT_EQ(fit_particles(device_, scene.projected, {}, scene.around, {}).size(), 0u);
}

TEST_P(ParticleFit, VectorsOfAnyWidthGiveTheSameBits) {
  const Scene scene = fitted_surface(field(13, 9, half_wave));
  use_width(1);
  const ParticleFits one = fit(device_, scene, {});
  for (const int width : {4, 8, 16}) {
    use_width(width);
    const ParticleFits wide = fit(device_, scene, {});
    EXPECT_EQ(one.quadric, wide.quadric);
    EXPECT_EQ(one.residual, wide.residual);
    EXPECT_EQ(one.normal, wide.normal);
    EXPECT_EQ(one.support, wide.support);
    EXPECT_EQ(one.edge, wide.edge);
    EXPECT_EQ(one.firmness, wide.firmness);
    EXPECT_EQ(one.spread, wide.spread);
  }
}

// Where the neighbours of all fits have no room in one buffer, parts of the fits do.
TEST_P(ParticleFit, InPartsTheBitsAreTheSame) {
  const Scene scene = fitted_surface(field(24, 2, roof));
  const std::vector<float> roundness = mixed_roundness(scene);
  const auto all = [&] {
    return fit_particles(device_, scene.projected, scene.seen, scene.around, {}, roundness);
  };
  const ParticleFits whole = all();
  std::size_t& largest = device_.state().info.largest_buffer;
  const std::size_t before = std::exchange(largest, std::size_t{65} << 10);
  const std::size_t parts =
      find_neighbours(device_, scene.projected, scene.seen, scene.around.index, fit_reach({}))
          .parts.size();
  const ParticleFits apart = all();
  largest = before;
  EXPECT_GT(parts, 1u);
  EXPECT_EQ(apart.quadric, whole.quadric);
  EXPECT_EQ(apart.residual, whole.residual);
  EXPECT_EQ(apart.normal, whole.normal);
  EXPECT_EQ(apart.support, whole.support);
  EXPECT_EQ(apart.edge, whole.edge);
  EXPECT_NE(whole.support, std::vector<double>(whole.support.size(), whole.support[0]));
}

MENISCUS_ON_EVERY_DEVICE(ParticleFit);

}  // namespace
}  // namespace meniscus
