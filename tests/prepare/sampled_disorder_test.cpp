// The disorder of frames that stream is that of the whole frame, however they stream.
#include "prepare/sampled_disorder.hpp"

#include <gmock/gmock.h>

#include <algorithm>
#include <cmath>
#include <numeric>
#include <random>

#include "base/thread_team.hpp"
#include "prepare/fill.hpp"
#include "prepare/shared_source.hpp"
#include "stages/stage_test_support.hpp"

namespace meniscus {
namespace {

constexpr float kRadius = 0.02f;

const View& world_view() {
  static const View view = make_world_view(kRadius, {1, 1, 1});
  return view;
}

// Cubes of a lattice with a wavy upper side, each with one particle that lies off its middle by a
// Gaussian of so many spacings in each coordinate.
Particles noisy_waves(double sigma) {
  std::mt19937 random(7);
  std::normal_distribution<double> noise(0, sigma);
  const auto off = [&] { return sigma > 0 ? noise(random) : 0; };
  Particles particles;
  for (int i = 0; i < 50; ++i)
    for (int j = 0; j < 40; ++j)
      for (int k = 0; k < 30 + 10 * std::sin(0.3 * i); ++k)
        add_position(particles, {2 * kRadius * (i + off()), 2 * kRadius * (j + off()),
                                 2 * kRadius * (k + off())});
  return particles;
}

Particles particles_anywhere() {
  Random random(5);
  Particles particles;
  for (int k = 0; k < 60000; ++k)
    add_position(particles,
                 {random(0, 80 * kRadius), random(0, 80 * kRadius), random(0, 75 * kRadius)});
  return particles;
}

// Of all particles: more of them than a whole frame's own disorder asks.
Disorder disorder_of_all(const Particles& particles) {
  Notices notices;
  std::vector<std::size_t> order(particles.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  const WorldParticles world = particles_in_order(particles, order, kRadius, false);
  const Projected placed = place_particles(world_view(), world);
  std::vector<std::int32_t> all(placed.size());
  std::iota(all.begin(), all.end(), 0);
  const ParticleOrder measured =
      measure_order(placed, all, make_cells(placed.x, placed.y, placed.z, kRelaxReach));
  return {disorder_of(measured), measured.spacing};
}

Disorder sampled(const Particles& particles) {
  return find_disorder(*source_of(particles), world_view(), {});
}

TEST(SampledDisorder, OfOrderlyParticlesIsNone) {
  for (const double sigma : {0.0, 0.05}) {
    const Particles particles = noisy_waves(sigma);
    EXPECT_EQ(disorder_of_all(particles).amount, 0);
    EXPECT_EQ(sampled(particles).amount, 0) << sigma;
  }
}

// Of half of 4,096 particles a variation is told to within 1 / sqrt(2 * 2048) = .016 of it (one
// standard deviation), where the amount grows by 5 and 9 of it; four of these.
TEST(SampledDisorder, IsNearThatOfAllParticles) {
  for (const double sigma : {0.2, 0.25, 0.3}) {
    const Particles particles = noisy_waves(sigma);
    const Disorder all = disorder_of_all(particles), some = sampled(particles);
    EXPECT_GT(all.amount, 0.4);
    EXPECT_NEAR(some.amount, all.amount, 4 * 0.016 * 9 * 0.18) << sigma;
    // Of 33 others on average, one more or fewer of a hundred.
    EXPECT_NEAR(some.spacing, all.spacing, 0.01) << sigma;
  }
  EXPECT_EQ(sampled(particles_anywhere()).amount, 2);
  EXPECT_EQ(disorder_of_all(particles_anywhere()).amount, 2);
}

TEST(SampledDisorder, OfSlightlyIrregularParticlesCountsAsNone) {
  const Particles particles = noisy_waves(0.12);
  const double amount = disorder_of_all(particles).amount;
  EXPECT_GT(amount, 0.1);
  EXPECT_LT(amount, 0.3);
  EXPECT_EQ(sampled(particles), Disorder{});
}

TEST(SampledDisorder, DoesNotDependOnTheOrder) {
  Particles particles = noisy_waves(0.25);
  const Disorder expected = sampled(particles);
  for (std::vector<float>* const values : {&particles.x, &particles.y, &particles.z})
    std::shuffle(values->begin(), values->end(), std::mt19937(3));
  EXPECT_EQ(sampled(particles), expected);
}

TEST(SampledDisorder, IsTheSameInEveryProcessOfATeam) {
  const Particles particles = noisy_waves(0.25);
  const Disorder expected = sampled(particles);
  for (const int ranks : {2, 3}) {
    const TeamOutcome outcome = as_team(ranks, [&](Team& team) {
      EXPECT_EQ(find_disorder(SharedSource(particles, team), world_view(), {}), expected);
    });
    EXPECT_THAT(outcome.errors, testing::Each(testing::IsEmpty()));
  }
}

// Particles that crowd are dropped before all else.
TEST(SampledDisorder, IsThatOfParticlesWithoutCrowds) {
  Particles particles = noisy_waves(0.05);
  const std::size_t n = particles.size();
  for (std::size_t i = 0; i < n; i += 50)
    for (int copy = 0; copy < 40; ++copy)
      add_position(particles, {particles.x[i], particles.y[i], particles.z[i]});
  EXPECT_EQ(sampled(particles).amount, 0);
}

TEST(SampledDisorder, IsTheOneThatIsGiven) {
  Parameters params;
  params.disorder = 0.7;
  const Particles particles = particles_anywhere();
  const auto source = source_of(particles);
  EXPECT_EQ(find_disorder(*source, world_view(), params), Disorder{.amount = 0.7});
  params.disorder = 0;
  EXPECT_EQ(find_disorder(*source, world_view(), params), Disorder{});
}

}  // namespace
}  // namespace meniscus
