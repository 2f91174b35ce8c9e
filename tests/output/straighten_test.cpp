// Straight edges where faces are flat, and nothing else changed.
#include "output/straighten.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "base/parallel.hpp"
#include "output/ring.hpp"

namespace meniscus {
namespace {

constexpr int kAround = 240, kSide = 12;

// A ring of square section; vertices on its edges, one in twelve, are off by up to `teeth` units.
Mesh toothed(double teeth) {
  std::vector<double> noise(4 * kSide, 0.0);
  for (std::size_t j = 0; j < noise.size(); j += kSide) noise[j] = teeth;
  return ring_of(kAround, square(kSide), noise, true);
}

// How far vertices at place j of the section are from where they belong, RMS, across the ring;
// units.
double off_at(const Mesh& mesh, std::size_t j) {
  const auto at = square(kSide)[j];
  const double radius = kAround / (2 * std::numbers::pi);
  double sum = 0;
  std::size_t count = 0;
  for (std::size_t v = j; v < mesh.position.size(); v += 4 * kSide, ++count) {
    const Vec3d p(mesh.position[v]);
    const double out = std::hypot(p.x - 7, p.y) / kUnit - radius - at[0], up = p.z / kUnit - at[1];
    sum += out * out + up * up;
  }
  return std::sqrt(sum / static_cast<double>(count));
}

TEST(StraightenEdges, TeethGoAndFacesStay) {
  const Mesh before = toothed(0.5);
  Mesh after = before;
  straighten_edges(after, kUnit, kUnit);
  EXPECT_EQ(after.triangle, before.triangle);
  EXPECT_EQ(after.velocity, before.velocity);
  for (std::size_t corner = 0; corner < 4 * kSide; corner += kSide) {
    SCOPED_TRACE(corner);
    EXPECT_GT(off_at(before, corner), 0.3);
    EXPECT_LT(off_at(after, corner), 0.5 * off_at(before, corner));
  }
  for (std::size_t v = kSide / 2; v < before.position.size(); v += kSide) {
    EXPECT_EQ(after.position[v], before.position[v]);
    EXPECT_EQ(after.normal[v], before.normal[v]);
  }
  for (const Vec3& n : after.normal) EXPECT_NEAR(length(Vec3d(n)), 1, 1e-5);
}

TEST(StraightenEdges, StraightOnesStay) {
  Mesh after = toothed(0);
  straighten_edges(after, kUnit, kUnit);
  for (std::size_t j = 0; j < 4 * kSide; ++j) EXPECT_LT(off_at(after, j), 0.02) << j;
}

TEST(StraightenEdges, WhatIsRoundStays) {
  for (const int across : {9, 12, 120}) {  // an arm of 1.4 units, of 1.9, and a smooth tube
    SCOPED_TRACE(across);
    std::vector<std::array<double, 2>> circle;
    for (int j = 0; j < across; ++j) {
      const double angle = 2 * std::numbers::pi * j / across,
                   radius = across / (2 * std::numbers::pi);
      circle.push_back({radius * std::cos(angle), radius * std::sin(angle)});
    }
    const Mesh before = ring_of(kAround, circle, std::vector<double>(circle.size(), 0.0), false);
    Mesh after = before;
    straighten_edges(after, kUnit, kUnit);
    EXPECT_EQ(after.position, before.position);
    EXPECT_EQ(after.normal, before.normal);
  }
}

TEST(StraightenEdges, IsTheSameAtAnyScale) {
  constexpr float kScale = 1.0f / (1 << 20);
  Mesh large = toothed(0.5), small = large;
  for (Vec3& p : small.position) p = {kScale * p.x, kScale * p.y, kScale * p.z};
  straighten_edges(large, kUnit, kUnit);
  straighten_edges(small, kScale * kUnit, kScale * kUnit);
  for (Vec3& p : small.position) p = {p.x / kScale, p.y / kScale, p.z / kScale};
  EXPECT_EQ(small.position, large.position);
  EXPECT_EQ(small.normal, large.normal);
}

TEST(StraightenEdges, IsTheSameWithAnyThreads) {
  Mesh many = toothed(0.5), one = many;
  straighten_edges(many, kUnit, kUnit);
  on_threads(1, [&] { straighten_edges(one, kUnit, kUnit); });
  EXPECT_EQ(many.position, one.position);
  EXPECT_EQ(many.normal, one.normal);
}

TEST(StraightenEdges, NothingIsNothing) {
  Mesh empty;
  straighten_edges(empty, kUnit, kUnit);
  EXPECT_TRUE(empty.position.empty());
}

}  // namespace
}  // namespace meniscus
