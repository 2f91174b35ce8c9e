// The stage fairing: what it evens out, and what it leaves.
#include "stages/sample/fairing.hpp"

#include "stages/stage_test_support.hpp"

namespace meniscus {
namespace {

using Fairing = OnDevice;

constexpr double kSigma = 1.2;
constexpr int kSize = 41;

// Particles span 3 samples.
View view_of_samples() {
  return make_view(orthographic_camera(3 * kSize, 3 * kSize), 0.2, {0, 0, 0});
}

// Samples (i, j) at depths, with normals; none where the depth is infinite.
template <class Depth, class Normal>
SurfaceMap map_of_samples(const Depth& depth, const Normal& normal) {
  SurfaceMap map;
  map.grid = {kSize, kSize, 0.5f, 1};
  for (int j = 0; j < kSize; ++j)
    for (int i = 0; i < kSize; ++i) {
      const double t = depth(i, j);
      map.depth.push_back(static_cast<float>(t));
      map.normal.push_back(t < kNoSurface ? static_cast<Vec3>(normalized(normal(i, j))) : Vec3{});
      map.group.push_back(-1);
      map.kind.push_back(t < kNoSurface ? Kind::surface : Kind::none);
    }
  return map;
}

SurfaceMap faired(Device& device, const SurfaceMap& map, double sigma = kSigma) {
  const SurfaceBuffers surface = upload(device, map);
  fair_normals(device, view_of_samples(), surface, sigma);
  return download(device, surface);
}

double apart(const Vec3& a, const Vec3& b) { return length(Vec3d(a) - Vec3d(b)); }

TEST_P(Fairing, EvensOutNoiseAndLeavesDepths) {
  Random random(3);
  const SurfaceMap noisy = map_of_samples([](int, int) { return 50.0; },
                                          [&](int, int) {
                                            return Vec3d{random(-0.1, 0.1), random(-0.1, 0.1), 1};
                                          });
  const SurfaceMap found = faired(device_, noisy);
  EXPECT_EQ(found.depth, noisy.depth);
  double before = 0, after = 0;
  for (std::size_t s = 0; s < noisy.depth.size(); ++s) {
    before += std::pow(apart(noisy.normal[s], {0, 0, 1}), 2);
    after += std::pow(apart(found.normal[s], {0, 0, 1}), 2);
  }
  // Five neighbours count along a row, and as many along a column.
  EXPECT_LT(std::sqrt(after / before), 0.5);
}

TEST_P(Fairing, LeavesNormalsThatTurnEvenly) {
  // Round, to where it ends. A mean would be off by .05 there; the ridge on the slope leaves a
  // quarter of it.
  const auto x = [](int i) { return (i - kSize / 2) / 60.0; };
  const SurfaceMap round =
      map_of_samples([&](int i, int j) { return i > 4 && j < 30 ? 50.0 : kNoSurface; },
                     [&](int i, int j) {
                       return Vec3d{x(i), -x(j), 1};
                     });
  const SurfaceMap found = faired(device_, round);
  for (int j = 0; j < kSize; ++j)
    for (int i = 0; i < kSize; ++i) {
      const std::size_t s = static_cast<std::size_t>(j * kSize + i);
      const bool inside = i > 14 && i < kSize - 10 && j > 9 && j < 20;
      EXPECT_LT(apart(found.normal[s], round.normal[s]), inside ? 0.001 : 0.015) << s;
    }
}

TEST_P(Fairing, LeavesCreasesAndWhatLiesBehind) {
  const SurfaceMap sharp =
      map_of_samples([](int i, int j) { return j < 20 ? 50.0 : 55.0 + 0.01 * i; },
                     [](int i, int j) {
                       const double side = i < 20 ? -0.6 : 0.6;
                       return j < 20 ? Vec3d{side, 0, 1} : Vec3d{0, 0.2, 1};
                     });
  const SurfaceMap found = faired(device_, sharp);
  for (std::size_t s = 0; s < sharp.depth.size(); ++s)
    EXPECT_LT(apart(found.normal[s], sharp.normal[s]), 1e-5) << s;
}

TEST_P(Fairing, LeavesLoneSamplesAndTurnsToTheEye) {
  const SurfaceMap lone =
      map_of_samples([](int i, int j) { return i == 7 && j == 9 ? 50.0 : kNoSurface; },
                     [](int, int) {
                       return Vec3d{1, 0, 0.3};
                     });
  EXPECT_LT(apart(faired(device_, lone).normal[9 * kSize + 7], lone.normal[9 * kSize + 7]), 1e-6);
  const SurfaceMap away = map_of_samples([](int, int) { return 50.0; },
                                         [](int i, int) {
                                           return Vec3d{1, 0, 0.02 * (i % 7) - 0.05};
                                         });
  for (const Vec3& n : faired(device_, away).normal)
    EXPECT_LT(dot(Vec3d(n), ray_direction(view_of_samples(), 0.5, 0.5)), 0);
}

MENISCUS_ON_EVERY_DEVICE(Fairing);

}  // namespace
}  // namespace meniscus
