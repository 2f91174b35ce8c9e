// Delaunay on exact properties, and which triangles are dropped or ghosts.
#include "stages/sheet/triangulate.hpp"

#include <gmock/gmock.h>

#include <Eigen/Dense>
#include <algorithm>
#include <array>
#include <map>
#include <set>

#include "stages/stage_test_support.hpp"
#include "verify/stage_cases/mesh_by_hand.hpp"

namespace meniscus {
namespace {

using testing::ElementsAre;
using testing::IsEmpty;

// Points have small whole coordinates, so that these determinants are exact.
using Whole = std::pair<std::int64_t, std::int64_t>;

std::vector<ScreenPoint> points_of(const std::vector<Whole>& whole) {
  std::vector<ScreenPoint> points;
  for (const auto& [u, v] : whole)
    points.push_back({static_cast<double>(u), static_cast<double>(v)});
  return points;
}

std::int64_t turn(const Whole& a, const Whole& b, const Whole& c) {
  return (b.first - a.first) * (c.second - a.second) - (b.second - a.second) * (c.first - a.first);
}

// Positive when d lies inside the circle through a, b, c, which turn positively.
std::int64_t in_circle(const Whole& a, const Whole& b, const Whole& c, const Whole& d) {
  const auto row = [&](const Whole& p) {
    const std::int64_t x = p.first - d.first, y = p.second - d.second;
    return std::array<std::int64_t, 3>{x, y, x * x + y * y};
  };
  const auto p = row(a), q = row(b), r = row(c);
  return p[0] * (q[1] * r[2] - q[2] * r[1]) - p[1] * (q[0] * r[2] - q[2] * r[0]) +
         p[2] * (q[0] * r[1] - q[1] * r[0]);
}

// Twice the area of the convex hull (Andrew's monotone chain).
std::int64_t doubled_hull(std::vector<Whole> points) {
  std::sort(points.begin(), points.end());
  points.erase(std::unique(points.begin(), points.end()), points.end());
  std::vector<Whole> hull;
  for (int side = 0; side < 2; ++side) {
    const std::size_t first = hull.size();
    for (const Whole& p : points) {
      while (hull.size() >= first + 2 && turn(hull[hull.size() - 2], hull.back(), p) <= 0)
        hull.pop_back();
      hull.push_back(p);
    }
    hull.pop_back();
    std::reverse(points.begin(), points.end());
  }
  std::int64_t area = 0;
  for (std::size_t k = 0; k < hull.size(); ++k)
    area += turn({0, 0}, hull[k], hull[(k + 1) % hull.size()]);
  return area;
}

void expect_delaunay(const std::vector<Whole>& points) {
  const auto triangles = delaunay(points_of(points));
  std::int64_t area = 0, winding = 0;
  std::set<Whole> used;
  for (const auto& t : triangles) {
    Whole a = points[t[0]], b = points[t[1]], c = points[t[2]];
    const std::int64_t doubled = turn(a, b, c);
    ASSERT_NE(doubled, 0);
    if (winding == 0) winding = doubled > 0 ? 1 : -1;
    EXPECT_GT(doubled * winding, 0) << "all wound the same way";
    area += std::abs(doubled);
    if (doubled < 0) std::swap(b, c);
    for (const Whole& p : points) EXPECT_LE(in_circle(a, b, c, p), 0);
    used.insert({a, b, c});
    EXPECT_LT(t[0], t[1]);
    EXPECT_LT(t[0], t[2]);
  }
  EXPECT_TRUE(std::is_sorted(triangles.begin(), triangles.end()));
  EXPECT_EQ(area, doubled_hull(points)) << "the triangles cover the hull once";
  EXPECT_EQ(used, std::set<Whole>(points.begin(), points.end())) << "every point is a vertex";
}

// The triangles as places, so that sets in another order can be compared.
std::set<std::set<Whole>> places(const std::vector<Whole>& points) {
  std::set<std::set<Whole>> result;
  for (const auto& t : delaunay(points_of(points)))
    result.insert({points[t[0]], points[t[1]], points[t[2]]});
  return result;
}

std::vector<Whole> random_points(std::size_t n, std::int64_t range, unsigned seed) {
  Random random(seed);
  std::vector<Whole> points;
  for (std::size_t k = 0; k < n; ++k)
    points.emplace_back(static_cast<std::int64_t>(random(0, static_cast<double>(range))),
                        static_cast<std::int64_t>(random(0, static_cast<double>(range))));
  return points;
}

std::vector<Whole> lattice(std::int64_t nu, std::int64_t nv, std::int64_t step) {
  std::vector<Whole> points;
  for (std::int64_t j = 0; j < nv; ++j)
    for (std::int64_t i = 0; i < nu; ++i) points.emplace_back(i * step, j * step);
  return points;
}

TEST(Delaunay, NoPointLiesInACircumcircle) {
  expect_delaunay(random_points(3, 100, 1));
  expect_delaunay(random_points(120, 1000, 2));
  expect_delaunay(random_points(120, 12, 3));  // many on one place, many cocircular
  expect_delaunay(lattice(9, 7, 10));
}

TEST(Delaunay, DoesNotDependOnTheOrder) {
  for (std::vector<Whole> points :
       {random_points(150, 1000, 4), lattice(9, 8, 3), random_points(150, 14, 5)}) {
    const auto expected = places(points);
    std::mt19937 random(6);
    for (int k = 0; k < 5; ++k) {
      for (std::size_t i = points.size() - 1; i > 0; --i)
        std::swap(points[i], points[random() % (i + 1)]);
      EXPECT_EQ(places(points), expected);
    }
    std::reverse(points.begin(), points.end());
    EXPECT_EQ(places(points), expected);
  }
}

TEST(Delaunay, OfEqualPointsTheFirstIsUsed) {
  const auto triangles = delaunay(points_of({{0, 0}, {4, 0}, {0, 0}, {0, 4}, {4, 0}, {0, 4}}));
  ASSERT_EQ(triangles.size(), 1u);
  std::array<std::int32_t, 3> corners = triangles[0];
  std::sort(corners.begin(), corners.end());
  EXPECT_THAT(corners, ElementsAre(0, 1, 3));
}

std::vector<std::int32_t> some_of(std::size_t n, double share, unsigned seed) {
  Random random(seed);
  std::vector<std::int32_t> some;
  for (std::size_t k = 0; k < n; ++k)
    if (random(0, 1) < share) some.push_back(static_cast<std::int32_t>(k));
  return some;
}

using Triangles = std::vector<std::array<std::int32_t, 3>>;

// The triangles at each point, by their points.
std::map<Whole, std::set<std::array<Whole, 3>>> around_each(
    const std::vector<Whole>& points, const std::vector<std::array<std::int32_t, 3>>& triangles) {
  std::map<Whole, std::set<std::array<Whole, 3>>> around;
  for (const Whole& p : points) around[p];
  for (const auto& t : triangles) {
    std::array<Whole, 3> corners{points[t[0]], points[t[1]], points[t[2]]};
    std::sort(corners.begin(), corners.end());
    for (const Whole& p : corners) around[p].insert(corners);
  }
  return around;
}

// Points go in two steps, and what is left is as if they had never been there: at random places, on
// lattices (every square is cocircular), on a circle, and with several points at one place.
TEST(Delaunay, ForgetsPointsThatAreRemoved) {
  std::vector<Whole> circle;
  for (const auto& [x, y] : lattice(131, 131, 1))
    if ((x - 65) * (x - 65) + (y - 65) * (y - 65) == 65 * 65) circle.emplace_back(x, y);
  ASSERT_EQ(circle.size(), 36u);
  circle.emplace_back(65, 65);
  auto doubled = random_points(60, 40, 3);
  doubled.insert(doubled.end(), doubled.begin(), doubled.begin() + 20);
  std::size_t others = 0;
  for (const auto& points : {random_points(300, 1000, 1), random_points(300, 30, 2),
                             lattice(15, 15, 4), lattice(40, 4, 1), circle, doubled}) {
    const bool distinct = std::set(points.begin(), points.end()).size() == points.size();
    for (const double share : {0.02, 0.1, 0.5, 0.95})
      for (unsigned seed = 1; seed <= 8; ++seed) {
        ScreenDelaunay net(points_of(points));
        auto left = points;
        for (unsigned step = 0; step < 2; ++step) {
          const auto gone = some_of(left.size(), share, 10 * seed + step);
          const auto before = around_each(left, net.triangles());
          const ScreenDelaunay::Changes changes = net.remove(gone);
          const auto& changed = changes.points;
          for (auto k = gone.rbegin(); k != gone.rend(); ++k) left.erase(left.begin() + *k);
          ASSERT_EQ(net.triangles(), delaunay(points_of(left)))
              << points.size() << " points, share " << share << ", seed " << seed;
          // Whose triangles are others now is told, and not everybody where few went.
          ASSERT_TRUE(std::is_sorted(changed.begin(), changed.end()));
          Triangles around_changed = net.triangles();
          std::erase_if(around_changed, [&](const auto& t) {
            return std::none_of(t.begin(), t.end(), [&](std::int32_t i) {
              return std::binary_search(changed.begin(), changed.end(), i);
            });
          });
          ASSERT_EQ(changes.triangles, around_changed);
          if (distinct && share < 0.05) others += left.size() - changed.size();
          if (!distinct) continue;
          const auto after = around_each(left, net.triangles());
          for (std::size_t k = 0; k < left.size(); ++k)
            if (!std::binary_search(changed.begin(), changed.end(), static_cast<std::int32_t>(k))) {
              ASSERT_EQ(after.at(left[k]), before.at(left[k])) << k;
            }
        }
      }
  }
  EXPECT_GT(others, 1000u);
}

// Strips that are cut through everything, some of them empty, tell what one triangulation of all
// points tells: lattices, points at one place, a hole, a crowd beside a few, and a line.
TEST(Delaunay, StripsGiveTheSameTriangles) {
  auto hole = random_points(3000, 1000, 7);
  std::erase_if(hole, [](const Whole& p) {
    const std::int64_t u = p.first - 500, v = p.second - 500;
    return u * u + v * v < 250 * 250;
  });
  std::vector<Whole> columns = lattice(2, 400, 100);
  for (Whole& p : columns) p.second /= 100;
  for (const std::int64_t low : {0, 3000})  // the circles between them reach beyond the margin
    for (std::int64_t v = low; v < low + 21; ++v) columns.emplace_back(5000, v);
  auto crowd = random_points(2000, 100, 8);
  for (const Whole& p : random_points(50, 4000, 9)) crowd.push_back(p);
  for (const auto& points :
       {random_points(4000, 100000, 4), random_points(3000, 40, 5), lattice(60, 40, 4),
        lattice(500, 3, 1), lattice(300, 1, 1), lattice(1, 300, 1), columns, hole, crowd,
        random_points(5, 10, 6), random_points(1, 10, 6), std::vector<Whole>{}}) {
    ScreenDelaunay one(points_of(points), 1);
    for (const std::size_t strips : {2u, 3u, 8u, 40u}) {
      ScreenDelaunay net(points_of(points), strips);
      ASSERT_EQ(net.triangles(), one.triangles()) << points.size() << " points, " << strips;
    }
  }
}

TEST(Delaunay, FewOrCollinearPointsGiveNoTriangle) {
  EXPECT_THAT(delaunay({}), IsEmpty());
  EXPECT_THAT(delaunay(points_of({{1, 2}})), IsEmpty());
  EXPECT_THAT(delaunay(points_of({{1, 2}, {3, 4}})), IsEmpty());
  EXPECT_THAT(delaunay(points_of({{1, 2}, {1, 2}, {1, 2}, {1, 2}})), IsEmpty());
  EXPECT_THAT(delaunay(points_of({{0, 0}, {5, 5}, {1, 1}, {3, 3}, {2, 2}})), IsEmpty());
  EXPECT_THAT(delaunay(points_of({{7, 0}, {7, 9}, {7, 3}})), IsEmpty());
}

// Rules of 2.2, step 2, on one triangle: defaults are max_edge 5.2 and d_max 6.
std::vector<TriangleKind> kinds(const std::vector<Vec3d>& uvt) {
  return triangulated(place(uvt)).kind;
}

TEST(Triangulate, KeepsGhostsAndDropsByEdgeAndDepthRange) {
  EXPECT_THAT(kinds({{10, 10, 20}, {15, 10, 20}, {10, 11, 20}}), ElementsAre(TriangleKind::kept));
  EXPECT_THAT(kinds({{10, 10, 20}, {15.3, 10, 20}, {10, 11, 20}}), IsEmpty());
  EXPECT_THAT(kinds({{10, 10, 20}, {12, 10, 25.9}, {10, 12, 22}}), ElementsAre(TriangleKind::kept));
  EXPECT_THAT(kinds({{10, 10, 20}, {12, 10, 26.1}, {10, 12, 22}}),
              ElementsAre(TriangleKind::ghost));
  // The edge's length is that on the screen: depth does not add to it, and the rule comes first.
  EXPECT_THAT(kinds({{10, 10, 20}, {15.3, 10, 40}, {10, 11, 20}}), IsEmpty());
}

TEST(Triangulate, EdgesAreMeasuredInCommonRadii) {
  // Particles of half the common radius span half the pixels; their neighbourhood is not stretched.
  Projected p = place({{10, 10, 20}, {15, 10, 20}, {10, 11, 20}});
  for (std::size_t i = 0; i < 3; ++i) p.ku[i] = p.kv[i] = p.scale[i] = 0.5f;
  EXPECT_THAT(triangulated(p).kind, ElementsAre(TriangleKind::kept));
}

TEST(Triangulate, NormalsFaceTheCameraAndAreasAreThoseInSpace) {
  // Eye space: (0, 0, -20), (3, 0, -20), (0, -4, -23).
  const Triangulation mesh = triangulated(place({{50, 50, 20}, {53, 50, 20}, {50, 54, 23}}));
  ASSERT_EQ(mesh.triangle.size(), 1u);
  EXPECT_DOUBLE_EQ(mesh.area[0], 0.5 * 3 * 5);
  EXPECT_NEAR(length(mesh.normal[0] - Vec3d{0, -0.6, 0.8}), 0, 1e-12);
}

TEST(Triangulate, FansListTheKeptTrianglesAroundEachVertex) {
  Random random(9);
  const Projected p = field(9, 8, [&](double, double) { return random(20, 28); });
  const Triangulation mesh = triangulated(p);
  EXPECT_TRUE(std::count(mesh.kind.begin(), mesh.kind.end(), TriangleKind::ghost) > 0);
  ASSERT_EQ(mesh.fan_start.size(), mesh.position.size() + 1);
  for (std::size_t v = 0; v < mesh.position.size(); ++v) {
    std::vector<std::int32_t> expected;
    for (std::size_t t = 0; t < mesh.triangle.size(); ++t)
      if (mesh.kind[t] == TriangleKind::kept &&
          std::count(mesh.triangle[t].begin(), mesh.triangle[t].end(), static_cast<int>(v)))
        expected.push_back(static_cast<std::int32_t>(t));
    EXPECT_EQ(std::vector<std::int32_t>(mesh.fan.begin() + mesh.fan_start[v],
                                        mesh.fan.begin() + mesh.fan_start[v + 1]),
              expected);
  }
}

// How far vertex v lies behind the plane through its ring, less the ring's own RMS distance from
// it.
double depth_of_pit(const Triangulation& mesh, std::size_t v) {
  std::set<std::int32_t> ring;
  for (std::int32_t f = mesh.fan_start[v]; f < mesh.fan_start[v + 1]; ++f)
    ring.insert(mesh.triangle[mesh.fan[f]].begin(), mesh.triangle[mesh.fan[f]].end());
  ring.erase(static_cast<std::int32_t>(v));
  if (ring.size() < 4) return -1;
  Eigen::MatrixXd points(3, static_cast<Eigen::Index>(ring.size()));
  Eigen::Index k = 0;
  for (const std::int32_t w : ring) {
    const Vec3d& p = mesh.position[w];
    points.col(k++) = Eigen::Vector3d(p.x, p.y, p.z);
  }
  const Eigen::Vector3d middle = points.rowwise().mean();
  points.colwise() -= middle;
  const Eigen::JacobiSVD<Eigen::MatrixXd> svd(points, Eigen::ComputeFullU);
  Eigen::Vector3d normal = svd.matrixU().col(2);
  if (normal.z() < 0) normal = -normal;  // the camera looks down -z
  const Vec3d& p = mesh.position[v];
  return -(Eigen::Vector3d(p.x, p.y, p.z) - middle).dot(normal) -
         svd.singularValues()[2] / std::sqrt(static_cast<double>(ring.size()));
}

// What triangulate_without_pits() should leave: all in pits go, round after round.
struct Plain {
  Visible left;
  int rounds = 0, pits = 0, shallow = 0;
};

Plain without_pits(const Projected& p) {
  Plain plain{all_visible(p)};
  for (; plain.rounds < 3; ++plain.rounds) {
    const Triangulation mesh = triangulate(plain_view(), p, plain.left, {});
    Visible rest;
    for (std::size_t v = 0; v < plain.left.index.size(); ++v) {
      const double depth = depth_of_pit(mesh, v);
      EXPECT_GT(std::abs(depth - 0.9), 1e-9) << "rounding would decide";
      plain.pits += depth > 0.9;
      plain.shallow += depth > 0.4 && depth <= 0.9;
      if (depth > 0.9) continue;
      rest.index.push_back(plain.left.index[v]);
      rest.owned.push_back(plain.left.owned[v]);
    }
    if (rest.index.size() == plain.left.index.size()) break;
    plain.left = rest;
  }
  return plain;
}

TEST(WithoutPits, LeavesOutWhatLiesFarBehindItsRing) {
  Random random(4);
  int pits = 0, shallow = 0;
  for (unsigned seed = 1; seed <= 3; ++seed) {
    const Projected p = field(36, seed, [&](double u, double v) {
      const double t = 25 + 0.4 * u + std::cos(0.3 * v);
      return random(0, 1) < 0.1 ? t + random(-2, 2) : t + random(-0.1, 0.1);
    });
    const Plain plain = without_pits(p);
    pits += plain.pits;
    shallow += plain.shallow;
    const Visible kept = triangulate_without_pits(plain_view(), p, all_visible(p), {}).visible;
    EXPECT_EQ(kept.index, plain.left.index);
    EXPECT_EQ(kept.owned, plain.left.owned);
  }
  EXPECT_GT(pits, 20);
  EXPECT_GT(shallow, 20);
}

TEST(WithoutPits, GoOneAfterTheOtherAsIfTheyHadNeverBeenThere) {
  Random random(12);
  const Projected p = field(30, 2, [&](double u, double v) {
    const double t = 25 + std::sin(0.3 * u) + std::cos(0.3 * v);
    return random(0, 1) < 0.15 ? t + random(1, 4) : t;
  });
  const Plain plain = without_pits(p);
  EXPECT_GT(plain.rounds, 1);
  const auto [visible, mesh] = triangulate_without_pits(plain_view(), p, all_visible(p), {});
  EXPECT_EQ(visible.index, plain.left.index);
  const Triangulation expected = triangulate(plain_view(), p, plain.left, {});
  EXPECT_EQ(mesh.particle, expected.particle);
  EXPECT_EQ(mesh.triangle, expected.triangle);
  EXPECT_EQ(mesh.kind, expected.kind);
  EXPECT_EQ(mesh.normal, expected.normal);
  EXPECT_EQ(mesh.area, expected.area);
  EXPECT_EQ(mesh.fan, expected.fan);
  EXPECT_EQ(mesh.fan_start, expected.fan_start);
}

TEST(WithoutPits, ARingOfThreeTellsNothing) {
  const Projected p = place({{10, 10, 20}, {14, 10, 20}, {12, 13, 20}, {12, 11, 23}});
  const SeenMesh seen = triangulate_without_pits(plain_view(), p, all_visible(p), {});
  EXPECT_EQ(seen.visible.index.size(), 4u);
}

TEST(Triangulate, FewParticlesGiveNothing) {
  EXPECT_THAT(kinds({}), IsEmpty());
  EXPECT_THAT(kinds({{10, 10, 20}}), IsEmpty());
  EXPECT_THAT(kinds({{10, 10, 20}, {12, 10, 20}}), IsEmpty());
  EXPECT_THAT(kinds({{10, 10, 20}, {10, 10, 21}, {10, 10, 22}}), IsEmpty());
  EXPECT_THAT(kinds({{10, 10, 20}, {12, 12, 21}, {14, 14, 22}}), IsEmpty());
}

}  // namespace
}  // namespace meniscus
