// Which particles are splash, against plain loops over all pairs.
#include "stages/frame/splash.hpp"

#include <algorithm>

#include "stages/frame/cells.hpp"
#include "stages/other_methods/paper.hpp"
#include "stages/stage_test_support.hpp"

namespace meniscus {
namespace {

Projected scattered(std::size_t n, double side, unsigned seed) {
  Random random(seed);
  Projected p;
  for (std::size_t i = 0; i < n; ++i)
    add_position(p, {random(-side, side), random(-side, side), random(-side, side)});
  return p;
}

bool linked(const Projected& p, std::size_t a, std::size_t b, double link) {
  const float dx = p.x[a] - p.x[b], dy = p.y[a] - p.y[b], dz = p.z[a] - p.z[b];
  const float l = static_cast<float>(link);
  return dx * dx + dy * dy + dz * dz < l * l;
}

// Size of each particle's connected piece, by relaxing labels until nothing changes.
std::vector<std::size_t> piece_sizes(const Projected& p, double link) {
  std::vector<std::size_t> label(p.size()), size(p.size(), 0);
  for (std::size_t i = 0; i < p.size(); ++i) label[i] = i;
  for (bool changed = true; changed;) {
    changed = false;
    for (std::size_t a = 0; a < p.size(); ++a)
      for (std::size_t b = 0; b < p.size(); ++b)
        if (label[b] < label[a] && linked(p, a, b, link)) {
          label[a] = label[b];
          changed = true;
        }
  }
  for (std::size_t i = 0; i < p.size(); ++i)
    size[i] = static_cast<std::size_t>(std::count(label.begin(), label.end(), label[i]));
  return size;
}

SplashSplit split_of(const Projected& p, const SplashParams& params, float side = 4) {
  return split_splash(p, make_cells(p.x, p.y, p.z, side), params);
}

SplashSplit expected_split(const Projected& p, const SplashParams& params) {
  const auto size = piece_sizes(p, params.link);
  SplashSplit expected;
  for (std::size_t i = 0; i < p.size(); ++i)
    (size[i] <= static_cast<std::size_t>(params.pieces) ? expected.splash : expected.body)
        .push_back(static_cast<std::int32_t>(i));
  return expected;
}

TEST(SplitSplash, TakesTheSmallPieces) {
  for (const auto& [side, pieces] :
       {std::pair{14.0, 6}, {9.0, 6}, {20.0, 1}, {14.0, 0}, {17.0, 2}, {14.0, 40}}) {
    const Projected p = scattered(400, side, 3);
    SplashParams params;
    params.pieces = pieces;
    const SplashSplit expected = expected_split(p, params);
    for (const float cell : {4.0f, 9.0f, 3.2f, 2.0f}) {  // the last is too short to be used
      const SplashSplit split = split_of(p, params, cell);
      EXPECT_EQ(split.body, expected.body);
      EXPECT_EQ(split.splash, expected.splash);
    }
  }
}

TEST(SplitSplash, FindsTheSameInManyParticles) {
  // The same cloud over and over, far apart: more particles than a thread takes at a time.
  constexpr std::size_t kClouds = 20;
  const Projected cloud = scattered(400, 14, 3);
  const SplashSplit each = expected_split(cloud, {});
  Projected p;
  SplashSplit expected;
  for (std::size_t k = 0; k < kClouds; ++k) {
    for (std::size_t i = 0; i < cloud.size(); ++i)
      add_position(p, {cloud.x[i], cloud.y[i], cloud.z[i] + 64 * static_cast<float>(k)});
    const auto append = [&](const std::vector<std::int32_t>& from, std::vector<std::int32_t>& to) {
      for (const std::int32_t i : from)
        to.push_back(i + static_cast<std::int32_t>(k * cloud.size()));
    };
    append(each.body, expected.body);
    append(each.splash, expected.splash);
  }
  const SplashSplit split = split_of(p, {});
  EXPECT_FALSE(split.splash.empty());
  EXPECT_EQ(split.body, expected.body);
  EXPECT_EQ(split.splash, expected.splash);
}

TEST(SplitSplash, TheLinkItselfIsTooFar) {
  Projected p;
  p.x = {0, 3.2f, 20, 23.1f};
  p.y = p.z = {0, 0, 0, 0};
  SplashParams params;
  params.pieces = 1;
  const SplashSplit split = split_of(p, params);
  EXPECT_EQ(split.splash, (std::vector<std::int32_t>{0, 1}));
  EXPECT_EQ(split.body, (std::vector<std::int32_t>{2, 3}));
}

TEST(SplitSplash, NoParticles) {
  const SplashSplit split = split_of({}, {});
  EXPECT_TRUE(split.body.empty());
  EXPECT_TRUE(split.splash.empty());
}

TEST(SplitByNeighbours, TakesThoseWithFewerThanThree) {
  const Projected p = scattered(400, 11, 5);
  const SplashParams params;
  const SplashSplit split = split_by_neighbours(p, params);
  std::vector<std::int32_t> body, splash;
  for (std::size_t i = 0; i < p.size(); ++i) {
    int neighbours = 0;
    for (std::size_t j = 0; j < p.size(); ++j) neighbours += j != i && linked(p, i, j, params.link);
    (neighbours < 3 ? splash : body).push_back(static_cast<std::int32_t>(i));
  }
  EXPECT_GT(body.size(), 20u);
  EXPECT_GT(splash.size(), 20u);
  EXPECT_EQ(split.body, body);
  EXPECT_EQ(split.splash, splash);
}

TEST(Cells, AreNumberedByTheFloor) {
  Random random(8);
  for (int k = 0; k < 10000; ++k) {
    const float x = static_cast<float>(random(-1, 1) * std::pow(10, random(-3, 8)));
    EXPECT_EQ(cell_of(x, 0.25f), static_cast<std::int32_t>(std::floor(x * 0.25f))) << x;
  }
  EXPECT_EQ(cell_of(-0.0f, 1), 0);
  EXPECT_EQ(cell_of(-1e-30f, 1), -1);
  EXPECT_EQ(cell_of(-3, 1), -3);
  EXPECT_EQ(cell_of(1e30f, 1), 1000000000);
  EXPECT_EQ(cell_of(-1e30f, 1), -1000000000);
  EXPECT_EQ(cell_of(INFINITY, 1), 1000000000);
}

TEST(Cells, VisitsEveryPointWithinACellOnce) {
  const Projected p = scattered(300, 12, 7);
  const float cell = 3.5f;
  const Cells cells = make_cells(p.x, p.y, p.z, cell);
  for (std::size_t i = 0; i < p.size(); ++i) {
    std::vector<int> visits(p.size(), 0);
    visit_near(cells, p.x[i], p.y[i], p.z[i], [&](std::int32_t k) {
      const std::size_t j = static_cast<std::size_t>(cells.item[k]);
      EXPECT_EQ(cells.x[k], p.x[j]);
      ++visits[j];
      return true;
    });
    for (std::size_t j = 0; j < p.size(); ++j) {
      EXPECT_LE(visits[j], 1);
      if (linked(p, i, j, cell)) {
        EXPECT_EQ(visits[j], 1);
      }
    }
  }
}

}  // namespace
}  // namespace meniscus
