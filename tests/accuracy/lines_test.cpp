// Straightness of silhouettes and creases, on lines whose zigzag is known.
#include "accuracy/figures/lines.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <numbers>

#include "accuracy/synthetic.hpp"

namespace meniscus::accuracy {
namespace {

constexpr double kLine = 80.5;  // pixels; the true line, between two columns
// A line of pixels is within half a pixel of the line it samples.
constexpr double kHalfPixel = 0.5 / kScale;

/// Displacement of a line in s, at `along` s.
using Shape = std::function<double(double along)>;

double zigzag(double along, double amplitude, double wavelength) {
  const double phase = along / wavelength - std::floor(along / wavelength);
  return amplitude * (4 * std::abs(phase - 0.5) - 1);
}

Truth half_wall() {
  return wall([](int x, int) { return x < kLine; }, PixelClass::silhouette);
}

Map half_wall(const Shape& shape) {
  return map_of(wall([&](int x, int y) { return x < kLine + kScale * shape(y / kScale); },
                     PixelClass::silhouette));
}

TEST(OutlineStraightness, ZigzagHasItsAmplitude) {
  // The RMS of a triangular wave is its amplitude over the root of three, of a sine over that of
  // two. The blur takes 2 pi^2 0.7^2 / 32^2, one hundredth, of a wave of 32 pixels.
  const Straightness zig =
      outline_straightness(half_wall(), half_wall([](double t) { return zigzag(t, 0.3, 2); }));
  EXPECT_NEAR(zig.jag, 0.3 / std::numbers::sqrt3, kHalfPixel);
  const Straightness sine = outline_straightness(
      half_wall(), half_wall([](double t) { return 0.25 * std::sin(std::numbers::pi * t); }));
  EXPECT_NEAR(sine.jag, 0.25 / std::numbers::sqrt2, kHalfPixel);
  EXPECT_EQ(zig.lost, 0);
}

TEST(OutlineStraightness, DisplacedAndTiltedLinesAreStraight) {
  EXPECT_EQ(outline_straightness(half_wall(), half_wall([](double) { return 0.5; })).jag, 0);
  const auto tilted = half_wall([](double t) { return 0.1 * (t - 6); });
  EXPECT_LE(outline_straightness(half_wall(), tilted).jag, kHalfPixel);
}

TEST(OutlineStraightness, LineThatIsTooFarIsLost) {
  const Straightness far = outline_straightness(half_wall(), half_wall([](double) { return 2; }));
  EXPECT_EQ(far.lost, 100);
  EXPECT_TRUE(std::isnan(far.jag));
  // A gap of 32 of the 192 rows that count: its ends are within 1.5 s of no other line.
  const Straightness gap = outline_straightness(
      half_wall(), half_wall([](double t) { return t >= 4 && t < 6 ? 5 : 0; }));
  EXPECT_NEAR(gap.lost, 100 * 32. / 192, 100 * 4. / 192) << "blurred by two pixels at either end";
}

TEST(OutlineStraightness, LineInFrontOfALayerIsItsDepthJump) {
  Truth truth = half_wall();
  for (double& depth : truth.depth)
    if (depth == kNothing) depth = kWall + 5;
  for (PixelClass& c : truth.class_of) c = PixelClass::silhouette;
  Map map = half_wall([](double t) { return zigzag(t, 0.3, 2); });
  for (float& depth : map.depth)
    if (depth != kWall) depth = kWall + 5;
  EXPECT_NEAR(outline_straightness(truth, map).jag, 0.3 / std::numbers::sqrt3, kHalfPixel);
  EXPECT_EQ(outline_straightness(truth, map_of(truth)).jag, 0);
}

TEST(OutlineStraightness, WallWithoutOutlineHasNoFigure) {
  const Truth truth = whole_wall();
  EXPECT_TRUE(std::isnan(outline_straightness(truth, map_of(truth)).jag));
  EXPECT_TRUE(std::isnan(crease_straightness(truth, map_of(truth)).jag));
}

const Vec3d kLeft = normalized({-1, -1, 0}), kRight = normalized({1, -1, 0});

/// Two faces that meet in a line of that shape. `width` s: the normal turns that slowly.
Truth roof(const Shape& shape, double width = 0) {
  Truth truth = wall([](int, int) { return true; }, PixelClass::crease);
  for (int y = 0; y < kHeight; ++y)
    for (int x = 0; x < kWidth; ++x) {
      const double beyond = (x - kLine) / kScale - shape(y / kScale);
      const double share = width > 0 ? std::clamp(beyond / width + 0.5, 0., 1.) : beyond > 0;
      truth.normal[pixel(x, y)] = normalized((1 - share) * kLeft + share * kRight);
    }
  return truth;
}

double straight(double) { return 0; }

TEST(CreaseStraightness, ZigzagHasItsAmplitude) {
  const Map map = map_of(roof([](double t) { return zigzag(t, 0.3, 2); }));
  EXPECT_NEAR(crease_straightness(roof(straight), map).jag, 0.3 / std::numbers::sqrt3, kHalfPixel);
  EXPECT_EQ(crease_straightness(roof(straight), map).lost, 0);
}

TEST(CreaseStraightness, RoundedCreaseIsWhereTheNormalIsHalfWay) {
  // The width and a displacement do not count; the zigzag does. Without pixels' steps only the
  // blur is left, one hundredth.
  const Map displaced = map_of(roof([](double) { return 0.4; }, /*width=*/1));
  EXPECT_LE(crease_straightness(roof(straight), displaced).jag, 1e-6);
  const Map wavy = map_of(roof([](double t) { return 0.2 * std::sin(std::numbers::pi * t); }, 1));
  EXPECT_NEAR(crease_straightness(roof(straight), wavy).jag, 0.2 / std::numbers::sqrt2, 0.02 * 0.2);
}

TEST(CreaseStraightness, CreaseThatIsNotThereIsLost) {
  const Map flat = map_of(roof([](double) { return 100; }));
  EXPECT_EQ(crease_straightness(roof(straight), flat).lost, 100);
}

TEST(CreaseStraightness, MapWithoutNormalsShowsThoseOfItsDepths) {
  Truth truth = roof(straight);
  Map map;
  for (int y = 0; y < kHeight; ++y)
    for (int x = 0; x < kWidth; ++x) {
      const double beyond = (x - kLine) / kScale;
      truth.depth[pixel(x, y)] = kWall + std::abs(beyond);
      map.depth.push_back(static_cast<float>(
          kWall + std::abs(beyond - 0.2 * std::sin(std::numbers::pi * y / kScale))));
    }
  // Differences over two pixels give the normal of the middle where the crease is crossed, one of
  // three values: the line is good to a pixel. The sine displaces the faces, too, by its slope.
  EXPECT_NEAR(crease_straightness(truth, map).jag, 0.2 / std::numbers::sqrt2, 2 * kHalfPixel);
}

}  // namespace
}  // namespace meniscus::accuracy
