// The order that depends on the set of particles alone.
#include "prepare/canonical_order.hpp"

#include <gmock/gmock.h>

#include <algorithm>
#include <limits>
#include <random>

#include "meniscus/error.hpp"
#include "stages/vec.hpp"
#include "texts.hpp"

namespace meniscus {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;

Particles particles_at(const std::vector<std::array<float, 3>>& points) {
  Particles p;
  for (const auto& [x, y, z] : points) add_position(p, {x, y, z});
  return p;
}

TEST(CanonicalOrder, IsByXThenYThenZ) {
  Notices notices;
  const float big = std::numeric_limits<float>::max(), tiny = 1e-42f;  // a denormal
  const Particles p = particles_at({{2, 0, 0},
                                    {-1, 5, 1},
                                    {-1, 5, 0},
                                    {-1, -5, 9},
                                    {big, 0, 0},
                                    {-big, 0, 0},
                                    {tiny, 0, 0},
                                    {-tiny, 0, 0},
                                    {0, 0, 0}});
  EXPECT_THAT(canonical_order(p, {}, notices), ElementsAre(5, 3, 2, 1, 7, 8, 6, 0, 4));
  EXPECT_TRUE(notices.all().empty());
}

TEST(CanonicalOrder, BothZerosAreOneValue) {
  Notices notices;
  EXPECT_THAT(canonical_order(particles_at({{0, 2, 0}, {-0.0f, 1, 0}, {0, 0, 0}}), {}, notices),
              ElementsAre(2, 1, 0));
  EXPECT_THAT(canonical_order(particles_at({{-0.0f, 2, 0}, {0, 1, 0}, {-0.0f, 0, 0}}), {}, notices),
              ElementsAre(2, 1, 0));
}

TEST(CanonicalOrder, TellsOfParticlesAtOnePosition) {
  Notices notices;
  canonical_order(particles_at({{1, 1, 1}, {1, 1, 2}, {1, 2, 1}, {2, 1, 1}}), {}, notices);
  EXPECT_TRUE(notices.all().empty());
  canonical_order(
      particles_at({{1, 1, 2}, {0, 1, 1}, {1, 1, 1}, {1, 1, 2}, {-0.0f, 1, 1}, {1, 1, 2}}), {},
      notices);
  EXPECT_THAT(texts(notices.all()),
              ElementsAre(HasSubstr("of 6 particles 3 lie exactly where another")));
}

TEST(CanonicalOrder, RadiiDecideAtOnePlace) {
  Notices notices;
  Particles p = particles_at({{1, 1, 1}, {1, 1, 1}, {1, 1, 1}});
  p.radius = {3, 1, 2};
  EXPECT_THAT(canonical_order(p, {}, notices), ElementsAre(1, 2, 0));
}

TEST(CanonicalOrder, VelocitiesDecideBetweenOneRadius) {
  Notices notices;
  Particles p = particles_at({{1, 1, 1}, {1, 1, 1}, {1, 1, 1}, {1, 1, 1}});
  p.radius = {2, 2, 2, 1};
  p.vx = {-1, -1, -2, 9};
  p.vy = {5, -5, 0, 0};
  p.vz = {0, 0, 0, NAN};
  EXPECT_THAT(canonical_order(p, {}, notices), ElementsAre(3, 2, 1, 0));
  p.vx = {1, NAN, 0, 0};
  EXPECT_THAT(canonical_order(p, {}, notices), ElementsAre(3, 2, 0, 1));
}

// Few values, so that many agree in x, in x and y, and in all three.
TEST(CanonicalOrder, GivesTheSameSequenceForEveryOrderOfInput) {
  std::mt19937 random(5);
  std::vector<std::array<float, 3>> points;
  for (int k = 0; k < 3000; ++k) {
    std::array<float, 3> point;
    for (float& c : point) c = static_cast<float>(static_cast<int>(random() % 17) - 8) / 3;
    points.push_back(point);
  }
  auto wanted = points;
  std::sort(wanted.begin(), wanted.end());
  for (int round = 0; round < 3; ++round) {
    std::shuffle(points.begin(), points.end(), random);
    Notices notices;
    std::vector<std::array<float, 3>> sorted;
    for (const std::size_t i : canonical_order(particles_at(points), {}, notices))
      sorted.push_back(points[i]);
    EXPECT_EQ(sorted, wanted);
  }
}

// Ranges of x of which the leading bits tell all, some and next to nothing.
TEST(CanonicalOrder, IsByAllOfXHoweverFarItReaches) {
  std::mt19937 random(6);
  for (const double reach : {1e-6, 1.0, 1e30}) {
    std::vector<std::array<float, 3>> points;
    for (int k = 0; k < 3000; ++k) {
      const double x = std::uniform_real_distribution(-0.5, 1.0)(random);
      const double at = k % 3 == 0 ? 4 + 1e-6 * x : 4 + reach * x;
      points.push_back({static_cast<float>(at), static_cast<float>(random() % 5), 0});
    }
    auto wanted = points;
    std::sort(wanted.begin(), wanted.end());
    Notices notices;
    std::vector<std::array<float, 3>> sorted;
    for (const std::size_t i : canonical_order(particles_at(points), {}, notices))
      sorted.push_back(points[i]);
    EXPECT_EQ(sorted, wanted) << reach;
  }
}

TEST(CanonicalOrder, DropsWhatIsNotFiniteAndSaysSo) {
  const float nan = std::numeric_limits<float>::quiet_NaN();
  const float inf = std::numeric_limits<float>::infinity();
  const Particles p = particles_at({{1, 0, 0}, {0, nan, 0}, {0, 0, 0}, {0, 0, -inf}, {nan, 0, 0}});
  Notices notices;
  EXPECT_THAT(canonical_order(p, {}, notices), ElementsAre(2, 0));
  ASSERT_EQ(notices.all().size(), 1u);
  EXPECT_THAT(texts(notices.all())[0], HasSubstr("3 of 5 particles"));
  EXPECT_THAT(texts(notices.all())[0], HasSubstr("particle 1)"));
  Parameters strict;
  strict.strict = true;
  EXPECT_THROW(canonical_order(p, strict, notices), InputError);
}

}  // namespace
}  // namespace meniscus
