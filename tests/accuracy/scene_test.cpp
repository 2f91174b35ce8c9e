// The scenes of the measuring instrument: their distances, creases, spray and filling.
#include "accuracy/scene.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <numbers>
#include <set>

#include "accuracy/figures/statistics.hpp"
#include "accuracy/particles.hpp"
#include "accuracy/random.hpp"
#include "accuracy/shapes.hpp"
#include "accuracy/truth.hpp"

namespace meniscus::accuracy {
namespace {

Vec3d random_direction(Random& random) {
  Vec3d v;
  do {
    v = random.in_box({-1, -1, -1}, {1, 1, 1});
  } while (dot(v, v) > 1 || dot(v, v) < 0.01);
  return normalized(v);
}

const Truth& truth_of(const std::string& name) {
  static std::map<std::string, Truth> traced;
  if (!traced.contains(name))
    traced.emplace(name, trace(find_scene(name), lens_of(find_scene(name))));
  return traced.at(name);
}

std::vector<std::string> names() {
  std::vector<std::string> all;
  for (const auto* list : {&scenes(), &held_out_scenes()})
    for (const Scene& scene : *list) all.push_back(scene.name);
  return all;
}

class AccuracyScenes : public testing::TestWithParam<std::string> {};

TEST_P(AccuracyScenes, SafeStepsReachNoSurface) {
  const Scene& scene = find_scene(GetParam());
  Random random(5);
  const Vec3d room{4, 4, 4};  // s; the camera's rays come from outside
  for (int k = 0; k < 8000; ++k) {
    const Vec3d p = random.in_box(scene.low - room, scene.high + room);
    const double distance = scene.distance(p);
    const double step = scene.safe_step * std::abs(distance) * (1 - 1e-9);
    for (int m = 0; m < 8; ++m) {
      const Vec3d q = p + step * random_direction(random);
      ASSERT_EQ(scene.distance(q) < 0, distance < 0)
          << p.x << ", " << p.y << ", " << p.z << " is " << distance << " from the surface, but "
          << q.x << ", " << q.y << ", " << q.z << " lies on its other side";
    }
  }
}

TEST_P(AccuracyScenes, BoxHoldsTheSolid) {
  const Scene& scene = find_scene(GetParam());
  Random random(6);
  const Vec3d room{3, 3, 3};
  for (int k = 0; k < 20000; ++k) {
    const Vec3d p = random.in_box(scene.low - room, scene.high + room);
    const bool in_box = p.x >= scene.low.x && p.y >= scene.low.y && p.z >= scene.low.z &&
                        p.x <= scene.high.x && p.y <= scene.high.y && p.z <= scene.high.z;
    if (!in_box) {
      ASSERT_GT(scene.distance(p), 0) << p.x << ", " << p.y << ", " << p.z;
    }
  }
}

// Both in one test, as seeing the scene takes most of the time.
TEST_P(AccuracyScenes, AreSeenWholeAtEightToTwentyPixelsWithRightDistancesAtHalfASpacing) {
  const Scene& scene = find_scene(GetParam());
  const Truth& truth = truth_of(scene.name);
  EXPECT_GE(truth.mean_scale(), 8);
  EXPECT_LE(truth.mean_scale(), 20);
  int interior = 0, crease = 0;
  for (const PixelClass c : truth.class_of) {
    interior += c == PixelClass::interior;
    crease += c == PixelClass::crease;
  }
  EXPECT_GT(interior, 20000);
  if (!scene.smooth) {
    EXPECT_GT(crease, 1000);
  }
  const double particles = volume(scene);
  EXPECT_GE(particles, 4000);
  EXPECT_LE(particles, 25000);

  // Centres lie half a spacing deep: there the distance must be right, not only a bound.
  double worst = 0;
  for (std::size_t p = 0; p < truth.depth.size(); p += 7) {
    if (truth.class_of[p] != PixelClass::interior) continue;
    const Vec3d centre = truth.lens.point(p, truth.depth[p]) - 0.5 * truth.normal[p];
    worst = std::max(worst, std::abs(scene.distance(centre) + 0.5));
  }
  // The sides of twolayer's plate and of sheet are nearer than 1.5 s to nothing but an outline;
  // elsewhere a twentieth of the noise that is added to the centres.
  EXPECT_LE(worst, 0.05 * 0.05);
}

INSTANTIATE_TEST_SUITE_P(All, AccuracyScenes, testing::ValuesIn(names()),
                         [](const auto& info) { return info.param; });

TEST(AccuracyShapes, EllipsoidIsExact) {
  const Vec3d half{16, 10, 7};
  Random random(8);
  for (int k = 0; k < 2000; ++k) {
    const Vec3d v = random_direction(random);
    const Vec3d foot{half.x * v.x, half.y * v.y, half.z * v.z};
    const Vec3d normal = normalized({v.x / half.x, v.y / half.y, v.z / half.z});
    // Normals meet no sooner than the smallest radius of curvature, 7 * 7 / 16 s.
    const double distance = random.uniform(-3, 10);
    EXPECT_NEAR(ellipsoid_distance(foot + distance * normal, half), distance, 1e-6);
  }
  EXPECT_NEAR(ellipsoid_distance({0, 0, 0}, half), -7, 1e-6);
  EXPECT_NEAR(ellipsoid_distance({0, 0, 9}, half), 2, 1e-6);
  EXPECT_NEAR(ellipsoid_distance({3, 4, 12}, {6, 6, 6}), 7, 1e-6);
}

TEST(AccuracyShapes, BowlIsTheHalfShell) {
  EXPECT_DOUBLE_EQ(bowl_distance({0, 0, -14}, 14, 5), -2.5);
  EXPECT_DOUBLE_EQ(bowl_distance({0, 0, -10}, 14, 5), 1.5);
  EXPECT_DOUBLE_EQ(bowl_distance({0, 12, -16}, 14, 5), 6 - 2.5);
  EXPECT_DOUBLE_EQ(bowl_distance({17, 0, 4}, 14, 5), 5 - 2.5) << "the rim is a ring's";
  EXPECT_DOUBLE_EQ(bowl_distance({0, 0, 0}, 14, 5), 14 - 2.5);
}

TEST(AccuracyShapes, CapsuleIsASegmentsNeighbourhood) {
  const Vec3d a{1, 2, 3}, b{5, 2, 3};
  EXPECT_DOUBLE_EQ(capsule_distance({3, 5, 7}, a, b, 2), 5 - 2);
  EXPECT_DOUBLE_EQ(capsule_distance({-2, 6, 3}, a, b, 2), 5 - 2);
  EXPECT_DOUBLE_EQ(capsule_distance({5, 2, 3}, a, b, 2), -2);
}

TEST(AccuracyShapes, PrismIsBoundedByItsFaces) {
  const std::vector<std::array<double, 2>> square{{3, -3}, {3, 3}, {-3, 3}, {-3, -3}};
  Random random(9);
  for (int k = 0; k < 1000; ++k) {
    const Vec3d p = random.in_box({-4, -6, -4}, {4, 6, 4});
    const double expected = std::max({std::abs(p.x) - 3, std::abs(p.y) - 5, std::abs(p.z) - 3});
    EXPECT_NEAR(prism_distance(p, square, 5), expected, 1e-14);
  }
}

/// Angles (degrees, rounded) between the normals of neighbouring pixels within creases.
std::map<int, int> crease_angles(const Truth& truth) {
  std::map<int, int> count;
  for (std::size_t p = 0; p + 1 < truth.depth.size(); ++p) {
    if (truth.class_of[p] != PixelClass::crease || truth.class_of[p + 1] != PixelClass::crease)
      continue;
    const double cosine = dot(truth.normal[p], truth.normal[p + 1]);
    if (cosine < 0.95) ++count[static_cast<int>(std::lround(std::acos(cosine) / kDegree))];
  }
  return count;
}

TEST(AccuracyCreases, PrismAndCapsulesHaveTheirAngles) {
  const auto prism = crease_angles(truth_of("prism"));
  for (const int angle : {30, 45, 60, 90}) EXPECT_GT(prism.count(angle), 0) << angle;
  // Normals of a cylinder of 7 s turn by up to 1/7 rad per s beside the crease: at 12 pixels per
  // s and slanted by 70 degrees 2 degrees a pixel, on either side.
  const auto capsules = crease_angles(truth_of("capsules"));
  for (const int angle : {30, 60, 105}) {
    int pixels = 0;
    for (int a = angle - 4; a <= angle + 4; ++a)
      pixels += capsules.contains(a) ? capsules.at(a) : 0;
    EXPECT_GT(pixels, 20) << angle;
  }
}

/// Places where three sheets meet: three normals, any two `apart` degrees from each other, within
/// a window of 5 x 5 pixels of one depth.
int corners(const Truth& truth, double apart) {
  const int width = truth.lens.width, height = truth.lens.height;
  const double limit = std::cos(apart * kDegree);
  int found = 0;
  for (int j = 2; j < height - 2; ++j)
    for (int i = 2; i < width - 2; ++i) {
      const std::size_t p = static_cast<std::size_t>(j) * width + i;
      if (truth.class_of[p] != PixelClass::crease) continue;
      std::vector<Vec3d> sheets;
      for (int dj = -2; dj <= 2; ++dj)
        for (int di = -2; di <= 2; ++di) {
          const std::size_t q = p + dj * width + di;
          if (!(std::abs(truth.depth[q] - truth.depth[p]) < 1)) continue;
          if (std::all_of(sheets.begin(), sheets.end(),
                          [&](const Vec3d& n) { return dot(n, truth.normal[q]) < limit; }))
            sheets.push_back(truth.normal[q]);
        }
      found += sheets.size() >= 3;
    }
  return found;
}

TEST(AccuracyCreases, ThreeSheetsMeet) {
  EXPECT_GT(corners(truth_of("notch"), 80), 0);
  EXPECT_GT(corners(truth_of("capsules"), 25), 0);
  EXPECT_EQ(corners(truth_of("plane"), 25), 0);
}

TEST(AccuracySplash, PiecesHoverOutOfEachOthersReach) {
  const Scene& scene = find_scene("splash");
  std::set<std::size_t> sizes;
  for (std::size_t k = 0; k < scene.splash.size(); ++k) {
    const Piece& piece = scene.splash[k];
    sizes.insert(piece.size());
    for (std::size_t m = 0; m < piece.size(); ++m) {
      EXPECT_GE(scene.distance(piece[m]), 3);
      double nearest = 1e9;
      for (std::size_t n = 0; n < piece.size(); ++n)
        if (n != m) nearest = std::min(nearest, length(piece[m] - piece[n]));
      EXPECT_GE(nearest, 0.8);
      if (piece.size() > 1) {
        EXPECT_LE(nearest, 1.2) << "a piece hangs together";
      }
      for (std::size_t other = 0; other < k; ++other)
        for (const Vec3d& p : scene.splash[other]) EXPECT_GE(length(p - piece[m]), 4);
    }
  }
  EXPECT_EQ(sizes, (std::set<std::size_t>{1, 2, 3, 4, 5, 6}));
  for (const Scene& other : scenes()) EXPECT_EQ(other.splash.empty(), other.name != "splash");
}

TEST(AccuracySplash, LoneParticlesAreSpheresOfTheirRadius) {
  const Scene& scene = find_scene("splash");
  const Truth& truth = truth_of("splash");
  int seen = 0;
  for (int k = 0; k < truth.splash_pieces; ++k) {
    if (scene.splash[k].size() > 1) continue;
    const Vec3d centre = scene.splash[k][0];
    for (int j = 0; j < truth.lens.height; ++j)
      for (int i = 0; i < truth.lens.width; ++i) {
        const std::size_t p = static_cast<std::size_t>(j) * truth.lens.width + i;
        const Vec3d o = truth.lens.origin(i, j) - centre, d = truth.lens.direction(i, j);
        const double a = dot(d, d), b = dot(o, d), root = b * b - a * (dot(o, o) - 0.25);
        const double depth = root >= 0 ? (-b - std::sqrt(root)) / a : 1e9;
        if (root < 0) {
          EXPECT_NE(truth.piece[p], k);
        } else if (truth.piece[p] == k) {
          ++seen;
          EXPECT_EQ(truth.class_of[p], PixelClass::splash);
          // Rays that graze stop 1e-7 s above the surface: up to the root of 2 r 1e-7 early.
          EXPECT_NEAR(truth.depth[p], depth, 4e-4);
          const Vec3d normal = (truth.lens.point(i, j, truth.depth[p]) - centre) / 0.5;
          EXPECT_LT(length(truth.normal[p] - normal), 1e-3);
        } else {
          EXPECT_LT(truth.depth[p], depth) << "something else is nearer";
        }
      }
  }
  EXPECT_GT(seen, 500);
}

TEST(AccuracySplash, ClustersAreTheFieldsFirstCrossing) {
  const Scene& scene = find_scene("splash");
  const Truth& truth = truth_of("splash");
  const double level = density({{0, 0, 0}}, {0.3, 0, 0.4});
  EXPECT_NEAR(level, 0.229, 5e-4);
  // 1e-7 of piece_distance, whose unit is at least 1 / (6 pi) of the field.
  const double touch = 1e-7 * 6 / std::numbers::pi;
  for (std::size_t p = 0; p < truth.depth.size(); ++p) {
    EXPECT_EQ(truth.piece[p] >= 0, truth.class_of[p] == PixelClass::splash);
    if (truth.piece[p] < 0) continue;
    const Piece& piece = scene.splash[truth.piece[p]];
    EXPECT_NEAR(density(piece, truth.lens.point(p, truth.depth[p])), level, touch);
    for (double back = 0.01; back < 4; back += 0.05)
      EXPECT_LT(density(piece, truth.lens.point(p, truth.depth[p] - back)), level);
  }
}

TEST(AccuracySplash, MostPiecesAreSeenWithEverySeed) {
  const Scene& scene = find_scene("splash");
  for (const std::uint64_t seed : {1, 2, 3, 1001, 1002, 1003}) {
    const Truth truth = trace(scene, lens_of(scaled(posed(scene, seed), 6)));
    EXPECT_EQ(truth.splash_pieces, 16);
    std::vector<int> pixels(truth.splash_pieces);
    for (const int piece : truth.piece)
      if (piece >= 0) ++pixels[piece];
    EXPECT_GE(std::count_if(pixels.begin(), pixels.end(), [](int n) { return n > 12; }), 12)
        << seed;
  }
}

TEST(AccuracySplash, ParticlesAreWhereTheTruthIs) {
  const Scene& scene = find_scene("splash");
  const Particles particles = make_particles(scene, 0.05, 4);
  std::size_t k = particles.size();
  for (auto piece = scene.splash.rbegin(); piece != scene.splash.rend(); ++piece)
    for (auto p = piece->rbegin(); p != piece->rend(); ++p) {
      --k;
      EXPECT_EQ(particles.x[k], static_cast<float>(p->x));
      EXPECT_EQ(particles.y[k], static_cast<float>(p->y));
      EXPECT_EQ(particles.z[k], static_cast<float>(p->z));
    }
  EXPECT_EQ(k, static_cast<std::size_t>(std::llround(volume(scene))));
}

TEST(AccuracyFilling, ThinPartsGetTheirMass) {
  // twolayer's plate is 20 x 20 x 3 s and floats above z = 2; the pool ends at z = 0.
  int plate = 0;
  for (const Vec3d& p : fill(find_scene("twolayer"), 2)) plate += p.z > 1;
  // 480 of the 1200 are drawn one by one: five times the root of that.
  EXPECT_NEAR(plate, 1200, 5 * std::sqrt(480.));
}

TEST(AccuracyFilling, AtRandomFillsTheSolidEvenlyUpToItsSurface) {
  const Scene& scene = find_scene("box");
  const std::vector<Vec3d> points = at_random(scene, 3);
  const double expected = volume(scene);
  EXPECT_NEAR(static_cast<double>(points.size()), expected, 5 * std::sqrt(expected));
  double nearest = 1;
  for (const Vec3d& p : points) {
    ASSERT_LT(scene.distance(p), 0);
    nearest = std::min(nearest, -scene.distance(p));
  }
  EXPECT_LT(nearest, 0.05);
  EXPECT_EQ(at_random(scene, 3).front().x, points.front().x);
  EXPECT_NE(at_random(scene, 4).front().x, points.front().x);
}

}  // namespace
}  // namespace meniscus::accuracy
