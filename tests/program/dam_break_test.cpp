// The frames that `meniscus generate` makes.
#include "program/dam_break.hpp"

#include <gmock/gmock.h>

#include <algorithm>
#include <cmath>
#include <vector>

#include "meniscus/error.hpp"
#include "stages/frame/cells.hpp"

namespace meniscus {
namespace {

std::vector<float> all_of(const DamBreak& dam, std::vector<std::size_t>* blocks = nullptr) {
  std::vector<float> points;
  dam.emit([&](std::span<const float> block) {
    points.insert(points.end(), block.begin(), block.end());
    if (blocks) blocks->push_back(block.size() / 3);
  });
  return points;
}

TEST(DamBreak, HasExactlyAsManyParticlesAsAskedFor) {
  for (const std::int64_t n : {10, 11, 12, 13, 17, 29, 64, 100, 999, 16384, 16385, 50000}) {
    const DamBreak dam(n, 1);
    EXPECT_EQ(dam.size(), n);
    std::vector<std::size_t> blocks;
    const std::vector<float> points = all_of(dam, &blocks);
    EXPECT_EQ(points.size(), 3 * static_cast<std::size_t>(n));
    for (const std::size_t block : blocks) EXPECT_LE(block, DamBreak::kBlock);
    for (const float value : points) EXPECT_TRUE(std::isfinite(value));
  }
}

TEST(DamBreak, IsTheSameForTheSameSeedAndAnotherForAnother) {
  const std::vector<float> first = all_of(DamBreak(20000, 7));
  EXPECT_EQ(first, all_of(DamBreak(20000, 7)));
  EXPECT_NE(first, all_of(DamBreak(20000, 8)));
}

// How far particles lie from where they lie without noise, along each axis, s.
TEST(DamBreak, HasAsMuchNoiseAsAskedFor) {
  const DamBreak plain(20000, 7, 0);
  const std::vector<float> at_rest = all_of(plain);
  for (const double noise : {DamBreak::kNoise, 0.29}) {
    const std::vector<float> points = all_of(DamBreak(20000, 7, noise));
    double squares = 0;
    std::size_t count = 0;
    for (std::size_t k = 0; k < points.size(); k += 3) {
      const double off = (points[k] - at_rest[k]) / plain.spacing();
      if (off == 0) continue;  // spray has none
      squares += off * off;
      ++count;
    }
    EXPECT_NEAR(std::sqrt(squares / static_cast<double>(count)), noise, 0.02 * noise);
  }
  EXPECT_EQ(all_of(DamBreak(20000, 7)), all_of(DamBreak(20000, 7, DamBreak::kNoise)));
  for (const double noise : {-0.1, 1.1, std::nan("")})
    EXPECT_THROW(DamBreak(20000, 7, noise), InvalidArgument) << noise;
}

// A spray of 2 sqrt(n), or a fiftieth where that is less, and the noise of the drops.
TEST(DamBreak, IsFluidButForALittleSpray) {
  for (const std::int64_t n : {1000, 30000, 300000}) {
    const DamBreak dam(n, 1);
    const std::vector<float> points = all_of(dam);
    const double s = dam.spacing();
    std::int64_t in_air = 0;
    for (std::size_t k = 0; k < points.size(); k += 3) {
      const auto in_drop = [&](const DamBreak::Drop& drop) {
        return std::hypot(points[k] - drop.centre[0], points[k + 1] - drop.centre[1],
                          points[k + 2] - drop.centre[2]) <= drop.radius + s / 2;
      };
      in_air += points[k + 1] > dam.height(points[k], points[k + 2]) + s &&
                std::none_of(dam.drops().begin(), dam.drops().end(), in_drop);
    }
    const double expected = std::min(n / 50.0, 2 * std::sqrt(n));
    EXPECT_LE(in_air, expected + 1 + 0.001 * static_cast<double>(n)) << n;
    EXPECT_GE(in_air, std::floor(expected)) << n;
  }
}

// Inside the fluid there is one particle per s^3. Over a box of side L the count is off by less
// than one layer on each of its six faces, of which half the sites are the box's own: the mean over
// positions of the faces is exact, and one box may be off by its surface times half a layer, .4 s.
TEST(DamBreak, HoldsOneParticlePerCubicSpacing) {
  const DamBreak dam(400000, 3);
  const std::vector<float> points = all_of(dam);
  const double s = dam.spacing(), side = 0.3;
  const double low[3] = {0.2, 0.05, 0.5};
  ASSERT_GT(dam.height(0.5, 0.8), low[1] + side + 2 * s);
  std::int64_t inside = 0;
  for (std::size_t k = 0; k < points.size(); k += 3) {
    bool in = true;
    for (std::size_t a = 0; a < 3; ++a)
      in = in && points[k + a] >= low[a] && points[k + a] < low[a] + side;
    inside += in;
  }
  const double expected = std::pow(side / s, 3), faces = 6 * std::pow(side / s, 2);
  EXPECT_NEAR(static_cast<double>(inside), expected, 0.4 * faces);
}

// Layers are stretched by half a layer over their number at most; the noise reaches .1225 s up and
// down (six deviations of a triangular distribution are 2 sqrt(6) of them), twice that with the
// surface's slope, which is below one where the nose has not begun.
TEST(DamBreak, KeepsItsFirstLayerHalfASpacingBelowTheSurface) {
  const DamBreak dam(200000, 1);
  const std::vector<float> points = all_of(dam);
  const double s = dam.spacing();
  double sum = 0;
  int first_layer = 0;
  for (std::size_t k = 0; k < points.size(); k += 3) {
    if (points[k] > 1.0) continue;  // the column behind the tongue, and above it no drops
    const double depth = (dam.height(points[k], points[k + 2]) - points[k + 1]) / s;
    EXPECT_GT(depth, 0.5 - 0.26);
    if (depth > 0.8) continue;
    sum += depth;
    ++first_layer;
  }
  ASSERT_GT(first_layer, 1000);
  // The mean of `first_layer` independent noises, five deviations.
  EXPECT_NEAR(sum / first_layer, 0.5, 5 * 0.05 / std::sqrt(first_layer) + 0.005);
}

// A simulation's particles (the dam break of 35,937 that the method was tuned on) have their
// nearest neighbour at .88 s in the median, .75 to 1.01 s for nine of ten, and 16 neighbours within
// 1.6 s. A lattice has one distance, random points have .55 s.
TEST(DamBreak, IsSpacedLikeAFluid) {
  const DamBreak dam(60000, 1);
  const std::vector<float> points = all_of(dam);
  const float s = static_cast<float>(dam.spacing());
  std::vector<float> x, y, z;
  for (std::size_t k = 0; k < points.size(); k += 3) {
    x.push_back(points[k]);
    y.push_back(points[k + 1]);
    z.push_back(points[k + 2]);
  }
  const Cells cells = make_cells(x, y, z, 1.6f * s);
  std::vector<double> nearest, neighbours;
  for (std::size_t i = 0; i < x.size(); ++i) {
    double best = 1e9, count = -1;  // without itself
    visit_near(cells, x[i], y[i], z[i], [&](std::int32_t p) {
      const double d = std::hypot(cells.x[p] - x[i], cells.y[p] - y[i], cells.z[p] - z[i]) / s;
      if (cells.item[p] != static_cast<std::int32_t>(i)) best = std::min(best, d);
      count += d < 1.6;
      return true;
    });
    nearest.push_back(best);
    neighbours.push_back(count);
  }
  const auto at = [](std::vector<double> values, double share) {
    std::sort(values.begin(), values.end());
    return values[static_cast<std::size_t>(share * static_cast<double>(values.size() - 1))];
  };
  EXPECT_NEAR(at(nearest, 0.5), 0.88, 0.03);
  EXPECT_NEAR(at(nearest, 0.05), 0.72, 0.06);
  EXPECT_NEAR(at(nearest, 0.95), 1.03, 0.04);
  EXPECT_NEAR(at(neighbours, 0.5), 16, 1);
}

TEST(DamBreak, RefusesTooFewAndTooMany) {
  EXPECT_THROW(DamBreak(9, 1), InvalidArgument);
  EXPECT_THROW(DamBreak(1'000'000'001, 1), InvalidArgument);
  EXPECT_THROW(DamBreak(-1, 1), InvalidArgument);
}

}  // namespace
}  // namespace meniscus
