// What is left of particles that crowd, and what is said of them.
#include "prepare/crowds.hpp"

#include <gmock/gmock.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <numeric>
#include <random>
#include <set>

#include "stages/vec.hpp"
#include "texts.hpp"

namespace meniscus {
namespace {

using testing::ElementsAre;
using testing::IsEmpty;

using Point = std::array<float, 3>;

class Crowds : public testing::Test {
 protected:
  static constexpr double kRadius = 0.5;  // cubes have side 1

  float between(double least, double most) {
    return static_cast<float>(std::uniform_real_distribution(least, most)(random_));
  }

  /// Points of a cube `side` wide with a corner at (at, 0, 0).
  void add_crowd(int count, double at, double side) {
    for (int k = 0; k < count; ++k)
      add({between(at, at + side), between(0, side), between(0, side)});
  }

  /// A block of fluid, particles `spacing` apart.
  void add_block(int side, double spacing) {
    for (int k = 0; k < side * side * side; ++k) {
      const auto along = [&](int number) {
        return static_cast<float>(spacing * (number % side)) + between(-.2, .2) * float(spacing);
      };
      add({along(k) - 100, along(k / side), along(k / side / side)});
    }
  }

  void add(const Point& point) { points_.push_back(point); }

  /// The points that are left, of points in canonical order.
  std::vector<Point> left() {
    std::vector<std::size_t> order;
    for (std::size_t i = 0; i < points_.size(); ++i)
      if (std::isfinite(points_[i][0])) order.push_back(i);
    std::sort(order.begin(), order.end(),
              [&](std::size_t a, std::size_t b) { return points_[a] < points_[b]; });
    Particles p;
    for (const auto& [x, y, z] : points_) add_position(p, {x, y, z});
    notices_ = {};
    std::vector<Point> points;
    for (const std::size_t i : without_crowds(p, order, kRadius, notices_))
      points.push_back(points_[i]);
    return points;
  }

