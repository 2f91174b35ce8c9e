// The whole pipeline against analytic solids.
#include "accuracy/study.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <ostream>
#include <string>

#include "meniscus/device.hpp"

namespace meniscus::accuracy {
namespace {

// One of those that no constant was chosen on (docs/accuracy.md).
constexpr std::uint64_t kSeed = 1001;

Figures figures_of(Device& device, const Case& scene_case, Method method) {
  Parameters parameters;
  parameters.method = method;
  parameters.mesh = false;
  return measure(device, scene_case, parameters).figures;
}

// The means over the cases, which are one scene with the seeds that docs/accuracy.md reports.
Figures figures_of(Device& device, const std::vector<Case>& cases, Method method) {
  Figures mean;
  mean.holes = mean.normal_rms = mean.slope_median = mean.angle_median = 0;
  for (const Case& each : cases) {
    const Figures found = figures_of(device, each, method);
    for (const auto figure :
         {&Figures::holes, &Figures::normal_rms, &Figures::slope_median, &Figures::angle_median})
      mean.*figure += found.*figure / static_cast<double>(cases.size());
  }
  return mean;
}

/// What is asked of a method. Noise is 0.05 s in each coordinate.
struct Bounds {
  double normal_rms;  // s
  double angle;       // degrees; median, of the map's normals and of those that the depths have
};

/// What a baseline had on twelve tuning seeds: mean and standard deviation of one seed.
struct Baseline {
  double normal_rms, normal_deviation;  // s
  double slope, slope_deviation;        // degrees; median
};

struct Wanted {
  std::string scene;
  Bounds fit, stable;
  Baseline ssm;

