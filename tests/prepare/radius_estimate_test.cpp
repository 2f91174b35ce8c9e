// The estimated particle radius against particles whose spacing is known.
#include "prepare/radius_estimate.hpp"

#include <gtest/gtest.h>

#include <chrono>
#include <random>
#include <string>

#include "meniscus/source.hpp"
#include "prepare/canonical_order.hpp"
#include "prepare/choose_radius.hpp"
#include "stages/vec.hpp"

namespace meniscus {
namespace {

constexpr double kSpacing = 0.05;

// A lattice of a fluid that has been shaken: every particle up to a fifth of the spacing from its
// place, in a block of so many particles along each axis.
Particles shaken(int nx, int ny, int nz) {
  std::mt19937 random(7);
  std::uniform_real_distribution<double> shift(-0.2, 0.2);
  Particles p;
  for (int k = 0; k < nz; ++k)
    for (int j = 0; j < ny; ++j)
      for (int i = 0; i < nx; ++i)
        add_position(p, {kSpacing * (i + shift(random)), kSpacing * (j + shift(random)),
                         kSpacing * (k + shift(random))});
  return p;
}

RadiusEstimate estimate(const Particles& p) {
  Notices notices;
  return estimate_radius(p, canonical_order(p, {}, notices));
}

TEST(RadiusEstimate, OfABlockIsHalfTheSpacingToAFewPercent) {
  const RadiusEstimate found = estimate(shaken(20, 20, 20));
  EXPECT_NEAR(found.radius, kSpacing / 2, 0.03 * kSpacing / 2);
  EXPECT_LT(found.most, 1.1 * found.least);  // and says that it is sure
  EXPECT_TRUE(found.is_dense);
}

// A jet of four by four particles: wider spheres reach beyond it, and hold too few.
TEST(RadiusEstimate, OfAJetSaysThatItIsUnsure) {
  const RadiusEstimate found = estimate(shaken(4, 4, 400));
  EXPECT_NEAR(found.radius, kSpacing / 2, 0.1 * kSpacing / 2);
  EXPECT_GT(found.most, 1.1 * found.least);
  EXPECT_LE(found.least, found.radius);
  EXPECT_GE(found.most, found.radius);
}

// Rain has no spacing: half its particles would be nearer than any fluid's.
TEST(RadiusEstimate, OfRainTellsNoFluid) {
  std::mt19937 random(3);
  std::uniform_real_distribution<float> place(0, 1);
  Particles p;
  for (int k = 0; k < 4000; ++k) add_position(p, {place(random), place(random), place(random)});
  EXPECT_FALSE(estimate(p).is_dense);
}

// Particles that a solver has compressed, of radius .025.
TEST(RadiusEstimate, OfARealFrameIsAsNearAsItSays) {
  Notices notices;
  const double found =
      choose_radius(*open_particles(std::string(MENISCUS_TEST_DATA) +
                                    "/splashsurf/dam_break_frame_9_6859_particles.bgeo"),
                    {}, notices);
  ASSERT_EQ(notices.all().size(), 1u);
  const std::string words = "to within ", text = to_string(notices.all()[0]);
  ASSERT_NE(text.find(words), std::string::npos) << text;
  const double percent = std::stod(text.substr(text.find(words) + words.size()));
  EXPECT_NEAR(found, 0.025, percent / 100 * found);
}

// The estimate needs the particles around some, and no look at all others for each of them.
TEST(RadiusEstimate, OfMillionsInAnyOrderTakesNoLongerThanToSortThem) {
  constexpr std::size_t kMany = 2'000'000;
  std::mt19937 random(5);
  std::uniform_real_distribution<float> place(0, 1);
  Particles p;
  for (std::size_t k = 0; k < kMany; ++k)
    add_position(p, {place(random), place(random), place(random)});
  using Clock = std::chrono::steady_clock;
  Notices notices;
  const Clock::time_point start = Clock::now();
  const std::vector<std::size_t> order = canonical_order(p, {}, notices);
  const Clock::time_point sorted = Clock::now();
  EXPECT_GT(estimate_radius(p, order).radius, 0);
  // .2 s each; looking at all for each of 512 took a minute. Other work may take the processor.
  EXPECT_LT(Clock::now() - sorted, 10 * (sorted - start) + std::chrono::seconds(2));
}

TEST(RadiusEstimate, OfOnePlaceIsNone) {
  Particles p;
  p.x = p.y = p.z = std::vector<float>(5, 1.0f);
  EXPECT_EQ(estimate(p).radius, 0);
}

}  // namespace
}  // namespace meniscus
