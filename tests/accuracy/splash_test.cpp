// Drops that are there, missing, doubled and broken.
#include "accuracy/figures/splash.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>

#include "accuracy/synthetic.hpp"

namespace meniscus::accuracy {
namespace {

struct Disc {
  int x, y, radius;  // pixels
  bool holds(int i, int j) const { return std::hypot(i - x, j - y) <= radius; }
};

constexpr std::array<Disc, 4> kDrops{{{30, 30, 8}, {90, 40, 8}, {50, 110, 12}, {120, 150, 8}}};

Truth drops() {
  Truth truth = wall(
      [](int x, int y) {
        return std::any_of(kDrops.begin(), kDrops.end(),
                           [&](const Disc& drop) { return drop.holds(x, y); });
      },
      PixelClass::splash);
  for (int y = 0; y < kHeight; ++y)
    for (int x = 0; x < kWidth; ++x)
      for (std::size_t k = 0; k < kDrops.size(); ++k)
        if (kDrops[k].holds(x, y)) truth.piece[pixel(x, y)] = static_cast<int>(k);
  truth.splash_pieces = kDrops.size();
  return truth;
}

void paint(Map& map, const Disc& disc, double depth) {
  for (int y = 0; y < kHeight; ++y)
    for (int x = 0; x < kWidth; ++x)
      if (disc.holds(x, y)) map.depth[pixel(x, y)] = static_cast<float>(depth);
}

/// Percent, pieces, pieces, percent.
void expect(const Splash& splash, double covered, double missing, double doubled, double closed) {
  EXPECT_EQ(splash.covered, covered);
  EXPECT_EQ(splash.missing, missing);
  EXPECT_EQ(splash.doubled, doubled);
  EXPECT_EQ(splash.closed, closed);
}

TEST(Splash, PerfectMapHasEveryPieceOnce) {
  expect(splash_figures(drops(), map_of(drops())), 100, 0, 0, 100);
}

TEST(Splash, PieceThatIsNotThereIsMissing) {
  Map map = map_of(drops());
  paint(map, kDrops[0], kNothing);
  expect(splash_figures(drops(), map), 75, 1, 0, 75);
  paint(map, kDrops[1], kWall + 2);  // at the wrong depth
  expect(splash_figures(drops(), map), 50, 2, 0, 50);
}

TEST(Splash, PieceBesideTheRightOneIsDoubled) {
  Map map = map_of(drops());
  paint(map, {30 + 16, 30, 5}, kWall);  // a gap of 2 pixels between the two
  expect(splash_figures(drops(), map), 100, 0, 1, 100);
}

TEST(Splash, PieceInFrontOfTheRightOneIsDoubled) {
  Map map = map_of(drops());
  paint(map, {50, 110, 4}, kWall - 3);
  expect(splash_figures(drops(), map), 100, 0, 1, 75);
}

TEST(Splash, PieceFarFromAllIsNoneOfThem) {
  Map map = map_of(drops());
  paint(map, {30, 80, 5}, kWall);
  expect(splash_figures(drops(), map), 100, 0, 0, 100);
}

TEST(Splash, NeighbouringBulkIsNoSecondPiece) {
  Truth truth = drops();
  for (int y = 0; y < kHeight; ++y)
    for (int x = 0; x < kWidth; ++x)
      if (truth.piece[pixel(x, y)] < 0) {
        truth.depth[pixel(x, y)] = kWall + 4;
        truth.class_of[pixel(x, y)] = PixelClass::silhouette;
      }
  expect(splash_figures(truth, map_of(truth)), 100, 0, 0, 100);
}

TEST(Splash, HolesAndCutsAreNotClosed) {
  Map map = map_of(drops());
  map.depth[pixel(30, 30)] = static_cast<float>(kNothing);
  expect(splash_figures(drops(), map), 100, 0, 0, 75);
  for (int x = 0; x < kWidth; ++x) map.depth[pixel(x, 110)] = static_cast<float>(kNothing);
  expect(splash_figures(drops(), map), 100, 0, 1, 50);  // two halves are a doubled piece, too
}

TEST(Splash, SceneWithoutSplashHasNoFigure) {
  const Truth truth = wall([](int, int) { return true; }, PixelClass::interior);
  EXPECT_TRUE(std::isnan(splash_figures(truth, map_of(truth)).covered));
}

}  // namespace
}  // namespace meniscus::accuracy
