// Smoothed normals on exact properties.
#include "stages/sheet/smooth_normals.hpp"

#include <algorithm>

#include "stages/stage_test_support.hpp"
#include "verify/stage_cases/mesh_by_hand.hpp"

namespace meniscus {
namespace {

constexpr double kRounding = 1e-12;  // doubles: some tens of roundings of numbers near 1

double waves(double u, double v) { return 25 + 1.5 * std::sin(0.35 * u) + std::cos(0.5 * v); }

bool share_a_corner(const Triangulation& mesh, std::size_t t, std::size_t k) {
  for (const std::int32_t a : mesh.triangle[t])
    for (const std::int32_t b : mesh.triangle[k])
      if (a == b) return true;
  return false;
}

TEST(SmoothNormals, WeighNeighboursByAreaAndSimilarity) {
  Random random(3);
  const Triangulation mesh = triangulated(field(16, 2, [&](double u, double v) {
    return waves(u, v) + (u > 20 && v > 20 ? random(0, 7) : 0);
  }));
  ASSERT_GT(std::count(mesh.kind.begin(), mesh.kind.end(), TriangleKind::ghost), 0);
  const std::vector<Vec3d> actual = smooth_normals(mesh, 1);
  for (std::size_t t = 0; t < mesh.triangle.size(); ++t) {
    if (mesh.kind[t] != TriangleKind::kept) continue;
    Vec3d sum;
    for (std::size_t k = 0; k < mesh.triangle.size(); ++k) {
      if (share_a_corner(mesh, t, k) && mesh.kind[k] == TriangleKind::kept)
        sum += mesh.normal[k] *
               (mesh.area[k] * std::pow((1 + dot(mesh.normal[t], mesh.normal[k])) / 2, 16));
    }
    EXPECT_NEAR(length(actual[t] - normalized(sum)), 0, kRounding);
  }
}

// More triangles than a thread takes at a time.
TEST(SmoothNormals, DoNotDependOnHowTheWorkIsCut) {
  Random random(6);
  const Triangulation mesh =
      triangulated(field(40, 5, [&](double u, double v) { return waves(u, v) + random(0, 2); }));
  const std::vector<Vec3d> first = smooth_normals(mesh, 4);
  for (int run = 0; run < 5; ++run) EXPECT_EQ(smooth_normals(mesh, 4), first);
  Triangulation step = mesh;
  for (int round = 0; round < 4; ++round) step.normal = smooth_normals(step, 1);
  EXPECT_EQ(step.normal, first);
}

TEST(SmoothNormals, AroundSomeVerticesAreThoseOfAll) {
  Random random(8);
  const Triangulation mesh =
      triangulated(field(30, 3, [&](double u, double v) { return waves(u, v) + random(0, 2); }));
  for (const int rounds : {0, 1, 4}) {
    const std::vector<Vec3d> all = smooth_normals(mesh, rounds);
    std::size_t left = 0;
    for (const std::vector<std::int32_t>& vertices :
         {std::vector<std::int32_t>{}, {17}, {0, 17, 450, 451, 899}}) {
      const std::vector<Vec3d> some = smooth_normals(mesh, rounds, vertices);
      for (const std::int32_t v : vertices)
        for (std::int32_t f = mesh.fan_start[v]; f < mesh.fan_start[v + 1]; ++f)
          EXPECT_EQ(some[mesh.fan[f]], all[mesh.fan[f]]);
      if (vertices.empty()) {
        EXPECT_EQ(some, mesh.normal) << "none is asked for";
      } else {
        for (std::size_t t = 0; t < some.size(); ++t) left += some[t] == mesh.normal[t];
      }
    }
    EXPECT_GT(left, mesh.triangle.size()) << "most of both are left as they are";
  }
}

TEST(SmoothNormals, LeaveAPlaneAndRepeat) {
  const Triangulation plane = triangulated(field(6, 4, [](double u, double) { return 20 + u; }));
  for (const Vec3d& n : smooth_normals(plane, 3))
    // Positions are floats: a triangle of side 2 tilts by their rounding, 4e-6 at most.
    EXPECT_NEAR(length(n - normalized({1, 0, 1})), 0, 1e-5);
  Triangulation mesh = triangulated(field(6, 4, waves));
  EXPECT_EQ(smooth_normals(mesh, 0), mesh.normal);
  const std::vector<Vec3d> twice = smooth_normals(mesh, 2);
  mesh.normal = smooth_normals(mesh, 1);
  EXPECT_EQ(smooth_normals(mesh, 1), twice);
}

}  // namespace
}  // namespace meniscus