  std::mt19937 random_{3};
  std::vector<Point> points_;
  Notices notices_;
};

TEST_F(Crowds, LeaveFluidAlone) {
  add_block(12, 1);
  add_crowd(16, 5, 1);
  for (int k = 0; k < 15; ++k) add({9.5f, 9.5f, 9.5f});
  for (int k = 1; k <= 50; ++k)
    add({1e30f, -1e20f * static_cast<float>(k), 1e25f});  // an explosion
  std::vector<Point> all = points_;
  std::sort(all.begin(), all.end());
  EXPECT_EQ(left(), all);
  EXPECT_THAT(texts(notices_.all()), IsEmpty());
}

// However long the rows of cubes are, and however large the table of counts, 2^12 to 2^17 here.
TEST_F(Crowds, LeaveFluidOfAnySizeAlone) {
  for (const int count : {2000, 4000, 8000, 16000, 32000, 64000})
    for (const int wide : {8, 12, 16, 24, 32}) {
      points_.clear();
      const int long_side = count / wide / wide;
      for (int k = 0; k < long_side * wide * wide; ++k) {
        const auto along = [&](int number) {
          return 0.97f * static_cast<float>(number) + between(-.2, .2);
        };
        add({along(k % long_side), along(k / long_side % wide), along(k / long_side / wide)});
      }
      EXPECT_EQ(left().size(), points_.size()) << count << ", " << wide << " wide";
      EXPECT_THAT(texts(notices_.all()), IsEmpty()) << count << ", " << wide << " wide";
    }
}

TEST_F(Crowds, OfOnePositionAreOneParticle) {
  for (int k = 0; k < 5000; ++k) add({k % 2 ? 0.0f : -0.0f, 0.25f, 0.75f});
  add({0.5f, 0.5f, 0.5f});
  EXPECT_THAT(left(), ElementsAre(Point{0, 0.25f, 0.75f}, Point{0.5f, 0.5f, 0.5f}));
  EXPECT_THAT(texts(notices_.all()),
              ElementsAre("up to 5001 particles crowd into a cube of one particle "
                          "spacing, 1: 4999 of 5001 were dropped"));
}

// The last at one position in canonical order: the largest.
TEST_F(Crowds, KeepTheLastOfAPosition) {
  Particles p;
  p.x = p.y = p.z = std::vector<float>(20, 0.5f);
  std::vector<std::size_t> order(20);
  std::iota(order.rbegin(), order.rend(), 0);
  EXPECT_THAT(without_crowds(p, order, kRadius, notices_), ElementsAre(0));
}

TEST_F(Crowds, LeaveFourOfACube) {
  add_block(12, 1);
  const std::vector<Point> block = points_;
  add_crowd(17, 5, 1);
  add_crowd(3000, 10, 2);  // in eight cubes
  const std::vector<Point> some = left();
  EXPECT_EQ(some.size(), block.size() + 9 * 4);
  EXPECT_TRUE(std::is_sorted(some.begin(), some.end()));
  const std::set<Point> all(points_.begin(), points_.end()), kept(some.begin(), some.end());
  EXPECT_EQ(kept.size(), some.size());
  EXPECT_TRUE(std::includes(all.begin(), all.end(), kept.begin(), kept.end()));
  for (const Point& point : block) EXPECT_TRUE(kept.count(point));
  ASSERT_EQ(notices_.all().size(), 1u);
  EXPECT_THAT(texts(notices_.all())[0], testing::HasSubstr(": 2981 of 4745 were dropped"));
  for (int round = 0; round < 3; ++round) {
    std::shuffle(points_.begin(), points_.end(), random_);
    EXPECT_EQ(left(), some);
  }
}

TEST_F(Crowds, TellThatTheRadiusIsWrong) {
  add_block(16, 0.5);
  EXPECT_EQ(left().size(), points_.size());
  EXPECT_THAT(texts(notices_.all()),
              ElementsAre(testing::ContainsRegex(
                  "^a particle radius of 0.5 means a spacing of 1, but the particles lie about "
                  "0.[45][0-9]* apart: 0.2[45][0-9]* would fit \\(check particle_radius\\)$")));
  points_.clear();
  add_block(20, 0.2);
  EXPECT_LT(left().size(), 1000u);
  EXPECT_THAT(texts(notices_.all()),
              ElementsAre(testing::ContainsRegex("lie about 0.(19[0-9]|2) apart"),
                          testing::ContainsRegex("crowd into .* of 8000 were dropped$")));
}

TEST_F(Crowds, TellHowWrongTheRadiusIs) {
  add_block(16, 0.025);
  left();
  EXPECT_THAT(texts(notices_.all()),
              testing::Contains(testing::ContainsRegex("about 0.02[45][0-9]* apart")));
  for (Point& point : points_)
    for (float& x : point) x /= 100;
  left();
  EXPECT_THAT(texts(notices_.all()),
              testing::Contains(testing::ContainsRegex("about 0.0002[45][0-9]* apart")));
}

TEST_F(Crowds, TellThatTheRadiusIsTooSmall) {
  for (const double spacing : {2.0, 6.0, 8.0, 30.0, 1e3, 1e5}) {
    points_.clear();
    add_block(16, spacing);
    EXPECT_EQ(left().size(), points_.size());
    ASSERT_EQ(notices_.all().size(), 1u) << spacing;
    EXPECT_THAT(texts(notices_.all())[0], testing::HasSubstr("means a spacing of 1, but"));
    EXPECT_EQ(notices_.all()[0].code, Code::radius_too_small);
    EXPECT_NEAR(notices_.all()[0].wanted, spacing / 2, 0.05 * spacing);
  }
}

// Of an exact lattice in another unit cubes share buckets, which then look full.
TEST_F(Crowds, TellThatTheRadiusIsTooSmallForALattice) {
  for (const float spacing : {1000.0f, 1024.0f, 2000.0f}) {
    points_.clear();
    for (int k = 0; k < 1000; ++k)
      add({spacing * static_cast<float>(k % 10), spacing * static_cast<float>(k / 10 % 10),
           spacing * static_cast<float>(k / 100)});
    EXPECT_EQ(left().size(), points_.size());
    ASSERT_EQ(notices_.all().size(), 1u) << spacing;
    EXPECT_EQ(notices_.all()[0].code, Code::radius_too_small) << texts(notices_.all())[0];
    EXPECT_NEAR(notices_.all()[0].wanted, spacing / 2, 0.05 * spacing);
  }
}

TEST_F(Crowds, OfRainTellNothingOfTheRadius) {
  for (const double wide : {40.0, 100.0, 1000.0, 1e5}) {
    points_.clear();
    for (int k = 0; k < 4000; ++k) add({between(0, wide), between(0, wide), between(0, wide)});
    left();
    EXPECT_THAT(texts(notices_.all()), IsEmpty()) << wide;
  }
}

// A radius up to twice too large: what it says depends neither on particles without a place nor on
// a crowd elsewhere.
TEST_F(Crowds, LeaveWhatIsSaidOfTheRadius) {
  std::set<std::size_t> said;
  for (const double spacing : {0.5, 0.55, 0.6, 0.65, 0.7, 0.8}) {
    const auto telling = [&] {
      left();
      return std::count_if(notices_.all().begin(), notices_.all().end(), [](const Notice& notice) {
        return notice.code == Code::radius_too_small || notice.code == Code::radius_too_large;
      });
    };
    points_.clear();
    add_block(12, spacing);
    const auto alone = telling();
    add_crowd(17, 50, 0.1);
    EXPECT_EQ(telling(), alone) << spacing;
    points_.resize(points_.size() - 17);
    for (int k = 0; k < 20; ++k) points_.push_back({NAN, 0, 0});
    EXPECT_EQ(telling(), alone) << spacing;
    said.insert(static_cast<std::size_t>(alone));
  }
  EXPECT_EQ(said.size(), 2u);
}

// A drop of an emitter's first frame.
TEST_F(Crowds, OfFewTellNothingOfTheRadius) {
  add_crowd(12, 0, 1);
  left();
  EXPECT_THAT(texts(notices_.all()), IsEmpty());
}

TEST_F(Crowds, HaveNothingToSayOfNothing) {
  EXPECT_THAT(left(), IsEmpty());
  EXPECT_THAT(texts(notices_.all()), IsEmpty());
}

}  // namespace
}  // namespace meniscus
