// What one pass over the particles finds out.
#include "prepare/survey.hpp"

#include <gmock/gmock.h>

#include <algorithm>
#include <cmath>

#include "base/thread_team.hpp"
#include "meniscus/error.hpp"
#include "own_source.hpp"
#include "prepare/shared_source.hpp"
#include "stages/stage_test_support.hpp"
#include "thrown.hpp"

namespace meniscus {
namespace {

Particles random_particles(std::size_t n, bool radii) {
  Random random(3);
  Particles particles;
  for (std::size_t i = 0; i < n; ++i) {
    add_position(particles, {random(-3, 2), random(-1, -0.5), random(0, 7)});
    if (radii) particles.radius.push_back(static_cast<float>(std::exp(random(-9, 9))));
  }
  return particles;
}

TEST(Survey, FindsBoundsAndTheMiddleRadius) {
  for (const std::size_t n : {1, 2, 63, 1023, 1024, 1025, 5000}) {
    const Particles particles = random_particles(n, true);
    const Survey survey = survey_particles(*source_of(particles));
    EXPECT_EQ(survey.size, static_cast<std::int64_t>(n));
    EXPECT_EQ(survey.finite, static_cast<std::int64_t>(n));
    EXPECT_EQ(survey.first_bad, -1);
    const std::vector<float>* const axes[3] = {&particles.x, &particles.y, &particles.z};
    for (std::size_t a = 0; a < 3; ++a) {
      EXPECT_EQ(survey.low[a], *std::min_element(axes[a]->begin(), axes[a]->end()));
      EXPECT_EQ(survey.high[a], *std::max_element(axes[a]->begin(), axes[a]->end()));
    }
    std::vector<float> sorted = particles.radius;
    std::sort(sorted.begin(), sorted.end());
    EXPECT_EQ(survey.middle_radius, sorted[n / 2]);
    EXPECT_EQ(survey.least_radius, sorted.front());
    EXPECT_EQ(survey.largest_radius, sorted.back());
    EXPECT_EQ(survey.sample.size(), n);  // all of so few
  }
}

TEST(Survey, LeavesOutWhatIsNotFinite) {
  Particles particles = random_particles(3000, true);
  particles.x[1500] = NAN;
  particles.y[2100] = -INFINITY;
  particles.z[2999] = INFINITY;
  particles.x[2999] = 1e30f;
  const Survey survey = survey_particles(*source_of(particles));
  EXPECT_EQ(survey.finite, 2997);
  EXPECT_EQ(survey.first_bad, 1500);
  EXPECT_LE(survey.high[0], 2);
  EXPECT_TRUE(std::isfinite(survey.low[1]));
  std::vector<float> radii;
  for (std::size_t i = 0; i < 3000; ++i)
    if (i != 1500 && i != 2100 && i != 2999) radii.push_back(particles.radius[i]);
  std::nth_element(radii.begin(), radii.begin() + 2997 / 2, radii.end());
  EXPECT_EQ(survey.middle_radius, radii[2997 / 2]);
}

TEST(Survey, NothingHasNoBounds) {
  Particles particles;
  EXPECT_EQ(survey_particles(*source_of(particles)).finite, 0);
  particles.x = particles.y = particles.z = {NAN};
  EXPECT_EQ(survey_particles(*source_of(particles)).first_bad, 0);
}

TEST(Survey, TakesASampleThatDoesNotDependOnTheOrder) {
  const std::size_t n = 4 * kSample;
  Particles particles = random_particles(n, false);
  const auto sorted_sample = [&] {
    auto sample = survey_particles(*source_of(particles)).sample;
    std::sort(sample.begin(), sample.end());
    return sample;
  };
  const auto before = sorted_sample();
  // A quarter of n trials of chance 1/4: five deviations.
  EXPECT_NEAR(static_cast<double>(before.size()), kSample, 5 * std::sqrt(0.75 * kSample));
  for (std::vector<float>* axis : {&particles.x, &particles.y, &particles.z})
    std::reverse(axis->begin(), axis->end());
  EXPECT_EQ(before, sorted_sample());
}

TEST(Survey, RefusesRadiiThatAreNone) {
  for (const float radius : {0.0f, -1.0f, NAN, INFINITY}) {
    Particles particles = random_particles(100, true);
    particles.radius[42] = radius;
    EXPECT_THAT(text_of_thrown<InputError>([&] { survey_particles(*source_of(particles)); }),
                testing::HasSubstr("particle 42: radius is "));
  }
}

TEST(Survey, RefusesAStatedRadiusThatIsNone) {
  Particles particles = random_particles(100, false);
  for (const double radius : {-1.0, static_cast<double>(NAN), static_cast<double>(INFINITY)}) {
    particles.particle_radius = radius;
    EXPECT_THROW(survey_particles(*source_of(particles)), InputError) << radius;
  }
}

// It wrote before the beginning of its arrays.
TEST(Survey, RefusesASourceOfFewerParticlesThanNone) {
  struct Fewer : OwnSource {
    using OwnSource::OwnSource;
    std::int64_t size() const override { return -5; }
  };
  EXPECT_THROW(survey_particles(Fewer(random_particles(10, false))), InputError);
}

TEST(Survey, IsTheSameInAllRanks) {
  for (const bool radii : {false, true}) {
    Particles particles = random_particles(10000, radii);
    particles.x[8123] = NAN;
    particles.z[705] = INFINITY;
    Survey expected = survey_particles(*source_of(particles));
    std::sort(expected.sample.begin(), expected.sample.end());
    EXPECT_EQ(expected.first_bad, 705);
    for (const int ranks : {2, 3, 4}) {
      const TeamOutcome outcome = as_team(ranks, [&](Team& team) {
        Survey found = survey_particles(SharedSource(particles, team));
        std::sort(found.sample.begin(), found.sample.end());
        EXPECT_EQ(found.size, expected.size);
        EXPECT_EQ(found.finite, expected.finite);
        EXPECT_EQ(found.first_bad, expected.first_bad);
        EXPECT_EQ(found.low, expected.low);
        EXPECT_EQ(found.high, expected.high);
        EXPECT_EQ(found.middle_radius, expected.middle_radius);
        EXPECT_EQ(found.least_radius, expected.least_radius);
        EXPECT_EQ(found.largest_radius, expected.largest_radius);
        EXPECT_EQ(found.sample, expected.sample);
      });
      EXPECT_THAT(outcome.errors, testing::Each(testing::IsEmpty()));
    }
  }
}

TEST(Survey, NamesTheFirstBadRadiusOfAllRanks) {
  Particles particles = random_particles(10000, true);
  for (const std::size_t bad : {9000u, 1500u, 701u}) {  // of ranks 0, 2, 1
    particles.radius[bad] = -2;
    const TeamOutcome outcome =
        as_team(3, [&](Team& team) { survey_particles(SharedSource(particles, team)); });
    EXPECT_THAT(outcome.errors, testing::Each("particle " + std::to_string(bad) +
                                              ": radius is -2, must be > 0 and finite (give "
                                              "particle_radius to override)"));
  }
}

TEST(Chunks, HoldAllParticlesInOrder) {
  const Particles particles = random_particles(1000, true);
  const auto source = source_of(particles);
  for (const std::size_t size : {1, 63, 64, 999, 1000, 5000}) {
    Particles seen;
    for_each_chunk(*source, size, {.radius = true}, [&](const ParticleChunk& chunk) {
      EXPECT_EQ(chunk.first, static_cast<std::int64_t>(seen.size()));
      EXPECT_EQ(chunk.stride() % 64, 0u);
      EXPECT_LE(chunk.count, size);
      const auto add = [&](const std::vector<float>& from, std::vector<float>& to) {
        to.insert(to.end(), from.begin(), from.begin() + static_cast<std::ptrdiff_t>(chunk.count));
      };
      add(chunk.x, seen.x);
      add(chunk.y, seen.y);
      add(chunk.z, seen.z);
      add(chunk.radius, seen.radius);
    });
    EXPECT_EQ(seen.x, particles.x);
    EXPECT_EQ(seen.y, particles.y);
    EXPECT_EQ(seen.z, particles.z);
    EXPECT_EQ(seen.radius, particles.radius);
  }
}

TEST(Chunks, CanBeKeptForOthers) {
  const Particles particles = random_particles(1000, true);
  for (const std::size_t size : {63, 400, 1000}) {
    Particles seen;
    const auto see = [&](const ParticleChunk& chunk) {
      EXPECT_EQ(chunk.first, chunk.count == 0 ? 0 : static_cast<std::int64_t>(seen.x.size()));
      const auto end = static_cast<std::ptrdiff_t>(chunk.count);
      seen.x.insert(seen.x.end(), chunk.x.begin(), chunk.x.begin() + end);
      seen.radius.insert(seen.radius.end(), chunk.radius.begin(), chunk.radius.begin() + end);
    };
    ParticleChunk before;
    for_each_chunk(*source_of(particles), size, {.radius = true}, [&](ParticleChunk& chunk) {
      see(before);
      std::swap(chunk, before);
    });
    see(before);
    EXPECT_EQ(seen.x, particles.x);
    EXPECT_EQ(seen.radius, particles.radius);
  }
}

TEST(Chunks, HoldOnlyWhatIsAskedForAndThere) {
  Particles particles = random_particles(100, true);
  particles.vx = particles.y;
  particles.vy = particles.z;
  particles.vz = particles.x;
  const auto look = [](const Particles& at, const ChunkValues& also, bool radius, bool velocity) {
    for_each_chunk(*source_of(at), 100, also, [&](const ParticleChunk& chunk) {
      EXPECT_EQ(chunk.radius.size(), radius ? chunk.stride() : 0);
      for (const std::vector<float>* v : {&chunk.vx, &chunk.vy, &chunk.vz})
        EXPECT_EQ(v->size(), velocity ? chunk.stride() : 0);
      if (velocity) {
        EXPECT_TRUE(std::equal(at.vx.begin(), at.vx.end(), chunk.vx.begin()));
        EXPECT_TRUE(std::equal(at.vy.begin(), at.vy.end(), chunk.vy.begin()));
        EXPECT_TRUE(std::equal(at.vz.begin(), at.vz.end(), chunk.vz.begin()));
      }
    });
  };
  look(particles, {}, false, false);
  look(particles, {.velocity = true}, false, true);
  look(particles, {.radius = true, .velocity = true}, true, true);
  look(random_particles(100, true), {.radius = true, .velocity = true}, true, false);
}

}  // namespace
}  // namespace meniscus
