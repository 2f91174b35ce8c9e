// Voids: found where particles were taken out, and nowhere else.
#include "stages/closed/voids.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <random>

#include "base/parallel.hpp"
#include "stages/frame/density.hpp"

namespace meniscus {
namespace {

constexpr Disorder kAnywhere{.amount = 2};  // particles lie 2 / 1.4 apart

double spacing() { return kAnywhere.spacing / kAnywhere.unit(); }

// A lattice of 14 x 14 x 14 particles around the origin, without those that are left out.
template <class LeftOut>
std::vector<Vec3d> lattice_without(const LeftOut& left_out) {
  std::vector<Vec3d> points;
  for (int k = 0; k < 14; ++k)
    for (int j = 0; j < 14; ++j)
      for (int i = 0; i < 14; ++i) {
        const Vec3d at = Vec3d(i - 6.5, j - 6.5, k - 6.5) * spacing();
        if (!left_out(at)) points.push_back(at);
      }
  return points;
}

std::vector<Vec3d> voids_of(const std::vector<Vec3d>& points) {
  return find_voids(make_cells(points, kDensitySupport), kAnywhere);
}

TEST(Voids, WholeLatticeHasNone) {
  EXPECT_TRUE(voids_of(lattice_without([](const Vec3d&) { return false; })).empty());
}

TEST(Voids, HoleInsideIsOne) {
  const Vec3d hole(0.3, -0.2, 0.1);
  const double wide = 1.2 * spacing();
  const std::vector<Vec3d> voids =
      voids_of(lattice_without([&](const Vec3d& at) { return length(at - hole) < wide; }));
  ASSERT_FALSE(voids.empty());
  for (const Vec3d& at : voids) EXPECT_LT(length(at - hole), wide);
  for (std::size_t a = 0; a < voids.size(); ++a)
    for (std::size_t b = 0; b < a; ++b) EXPECT_GE(length(voids[a] - voids[b]), 0.999 * spacing());
}

// Air is no void, however wide a slit is. A notch has none but near its bottom, half a spacing
// below y = 0.
TEST(Voids, SlitsAndNotchesStayOpen) {
  for (const int layers : {1, 2, 4}) {
    const auto left_out = [&](const Vec3d& at) { return at.x > 0 && at.x < layers * spacing(); };
    EXPECT_TRUE(voids_of(lattice_without(left_out)).empty()) << layers;
    for (const Vec3d& at :
         voids_of(lattice_without([&](const Vec3d& at) { return left_out(at) && at.y > 0; })))
      EXPECT_LT(at.y, 2.1 * spacing()) << layers;
  }
}

// In the same order, whoever comes first and however many threads look.
TEST(Voids, DoNotDependOnOrderOrThreads) {
  std::mt19937 random(3);
  std::uniform_real_distribution<double> within(-20, 20);
  std::vector<Vec3d> points;
  for (int k = 0; k < 22000; ++k)
    points.emplace_back(within(random), within(random), within(random));
  const std::vector<Vec3d> voids = voids_of(points);
  ASSERT_GT(voids.size(), 100u);
  const auto same = [&](const std::vector<Vec3d>& other) {
    return std::equal(voids.begin(), voids.end(), other.begin(), other.end(),
                      [](const Vec3d& a, const Vec3d& b) { return length(a - b) == 0; });
  };
  EXPECT_TRUE(same(on_threads(1, [&] { return voids_of(points); })));
  std::shuffle(points.begin(), points.end(), random);
  EXPECT_TRUE(same(voids_of(points)));
}

// What lies farther away than void_influence() has no say.
TEST(Voids, DependOnWhatIsNear) {
  std::mt19937 random(4);
  std::uniform_real_distribution<double> within(-20, 20);
  std::vector<Vec3d> points, part;
  for (int k = 0; k < 22000; ++k)
    points.emplace_back(within(random), within(random), within(random));
  const double far = void_influence(kAnywhere);
  for (const Vec3d& at : points)
    if (at.x > -far) part.push_back(at);
  const auto own = [](std::vector<Vec3d> voids) {
    std::erase_if(voids, [](const Vec3d& at) { return at.x < 0; });
    return voids;
  };
  const std::vector<Vec3d> all = own(voids_of(points)), some = own(voids_of(part));
  ASSERT_EQ(all.size(), some.size());
  ASSERT_GT(all.size(), 50u);
  for (std::size_t k = 0; k < all.size(); ++k) EXPECT_EQ(length(all[k] - some[k]), 0);
}

}  // namespace
}  // namespace meniscus
