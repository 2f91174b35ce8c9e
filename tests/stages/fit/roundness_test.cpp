// Whether one quadric or two sheets explain the surface, against double-precision loops and shapes
// whose answer is known, on every device.
#include "stages/fit/roundness.hpp"

#include <numbers>
#include <utility>

#include "stages/stage_test_support.hpp"
#include "verify/stage_cases/roundness.hpp"

namespace meniscus {
namespace {

using Roundness = OnDevice;

// Particles at given places with given normals, all of them fitted.
FittedSurface placed_surface(const std::vector<Vec3d>& at, const std::vector<Vec3d>& normal,
                             double noise) {
  Random random(9);
  std::vector<Vec3d> uvt;
  for (const Vec3d& x : at) {  // plain_view: eye x = u - 50, y = 50 - v, z = -t
    const Vec3d moved =
        x + Vec3d{random(-noise, noise), random(-noise, noise), random(-noise, noise)};
    uvt.push_back({50 + moved.x, 50 - moved.y, -moved.z});
  }
  FittedSurface scene{place(uvt), {}, {}, {}};
  scene.seen = all_visible(scene.projected);
  scene.around = {scene.seen.index, std::vector<double>(at.size(), 1.0), normal};
  scene.place = scene.seen.index;
  return scene;
}

// About 2 radii apart on a sphere, around (0, 0, -60).
FittedSurface drop(double radius, double noise) {
  std::vector<Vec3d> at, normal;
  const int count = static_cast<int>(std::numbers::pi * radius * radius);  // 4 radii^2 each
  for (int k = 0; k < count; ++k) {
    const double z = 1 - (2 * k + 1.0) / count, turn = k * std::numbers::pi * (3 - std::sqrt(5.0));
    const double across = std::sqrt(1 - z * z);
    const Vec3d n{across * std::cos(turn), across * std::sin(turn), z};
    normal.push_back(n);
    at.push_back(n * radius + Vec3d{0, 0, -60});
  }
  return placed_surface(at, normal, noise);
}

// Two faces that meet at 90 degrees along y; normals turn over two radii, as the field's do.
FittedSurface edge(double noise) {
  std::vector<Vec3d> at, normal;
  for (int j = -10; j <= 10; ++j)
    for (int i = -12; i <= 12; ++i) {
      const double along = 2 * i + 0.7;
      const double side = along < 0 ? -1 : 1, depth = std::abs(along) / std::numbers::sqrt2;
      at.push_back({side * depth, 2.0 * j, -60 - depth});
      const double turn = std::clamp(along / 2, -1.0, 1.0) * std::numbers::pi / 4;
      normal.push_back({std::sin(turn), 0, std::cos(turn)});
    }
  return placed_surface(at, normal, noise);
}

// Two faces that meet at 90 degrees along y in an arc of a radius, 2 radii from particle to
// particle.
FittedSurface rounded_edge(double radius, double noise) {
  const double half = radius * std::numbers::pi / 4;  // the arc, from its middle
  std::vector<Vec3d> at, normal;
  for (int j = -16; j <= 16; ++j)
    for (int i = -12; i <= 12; ++i) {
      const double along = 2 * i + 0.7 * (j % 3), side = along < 0 ? -1 : 1;
      const double turn = std::min(std::abs(along), half) / radius;
      const double beyond = std::max(std::abs(along) - half, 0.0) / std::numbers::sqrt2;
      at.push_back({side * (radius * std::sin(turn) + beyond), 2.0 * j,
                    -60 - radius * (1 - std::cos(turn)) - beyond});
      normal.push_back({side * std::sin(turn), 0, std::cos(turn)});
    }
  return placed_surface(at, normal, noise);
}

TEST_P(Roundness, EvidenceMatchesTheReference) {
  std::size_t decided = 0, all = 0;
  double most_two = 0, apart = 0;
  for (const auto& surface : {hills, roof}) {
    const FittedSurface scene = fitted_surface(field(15, 3, surface));
    const Evidence evidence = evidence_of(device_, scene);
    const auto wide = trial_fits(device_, scene, true), narrow = trial_fits(device_, scene, false);
    Random random(5);
    const auto near_narrow = rounded(narrow, random);
    for (std::size_t k = 0; k < scene.seen.index.size(); ++k) {
      EXPECT_NEAR(evidence.one[k], reference::one_quadric(wide, k), kEvidenceBound);
      EXPECT_NEAR(evidence.bend[k], reference::bend_of(wide, k), kEvidenceBound);
      EXPECT_NEAR(evidence.apart[k], 1 - dot(wide[k].normal, narrow[k].normal), kEvidenceBound);
      EXPECT_EQ(evidence.normal[k], wide[k].normal);
      const double expected = reference::two_sheets(narrow, k);
      ++all;
      if (std::abs(reference::two_sheets(near_narrow, k) - expected) > kEvidenceBound) continue;
      ++decided;
      EXPECT_NEAR(evidence.two[k], expected, 4 * kEvidenceBound);
      most_two = std::max(most_two, expected);
      apart = std::max(apart, std::abs(expected - reference::one_quadric(narrow, k)));
    }
  }
  EXPECT_GT(decided, all * 9 / 10);
  EXPECT_GT(most_two, 1e-3);
  EXPECT_GT(apart, 1e-3);  // sheets were told apart
}

TEST_P(Roundness, DropsAreRound) {
  for (const double radius : {3.0, 5.0, 8.0})
    for (const float r : roundness_of(device_, drop(radius, 0.1))) EXPECT_EQ(r, 1) << radius;
}

// A single layer of particles has no field that tells its normals; those of edge() are made to turn
// about as fast as the field's do. Without noise one quadric follows such a layer as well as two
// sheets. Sharp edges of bodies are in the accuracy tests.
TEST_P(Roundness, AnEdgeIsLessRoundThanADropOfTheSameNoise) {
  constexpr double kNoise = 0.35;
  const FittedSurface scene = edge(kNoise);
  const std::vector<float> of_edge = roundness_of(device_, scene);
  double sum = 0, count = 0;
  for (std::size_t k = 0; k < of_edge.size(); ++k) {
    if (std::abs(scene.projected.x[k]) > 4 || std::abs(scene.projected.y[k]) > 14) continue;
    sum += of_edge[k];
    ++count;
  }
  EXPECT_GT(count, 50);
  EXPECT_LT(sum / count, 0.5);
  for (const float r : roundness_of(device_, drop(5, kNoise))) EXPECT_EQ(r, 1);
}

// The edge of water at a wall, 1.25 spacings from its axis: two sheets follow it nearly as well.
TEST_P(Roundness, AnEdgeOfASmallRadiusIsRound) {
  for (const double noise : {0.05, 0.1, 0.15}) {
    const FittedSurface scene = rounded_edge(1.5, noise);
    const std::vector<float> roundness = roundness_of(device_, scene);
    for (std::size_t k = 0; k < roundness.size(); ++k)
      if (std::abs(scene.around.normal[k].x) < 0.5) {
        EXPECT_GT(roundness[k], 0.9) << noise;
      }
  }
}

// No surface follows what irregular particles leave: who does not know of it takes it for two
// sheets. That sharp edges of such bodies stay creases is in the accuracy tests.
TEST_P(Roundness, NoiseOfIrregularParticlesIsNotTakenForTwoSheets) {
  const FittedSurface scene = rounded_edge(1.5, 0.45);
  const std::vector<float> unaware = roundness_of(device_, scene);
  for (const double disorder : {0.4, 1.0}) {
    const std::vector<float> aware = roundness_of(device_, scene, disorder);
    int count = 0;
    for (std::size_t k = 0; k < aware.size(); ++k) {
      if (std::abs(scene.around.normal[k].x) >= 0.5 || std::abs(scene.projected.y[k]) > 14)
        continue;
      EXPECT_LT(unaware[k], 0.1);
      EXPECT_GT(aware[k], 0.9) << disorder;
      ++count;
    }
    EXPECT_GT(count, 10);
  }
}

// Where the neighbours of all trial fits have no room in one buffer.
TEST_P(Roundness, InPartsIsTheSame) {
  const FittedSurface scene = edge(0.25);
  const std::vector<float> whole = roundness_of(device_, scene);
  std::size_t& largest = device_.state().info.largest_buffer;
  const std::size_t before = std::exchange(largest, std::size_t{52} << 10);
  const std::size_t parts = trials_of(device_, scene).neighbours.parts.size();
  const std::vector<float> apart = roundness_of(device_, scene);
  largest = before;
  EXPECT_GT(parts, 1u);
  EXPECT_EQ(apart, whole);
  EXPECT_NE(whole, std::vector<float>(whole.size(), whole[0]));
}

TEST_P(Roundness, FlatPlacesAreNotAsked) {
  const auto flat = [](double, double) { return 30.0; };
  for (const float r : roundness_of(device_, fitted_surface(field(15, 3, flat)))) EXPECT_EQ(r, 0);
  EXPECT_TRUE(roundness_of(device_, placed_surface({}, {}, 0)).empty());
}

TEST_P(Roundness, VectorsOfAnyWidthGiveTheSameBits) {
  const FittedSurface scene = drop(5, 0.3);
  use_width(1);
  const Evidence one = evidence_of(device_, scene);
  const std::vector<float> round = roundness_of(device_, scene);
  for (const int width : {4, 8, 16}) {
    use_width(width);
    const Evidence wide = evidence_of(device_, scene);
    EXPECT_EQ(one.one, wide.one);
    EXPECT_EQ(one.two, wide.two);
    EXPECT_EQ(one.bend, wide.bend);
    EXPECT_EQ(one.normal, wide.normal);
    EXPECT_EQ(round, roundness_of(device_, scene));
  }
}

MENISCUS_ON_EVERY_DEVICE(Roundness);

}  // namespace
}  // namespace meniscus
