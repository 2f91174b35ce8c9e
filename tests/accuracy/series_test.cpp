// What the measuring instrument varies: settings, seeds, cameras and fillings.
#include "accuracy/series.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cfloat>
#include <cmath>
#include <numbers>
#include <set>

#include "meniscus/error.hpp"
#include "thrown.hpp"

namespace meniscus::accuracy {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;

Setup changed(const std::string& series, std::size_t setting, Setup setup = {}) {
  series_named({series}).at(0).settings.at(setting).change(setup);
  return setup;
}

TEST(AccuracySeries, EachSettingChangesWhatItIsNamedFor) {
  EXPECT_EQ(changed("main", 0, {.noise = 0.07}).noise, 0.07) << "main leaves the options alone";
  EXPECT_EQ(changed("noise", 0).noise, 0);
  EXPECT_EQ(changed("noise", 1).noise, 0.05);
  EXPECT_EQ(changed("noise", 3).noise, 0.12);
  EXPECT_EQ(changed("noise", 5).noise, 0.29);
  EXPECT_EQ(changed("lattice", 0).filling, Filling::lattice);
  EXPECT_EQ(changed("lattice", 1).filling, Filling::deep_lattice);
  EXPECT_EQ(changed("random", 0).filling, Filling::random);
  EXPECT_EQ(changed("random", 0).noise, 0);
  EXPECT_EQ(changed("spacing", 0).scale, 2);
  EXPECT_EQ(changed("spacing", 6).scale, 40);
  EXPECT_TRUE(changed("orthographic", 0).orthographic);
  EXPECT_LT(changed("wide", 0).distance, 1);
  EXPECT_GT(changed("narrow", 0).distance, 1);
  EXPECT_EQ(changed("jitter", 0).jitter, 0.01);
}

TEST(AccuracySeries, TheCameraMovesWithTheFirstSeedsOnly) {
  const std::vector<Case> cases =
      make_cases({"sphere"}, {1, 2}, {.moving = true, .moving_seeds = 1});
  ASSERT_EQ(cases.size(), 2);
  EXPECT_EQ(cases[0].truths.size(), 4);
  EXPECT_EQ(cases[1].truths.size(), 1);
}

TEST(AccuracySeries, AllIsEverySeriesAndNamesAreTheirOwn) {
  const auto all = series_named({"all"});
  std::set<std::string> names;
  for (const Series& series : all) {
    EXPECT_TRUE(names.insert(series.name).second) << series.name << " is there twice";
    std::set<std::string> settings;
    for (const Setting& setting : series.settings)
      EXPECT_TRUE(settings.insert(setting.name).second) << series.name << ": " << setting.name;
  }
  EXPECT_EQ(names.size(), 9);
  EXPECT_THAT(text_of_thrown<InvalidArgument>([] {
                series_named({"main", "colour"});
              }),
              AllOf(HasSubstr("'colour'"), HasSubstr("main, noise")));
}

TEST(AccuracySeries, AreTakenWhereTheyChangeWhatIsMeasured) {
  std::vector<std::string> prefixes;
  std::vector<double> noise;
  const auto measure = [&](const accuracy::Setup& setup, const std::string& prefix) {
    prefixes.push_back(prefix);
    noise.push_back(setup.noise);
  };
  for_each_setting({"main", "lattice", "random"}, {.noise = 0.07}, Changes::particles, measure);
  EXPECT_THAT(prefixes, ElementsAre("", "lattice_inside_", "lattice_deep_", "random_random_"));
  EXPECT_THAT(noise, ElementsAre(0.07, 0.07, 0.07, 0));
  const auto refused = [&](const std::string& series, Changes most) {
    return text_of_thrown<InvalidArgument>([&] {
      for_each_setting({"main", series}, {}, most, measure);
    });
  };
  for (const char* series : {"spacing", "orthographic", "wide", "narrow", "jitter"})
    EXPECT_THAT(refused(series, Changes::particles),
                AllOf(HasSubstr(series), HasSubstr("one of main, noise, lattice, random")));
  EXPECT_THAT(refused("jitter", Changes::view), HasSubstr("wide, narrow"));
  EXPECT_EQ(prefixes.size(), 4) << "nothing is measured before that is refused";
}

TEST(AccuracySeeds, TuningAndReportingAreKeptApart) {
  EXPECT_THAT(seeds_named({"tuning"}), ElementsAre(1, 2, 3));
  EXPECT_THAT(seeds_named({"reporting"}), ElementsAre(1001, 1002, 1003));
  EXPECT_THAT(seeds_named({"7", "99"}), ElementsAre(7, 99));
  EXPECT_THAT(text_of_thrown<InvalidArgument>([] {
                seeds_named({"1", "1001"});
              }),
              HasSubstr("of one kind"));
  EXPECT_THAT(text_of_thrown<InvalidArgument>([] {
                seeds_named({"tuning", "reporting"});
              }),
              HasSubstr("of one kind"));
  for (const char* word : {"0", "100", "1000", "-1", "1x", ""})
    EXPECT_THAT(text_of_thrown<InvalidArgument>([&] { seeds_named({word}); }), HasSubstr(word))
        << word;
}

TEST(AccuracyCamera, SeedTurnsItAboutTheTarget) {
  const Scene& scene = find_scene("twolayer");
  EXPECT_EQ(posed(scene, 1).eye, scene.eye);
  const double distance = length(scene.eye - scene.target);
  const auto angles = [&](const Vec3d& eye) {
    const Vec3d arm = eye - scene.target;
    return std::pair{std::atan2(arm.y, arm.x), std::asin(arm.z / length(arm))};
  };
  const auto [heading, height] = angles(scene.eye);
  double widest = 0;
  for (const std::uint64_t seed : {2, 3, 1001, 1002, 1003, 1004, 1005, 1006}) {
    const Scene turned = posed(scene, seed);
    EXPECT_NEAR(length(turned.eye - scene.target), distance, 100 * DBL_EPSILON * distance);
    EXPECT_EQ(turned.target, scene.target);
    EXPECT_EQ(turned.eye, posed(scene, seed).eye);
    const auto [turned_heading, turned_height] = angles(turned.eye);
    EXPECT_LE(std::abs(turned_heading - heading), 30 * kDegree + 1e-12);
    EXPECT_LE(std::abs(turned_height - height), 5 * kDegree + 1e-12);
    widest = std::max(widest, std::abs(turned_heading - heading));
  }
  // Of eight even draws all lie below a third with a chance of 1.5e-4: these seeds do not.
  EXPECT_GT(widest, 10 * kDegree);
}

TEST(AccuracyCamera, ScaleAndDistanceAreKeptAtTheTarget) {
  const Scene& scene = find_scene("twolayer");
  const double distance = length(scene.eye - scene.target);
  for (const double factor : {0.6, 4.}) {
    const Scene moved = moved_back(scene, factor);
    const Lens lens = lens_of(moved);
    EXPECT_NEAR(length(moved.eye - moved.target), factor * distance, 1e-11);
    EXPECT_NEAR(lens.scale(factor * distance), lens_of(scene).scale(distance), 1e-11);
  }
  for (const double scale : {3., 5., 8., 12., 20., 40.}) {
    const Lens lens = lens_of(scaled(scene, scale));
    EXPECT_NEAR(lens.scale(distance), scale, 1e-12);
    EXPECT_EQ(lens.width * 3, lens.height * 4);
    EXPECT_LE(lens.width, 960);
    // The whole image shows as much of the scene as before, to the rounding of its sides.
    if (lens.width < 960) {
      EXPECT_NEAR(lens.width / lens.focal, 640 / scene.focal, 2 / lens.focal);
    }
  }
}

TEST(AccuracyLattice, HasTheMassOfTheSolid) {
  const Scene& scene = find_scene("sphere");
  const auto points = lattice(scene, 0, 5);
  // Lattice points in a ball: the count scatters by about the root of the surface's cells, 4 pi
  // 12^2 = 1810 of variance below one each; five times 43 is a bound that a shift of the surface
  // by s/8 would break.
  EXPECT_NEAR(static_cast<double>(points.size()), volume(scene), 5 * std::sqrt(1810.));
  for (const Vec3d& p : points) {
    EXPECT_LE(scene.distance(p), 0);
    for (const double step : {p.x - points[0].x, p.y - points[0].y, p.z - points[0].z})
      EXPECT_NEAR(step, std::round(step), 1e-12);
  }
  const auto deep = lattice(scene, 0.5, 5);
  for (const Vec3d& p : deep) EXPECT_LE(scene.distance(p), -0.5);
  const double thinner = 4. / 3 * std::numbers::pi * std::pow(11.5, 3);
  EXPECT_NEAR(static_cast<double>(deep.size()), thinner, 5 * std::sqrt(1810.));
  EXPECT_NE(lattice(scene, 0, 6)[0], points[0]) << "the seed moves the origin";
}

TEST(AccuracyJitter, MovesEachFrameAnewByItsStandardDeviation) {
  Particles still;
  constexpr int n = 50000;
  still.x.assign(n, 1);
  still.y.assign(n, -2);
  still.z.assign(n, 0.5);
  const Particles one = jittered(still, 0.01, 3, 1), two = jittered(still, 0.01, 3, 2);
  EXPECT_EQ(jittered(still, 0.01, 3, 1).x, one.x);
  EXPECT_EQ(jittered(still, 0, 3, 1).x, still.x);
  double square = 0, both = 0;
  for (int i = 0; i < n; ++i) {
    square += std::pow(one.x[i] - 1, 2) + std::pow(one.y[i] + 2, 2) + std::pow(one.z[i] - .5, 2);
    both += (one.x[i] - 1) * (two.x[i] - 1);
  }
  // Five standard deviations of the variance of 3n normal numbers, and of n products of two.
  EXPECT_NEAR(square / (3 * n), 1e-4, 5 * 1e-4 * std::sqrt(2 / (3. * n)));
  EXPECT_NEAR(both / n, 0, 5 * 1e-4 / std::sqrt(1. * n));
}

TEST(AccuracyJitter, FramesShareTheTruth) {
  const auto cases = make_cases({"sphere"}, {2}, {.scale = 3, .jitter = 0.01});
  ASSERT_EQ(cases.size(), 1);
  ASSERT_EQ(cases[0].truths.size(), 4);
  for (const Truth& truth : cases[0].truths) EXPECT_EQ(truth.depth, cases[0].truths[0].depth);
  EXPECT_EQ(cases[0].jitter, 0.01);
  const auto moving = make_cases({"sphere"}, {2}, {.scale = 3, .moving = true});
  EXPECT_NE(moving[0].truths[1].depth, moving[0].truths[0].depth);
}

}  // namespace
}  // namespace meniscus::accuracy
