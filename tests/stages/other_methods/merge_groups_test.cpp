// Triangles merged into groups, on exact properties.
#include "stages/other_methods/merge_groups.hpp"

#include <algorithm>
#include <numeric>
#include <set>

#include "stages/stage_test_support.hpp"
#include "verify/stage_cases/mesh_by_hand.hpp"

namespace meniscus {
namespace {

constexpr double kRounding = 1e-12;  // doubles: some tens of roundings of numbers near 1

double waves(double u, double v) { return 25 + 1.5 * std::sin(0.35 * u) + std::cos(0.5 * v); }

// Two planes that meet in a crease at u = 21, at +-40 degrees.
double roof(double u, double) { return 25 + std::abs(u - 21) * std::tan(40 * std::acos(-1) / 180); }

// How many corners two triangles share.
int shared_corners(const Triangulation& mesh, std::size_t t, std::size_t k) {
  int shared = 0;
  for (const std::int32_t a : mesh.triangle[t])
    for (const std::int32_t b : mesh.triangle[k]) shared += a == b;
  return shared;
}

// Each group as the set of its triangles, each the set of its particles' numbers.
using Partition = std::set<std::set<std::set<std::int32_t>>>;

Partition partition(const Triangulation& mesh, const Groups& groups,
                    const std::vector<std::int32_t>& number) {
  std::vector<std::set<std::set<std::int32_t>>> sets(groups.size());
  for (std::size_t t = 0; t < mesh.triangle.size(); ++t)
    if (groups.group_of_triangle[t] >= 0) {
      std::set<std::int32_t> corners;
      for (const std::int32_t v : mesh.triangle[t]) corners.insert(number[mesh.particle[v]]);
      sets[groups.group_of_triangle[t]].insert(corners);
    }
  return {sets.begin(), sets.end()};
}

TEST(MergeGroups, APlaneIsOneGroup) {
  const Triangulation mesh =
      triangulated(field(10, 5, [](double u, double v) { return 20 + 0.5 * u - 0.25 * v; }));
  const Groups groups = merge_groups(mesh, mesh.normal, {});
  ASSERT_EQ(groups.size(), 1u);
  EXPECT_EQ(groups.triangles[0], static_cast<std::int32_t>(mesh.triangle.size()));
  EXPECT_EQ(groups.point.size(), 100u);
  // Positions are floats below 40: 4e-6 at most, over triangles of side 2.
  EXPECT_NEAR(length(groups.normal[0] - normalized({0.5, 0.25, 1})), 0, 1e-5);
  Vec3d mean;
  for (const Vec3d& p : mesh.position) mean += p / 100;
  EXPECT_NEAR(length(groups.centre[0] - mean), 0, kRounding * 100);
  double radius = 0;
  for (const Vec3d& p : mesh.position) radius = std::max(radius, length(p - mean));
  EXPECT_NEAR(groups.radius[0], radius, kRounding * 100);
}

TEST(MergeGroups, ACreaseDividesTwoPlanes) {
  const Triangulation mesh = triangulated(field(12, 6, roof));
  const Groups groups = merge_groups(mesh, mesh.normal, {});
  // Triangles on either side are one group each; those across the crease lie in between.
  std::set<std::int32_t> left, right;
  for (std::size_t t = 0; t < mesh.triangle.size(); ++t) {
    double least = 100, most = 0;
    for (const std::int32_t v : mesh.triangle[t]) {
      least = std::min(least, mesh.screen[v].u);
      most = std::max(most, mesh.screen[v].u);
    }
    if (most < 21) left.insert(groups.group_of_triangle[t]);
    if (least > 21) right.insert(groups.group_of_triangle[t]);
  }
  EXPECT_EQ(left.size(), 1u);
  EXPECT_EQ(right.size(), 1u);
  EXPECT_NE(*left.begin(), *right.begin());
}

TEST(MergeGroups, NeighboursThatStayedApartFaceApart) {
  const Triangulation mesh = triangulated(field(14, 7, waves));
  for (const double cosine : {0.8, 0.95, 0.99}) {
    MergeParams params;
    params.cosine = cosine;
    const Groups groups = merge_groups(mesh, mesh.normal, params);
    EXPECT_GT(groups.size(), 1u);
    EXPECT_LT(groups.size(), mesh.triangle.size() / 2);
    std::vector<Vec3d> sum(groups.size());
    std::vector<std::set<std::int32_t>> members(groups.size());
    std::vector<std::int32_t> triangles(groups.size());
    for (std::size_t t = 0; t < mesh.triangle.size(); ++t) {
      const std::int32_t g = groups.group_of_triangle[t];
      if (g < 0) continue;
      sum[g] += mesh.normal[t] * mesh.area[t];
      members[g].insert(mesh.triangle[t].begin(), mesh.triangle[t].end());
      ++triangles[g];
      for (std::size_t k = 0; k < t; ++k) {
        const std::int32_t h = groups.group_of_triangle[k];
        if (shared_corners(mesh, t, k) < 2 || h < 0 || g == h) continue;
        EXPECT_LE(dot(groups.normal[g], groups.normal[h]), cosine + kRounding);
      }
    }
    EXPECT_EQ(triangles, groups.triangles);
    for (std::size_t g = 0; g < groups.size(); ++g) {
      EXPECT_NEAR(length(groups.normal[g] - normalized(sum[g])), 0, kRounding);
      EXPECT_EQ(std::vector<std::int32_t>(members[g].begin(), members[g].end()),
                std::vector<std::int32_t>(groups.point.begin() + groups.start[g],
                                          groups.point.begin() + groups.start[g + 1]));
    }
  }
}

// On a plane all normals agree, so that positions alone decide (2.2).
TEST(MergeGroups, GroupsFarApartDoNotMergeWherePositionsCount) {
  const Triangulation mesh = triangulated(field(14, 7, [](double, double) { return 25.0; }));
  EXPECT_EQ(merge_groups(mesh, mesh.normal, {}).size(), 1u);
  std::size_t before = mesh.triangle.size();
  for (const double distance : {2.0, 4.0, 8.0}) {
    MergeParams params;
    params.distance = distance;
    const Groups groups = merge_groups(mesh, mesh.normal, params);
    EXPECT_GT(groups.size(), 1u);
    EXPECT_LT(groups.size(), before) << "larger distances merge more";
    before = groups.size();
    std::vector<Vec3d> sum(groups.size());
    std::vector<double> area(groups.size());
    for (std::size_t t = 0; t < mesh.triangle.size(); ++t) {
      const std::int32_t g = groups.group_of_triangle[t];
      if (g < 0) continue;
      area[g] += mesh.area[t];
      for (const std::int32_t v : mesh.triangle[t]) sum[g] += mesh.position[v] * (mesh.area[t] / 3);
    }
    for (std::size_t t = 0; t < mesh.triangle.size(); ++t)
      for (std::size_t k = 0; k < t; ++k) {
        const std::int32_t g = groups.group_of_triangle[t], h = groups.group_of_triangle[k];
        if (shared_corners(mesh, t, k) < 2 || g < 0 || h < 0 || g == h) continue;
        EXPECT_GE(length(sum[g] / area[g] - sum[h] / area[h]), distance * (1 - kRounding));
      }
  }
}

TEST(MergeGroups, GhostsBelongToNoGroup) {
  const Triangulation mesh =
      triangulated(field(10, 8, [](double u, double) { return u < 20 ? 20.0 : 30.0; }));
  const Groups groups = merge_groups(mesh, mesh.normal, {});
  std::size_t ghosts = 0;
  for (std::size_t t = 0; t < mesh.triangle.size(); ++t) {
    EXPECT_EQ(groups.group_of_triangle[t] < 0, mesh.kind[t] == TriangleKind::ghost);
    ghosts += mesh.kind[t] == TriangleKind::ghost;
  }
  EXPECT_GT(ghosts, 0u);
  EXPECT_EQ(groups.size(), 2u) << "nothing merges across the gap";
}

TEST(MergeGroups, DoesNotDependOnTheOrderOfParticlesOrTriangles) {
  const Projected p = field(16, 9, waves);
  const std::size_t n = p.size();
  std::vector<std::int32_t> number(n);
  std::iota(number.begin(), number.end(), 0);
  const Triangulation mesh = triangulated(p);
  const Partition expected = partition(mesh, merge_groups(mesh, mesh.normal, {}), number);
  EXPECT_GT(expected.size(), 10u);
  std::mt19937 random(10);
  for (int round = 0; round < 3; ++round) {
    for (std::size_t i = n - 1; i > 0; --i) std::swap(number[i], number[random() % (i + 1)]);
    std::vector<Vec3d> uvt(n);
    for (std::size_t i = 0; i < n; ++i) uvt[i] = {p.u[number[i]], p.v[number[i]], -p.z[number[i]]};
    Triangulation other = triangulated(place(uvt));
    EXPECT_EQ(partition(other, merge_groups(other, other.normal, {}), number), expected);

    // The same triangles in another order.
    std::vector<std::size_t> order(other.triangle.size());
    std::iota(order.begin(), order.end(), 0);
    for (std::size_t i = order.size() - 1; i > 0; --i)
      std::swap(order[i], order[random() % (i + 1)]);
    Triangulation shuffled = other;
    for (std::size_t i = 0; i < order.size(); ++i) {
      shuffled.triangle[i] = other.triangle[order[i]];
      shuffled.kind[i] = other.kind[order[i]];
      shuffled.normal[i] = other.normal[order[i]];
      shuffled.area[i] = other.area[order[i]];
    }
    EXPECT_EQ(partition(shuffled, merge_groups(shuffled, shuffled.normal, {}), number), expected);
  }
}

TEST(MergeGroups, NoTrianglesGiveNoGroups) {
  const Triangulation mesh = triangulated(place({{10, 10, 20}, {12, 10, 20}}));
  const Groups groups = merge_groups(mesh, mesh.normal, {});
  EXPECT_EQ(groups.size(), 0u);
  EXPECT_EQ(groups.start, std::vector<std::int32_t>{0});
}

}  // namespace
}  // namespace meniscus