  friend void PrintTo(const Wanted& wanted, std::ostream* out) { *out << wanted.scene; }
};

void expect_within(const Figures& f, const Bounds& bounds, double factor = 1) {
  EXPECT_LE(f.normal_rms, factor * bounds.normal_rms);
  EXPECT_LE(f.slope_median, factor * bounds.angle);
  EXPECT_LE(f.angle_median, factor * bounds.angle);
}

class MethodAccuracy : public testing::TestWithParam<Wanted> {};

// All methods in one test: the scene's rays take most of its time.
TEST_P(MethodAccuracy, IsAsPromised) {
  const Wanted& wanted = GetParam();
  const std::vector<Case> cases =
      make_cases({wanted.scene}, {kSeed, kSeed + 1, kSeed + 2}, accuracy::Setup{});
  Device device;
  {
    // The bounds that the project has set itself; of the box, a tenth above docs/accuracy.md.
    SCOPED_TRACE("fit");
    const Figures f = figures_of(device, cases, Method::fit);
    EXPECT_EQ(f.holes, 0);
    expect_within(f, wanted.fit);
  }
  {
    // Groups of merged particles are to be as right as a fit around each, within a tenth.
    SCOPED_TRACE("groups");
    const Figures f = figures_of(device, cases, Method::groups);
    EXPECT_EQ(f.holes, 0);
    expect_within(f, wanted.fit, 1.1);
  }
  {
    // The bounds that the project has set itself.
    SCOPED_TRACE("stable");
    expect_within(figures_of(device, cases, Method::stable), wanted.stable);
  }
  {
    // A baseline that was made weak would prove nothing, and one that is better would have to be
    // told of: with the settings that the search for the best found (docs/rivals.md), the means
    // over the three reporting seeds are where those of twelve other seeds say, within four
    // standard errors of their difference. The figures: meniscus-accuracy --method ssm --scene
    // sphere,waves,box --seeds 1,2,3,4,5,6,7,8,9,10,11,12 --json FILE ("by_seed"), on PoCL 3.1,
    // 24 November 2026.
    SCOPED_TRACE("ssm");
    const Figures f = figures_of(device, cases, Method::ssm);
    const double errors = 4 * std::sqrt(1.0 / 3 + 1.0 / 12);
    EXPECT_NEAR(f.normal_rms, wanted.ssm.normal_rms, errors * wanted.ssm.normal_deviation);
    EXPECT_NEAR(f.slope_median, wanted.ssm.slope, errors * wanted.ssm.slope_deviation);
  }
}

INSTANTIATE_TEST_SUITE_P(
    Scenes, MethodAccuracy,
    testing::Values(Wanted{"sphere", {0.025, 1.0}, {0.035, 1.5}, {0.07234, 0.00406, 1.939, 0.120}},
                    Wanted{"waves", {0.04, 2.2}, {0.05, 2.2}, {0.09742, 0.00234, 2.768, 0.072}},
                    Wanted{"box", {0.0225, 1.0}, {0.035, 1.5}, {0.03846, 0.00449, 1.854, 0.149}}),
    [](const auto& info) { return info.param.scene; });

// What the project promises of fit in the mean over all scenes, of which a scene counts where it
// has the figure.
TEST(FitAccuracyOverAllScenes, IsAsPromised) {
  Device device;
  Parameters parameters;
  parameters.mesh = false;
  ASSERT_EQ(parameters.method, Method::fit);
  std::vector<std::string> names;
  for (const Scene& scene : scenes()) names.push_back(scene.name);
  std::vector<Figures> all;
  for (const Case& scene_case : make_cases(names, {kSeed}, accuracy::Setup{})) {
    all.push_back(measure(device, scene_case, parameters).figures);
    // Splash: every particle is covered, none is missing or doubled, clusters are closed.
    if (scene_case.scene->name == "splash") {
      EXPECT_DOUBLE_EQ(all.back().splash_covered, 100);
      EXPECT_EQ(all.back().splash_missing, 0);
      EXPECT_EQ(all.back().splash_doubled, 0);
      EXPECT_DOUBLE_EQ(all.back().splash_closed, 100);
    }
    if (scene_case.scene->name == "box") {
      EXPECT_GE(all.back().iou, 0.98);
    }
  }
  const auto mean = [&](double Figures::*figure) {
    double sum = 0;
    int count = 0;
    for (const Figures& figures : all)
      if (std::isfinite(figures.*figure)) {
        sum += figures.*figure;
        ++count;
      }
    return sum / count;
  };
  EXPECT_LE(mean(&Figures::normal_rms), 0.027);
  EXPECT_LE(mean(&Figures::depth_rms), 0.040);
  EXPECT_LE(mean(&Figures::angle_median), 1.0);
  EXPECT_LE(mean(&Figures::angle_p95), 3.0);
  EXPECT_LE(mean(&Figures::crease_rms), 0.13);
  EXPECT_LE(mean(&Figures::crease_angle), 3.0);
  EXPECT_LE(mean(&Figures::crease_jag), 0.1);
  EXPECT_LE(mean(&Figures::outline_jag), 0.1);
  EXPECT_LE(mean(&Figures::outline_miss), 0.11);
  EXPECT_GE(mean(&Figures::iou), 0.989);
}

// At 3 pixels per s gaps between drops are a few pixels large, and are no flaws: where such gaps
// were closed, gate's outline was .095 s off. At 40, what two looks behind the front layer miss is
// as large: crown had three holes.
TEST(FitAccuracyFarAwayAndCloseUp, KeepsGapsAndHasNoHoles) {
  Device device;
  accuracy::Setup setup;
  setup.scale = 3;
  for (const Case& scene_case : make_cases({"gate"}, {kSeed}, setup))
    EXPECT_LE(figures_of(device, scene_case, Method::fit).outline_miss, 0.07);
  setup.scale = 40;
  for (const Case& scene_case : make_cases({"crown"}, {kSeed}, setup))
    EXPECT_EQ(figures_of(device, scene_case, Method::fit).holes, 0);
}

// Noise of .12 s, whose distances to nearest particles are as uneven as those of SPH, and of .29 s,
// as one particle anywhere in each cube of a lattice has and FLIP and MPM leave. Who does not even
// particles out draws that noise. Thin round bodies sink a little: of capsules alone anisotropic
// kernels are nearer (.15 s, .18 s by fit, with noise of .29 s), so that distances are compared in
// the mean over the scenes.
TEST(FitAccuracyOfIrregularParticles, IsBelowTheRivals) {
  Device device;
  for (const auto& [noise, gain, scenes] :
       {std::tuple{0.12, 1.5, std::vector<std::string>{"box"}},
        std::tuple{0.29, 2.0, std::vector<std::string>{"box", "capsules", "crown"}}}) {
    accuracy::Setup irregular;
    irregular.noise = noise;
    double fit_rms = 0, kernels_rms = 0, ssm_rms = 0;
    for (const Case& scene_case : make_cases(scenes, {kSeed}, irregular)) {
      SCOPED_TRACE(scene_case.scene->name + ", noise " + std::to_string(noise));
      const Figures fit = figures_of(device, scene_case, Method::fit);
      Parameters parameters;
      parameters.mesh = false;
      parameters.disorder = 0;
      const Figures as_they_are = measure(device, scene_case, parameters).figures;
      EXPECT_LT(fit.angle_median, as_they_are.angle_median / gain);
      EXPECT_LT(fit.angle_p95, as_they_are.angle_p95 / gain);
      EXPECT_LT(fit.normal_rms, as_they_are.normal_rms);
      fit_rms += fit.normal_rms;
      const auto is_below = [&](Method method, double& rms) {
        SCOPED_TRACE(to_string(method));
        const Figures rival = figures_of(device, scene_case, method);
        EXPECT_LT(fit.angle_median, rival.angle_median);
        EXPECT_LT(fit.angle_p95, rival.angle_p95);
        rms += rival.normal_rms;
      };
      is_below(Method::anisotropic, kernels_rms);
      is_below(Method::ssm, ssm_rms);
    }
    EXPECT_LT(fit_rms, kernels_rms);
    EXPECT_LT(fit_rms, ssm_rms);
  }
}

// Particles anywhere, as FLIP and MPM leave them: gaps between them were pits, where normals jump.
TEST(FitAccuracyOfIrregularParticles, HasNoPitsWhereParticlesLieAnywhere) {
  Device device;
  accuracy::Setup anywhere;
  anywhere.noise = 0;
  anywhere.filling = accuracy::Filling::random;
  for (const Case& scene_case : make_cases({"box", "waves"}, {kSeed}, anywhere)) {
    SCOPED_TRACE(scene_case.scene->name);
    const Figures fit = figures_of(device, scene_case, Method::fit),
                  kernels = figures_of(device, scene_case, Method::anisotropic);
    Parameters parameters;
    parameters.mesh = false;
    parameters.disorder = 1;
    const Figures in_cubes = measure(device, scene_case, parameters).figures;
    EXPECT_LT(fit.jump_p999, in_cubes.jump_p999 / 3);
    EXPECT_LT(fit.angle_p95, in_cubes.angle_p95 / 1.3);
    EXPECT_LT(fit.normal_rms, in_cubes.normal_rms / 1.3);
    EXPECT_LT(fit.angle_median, kernels.angle_median / 2);
    EXPECT_LT(fit.angle_p95, kernels.angle_p95 / 2);
    EXPECT_LT(fit.normal_rms, kernels.normal_rms / 1.5);
    EXPECT_LT(std::abs(fit.normal_bias), 0.1);
  }
}

// Noise is no reason for a crease: edges of water at walls, which are round, came out as shards,
// and the jumps of both shapes were three times the rival's. Edges of a box are a reason.
TEST(FitAccuracyOfIrregularParticles, HasCreasesWhereThereAreCreases) {
  Device device;
  accuracy::Setup irregular;
  irregular.noise = 0.15;
  double fit_jump = 0, kernels_jump = 0;
  for (const Case& scene_case : make_cases({"gate", "wall", "box"}, {kSeed}, irregular)) {
    SCOPED_TRACE(scene_case.scene->name);
    const Figures fit = figures_of(device, scene_case, Method::fit),
                  kernels = figures_of(device, scene_case, Method::anisotropic);
    EXPECT_LT(fit.rim_angle, kernels.rim_angle);
    if (scene_case.scene->name == "box") {
      EXPECT_LT(fit.crease_angle, kernels.crease_angle / 2);
    } else {
      fit_jump += fit.jump_p999;
      kernels_jump += kernels.jump_p999;
    }
  }
  EXPECT_LT(fit_jump, kernels_jump);
}

// While the camera moves by 0.3 pixels; the narrow-range filter is the steadiest of the rivals.
TEST(FitFlicker, IsAsPromisedAndBelowTheNarrowRangeFilters) {
  Device device;
  accuracy::Setup moving;
  moving.moving = true;
  double flicker = 0, flicker_p999 = 0;
  const std::vector<Case> cases = make_cases({"sphere", "waves", "box"}, {kSeed}, moving);
  for (const Case& scene_case : cases) {
    SCOPED_TRACE(scene_case.scene->name);
    const Figures fit = figures_of(device, scene_case, Method::fit),
                  filter = figures_of(device, scene_case, Method::narrow_range);
    EXPECT_LT(fit.flicker, filter.flicker);
    EXPECT_LT(fit.flicker_p999, filter.flicker_p999);
    flicker += fit.flicker / static_cast<double>(cases.size());
    flicker_p999 += fit.flicker_p999 / static_cast<double>(cases.size());
  }
  EXPECT_LE(flicker, 0.003);
  EXPECT_LE(flicker_p999, 0.02);
}

}  // namespace
}  // namespace meniscus::accuracy
