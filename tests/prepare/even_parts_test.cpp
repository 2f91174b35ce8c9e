// Frames that are evened out in parts have the bits of those that are evened out at once.
#include "prepare/even_parts.hpp"

#include <gmock/gmock.h>

#include <cmath>
#include <cstddef>
#include <random>
#include <vector>

#include "base/thread_team.hpp"
#include "device/stage_clock.hpp"
#include "meniscus/device.hpp"
#include "prepare/canonical_order.hpp"
#include "prepare/crowds.hpp"
#include "prepare/shared_source.hpp"
#include "stages/vec.hpp"

namespace meniscus {
namespace {

constexpr double kBlock = 4;  // particle radii, of cells of one

// A long bar of irregular particles, which are not in order, with a crowd, copies and one that has
// no place.
Particles long_bar() {
  std::mt19937 random(5);
  std::normal_distribution<float> off(0, 0.58f);
  Particles particles;
  particles.particle_radius = 1;
  const auto add = [&](float x, float y, float z) { add_position(particles, {x, y, z}); };
  for (int k = 0; k < 6; ++k)
    for (int i = 0; i < 600; ++i)
      for (int j = 0; j < 6; ++j)
        add(2.0f * i + off(random), 2.0f * j + off(random), 2.0f * k + off(random));
  for (int k = 0; k < 40; ++k) add(700.1f + 0.01f * k, 5.1f, 5.1f);
  for (int k = 0; k < 3; ++k) add(300, 6, 6);
  particles.y[77] = std::nanf("");
  return particles;
}

// Where all of a frame's particles go that are evened out at once.
EvenedPlaces even_at_once(const Particles& particles, const PartedFrame& frame,
                          const Disorder& disorder) {
  Notices notices;
  const std::vector<std::size_t> order =
      without_crowds(particles, canonical_order(particles, {}, notices), frame.radius, notices);
  Projected placed = place_particles(coarser(frame.view, disorder.unit()),
                                     particles_in_order(particles, order, frame.radius, false));
  even_out(placed, disorder);
  const std::vector<float> none(particles.size(), std::nanf(""));
  EvenedPlaces places{disorder.unit(), none, none, none};
  for (std::size_t k = 0; k < order.size(); ++k) {
    places.x[order[k]] = placed.x[k];
    places.y[order[k]] = placed.y[k];
    places.z[order[k]] = placed.z[k];
  }
  return places;
}

void expect_same(const std::vector<float>& made, const std::vector<float>& expected) {
  ASSERT_EQ(made.size(), expected.size());
  for (std::size_t i = 0; i < made.size(); ++i)
    ASSERT_TRUE(made[i] == expected[i] || (std::isnan(made[i]) && std::isnan(expected[i]))) << i;
}

void expect_bits_of_all(const Disorder& disorder) {
  const Particles particles = long_bar();
  const auto share_of = [&](Team& team, const ParticleSource& source) {
    Device device;
    StageClock clock(device, nullptr);
    Notices notices;
    const Camera none;
    const Parameters params;
    const Filling filling{device, none, params, std::size_t{1} << 20, clock, notices};
    const PartedFrame frame = survey_parts(filling, source, kBlock);
    std::vector<PartTally> tallies;
    const EvenedPlaces places =
        even_out_in_parts(filling, source, frame, disorder, kBlock, tallies);
    EXPECT_GE(static_cast<int>(tallies.size()) * team.size(), 4);
    std::int64_t had = 0, copies = 0, dropped = 0;
    for (const PartTally& tally : team.joined(tallies)) {
      had += tally.had;
      copies += tally.copies;
      dropped += tally.dropped;
    }
    EXPECT_EQ(had, static_cast<std::int64_t>(particles.size()) - 1);
    EXPECT_EQ(copies, 2);
    EXPECT_GT(dropped, 20);
    const EvenedPlaces expected = even_at_once(particles, frame, disorder);
    const auto share = [&](const std::vector<float>& all) {
      std::vector<float> own;
      for (const ParticleRange& range : source.share())
        own.insert(own.end(), all.begin() + range.first, all.begin() + range.first + range.count);
      return own;
    };
    EXPECT_EQ(places.unit, disorder.unit());
    expect_same(places.x, share(expected.x));
    expect_same(places.y, share(expected.y));
    expect_same(places.z, share(expected.z));
  };
  share_of(alone(), *source_of(particles));
  for (const int ranks : {2, 3}) {
    const TeamOutcome outcome =
        as_team(ranks, [&](Team& team) { share_of(team, SharedSource(particles, team)); });
    EXPECT_THAT(outcome.errors, testing::Each(testing::IsEmpty()));
  }
}

TEST(EvenParts, HaveTheBitsOfTheWhole) { expect_bits_of_all({.amount = 1}); }

TEST(EvenParts, HaveTheBitsOfTheWholeInALongerUnit) {
  expect_bits_of_all({.amount = 1.7, .spacing = 2.2});
}

}  // namespace
}  // namespace meniscus
