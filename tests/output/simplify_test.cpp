// Fewer triangles: closed, and as near as was asked for.
#include "output/simplify.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "accuracy/closed.hpp"
#include "base/parallel.hpp"
#include "meniscus/error.hpp"
#include "output/ring.hpp"
#include "stages/vec.hpp"

namespace meniscus {
namespace {

double to_segment(const Vec3d& p, const Vec3d& a, const Vec3d& b) {
  const double t = std::clamp(dot(p - a, b - a) / dot(b - a, b - a), 0.0, 1.0);
  return length(p - a - (b - a) * t);
}

double to_triangle(const Vec3d& p, const Vec3d& a, const Vec3d& b, const Vec3d& c) {
  const Vec3d n = cross(b - a, c - a);
  const bool inside = dot(cross(b - a, p - a), n) >= 0 && dot(cross(c - b, p - b), n) >= 0 &&
                      dot(cross(a - c, p - c), n) >= 0;
  if (inside) return std::abs(dot(p - a, n)) / length(n);
  return std::min({to_segment(p, a, b), to_segment(p, b, c), to_segment(p, c, a)});
}

// The farthest that a vertex of one mesh is from the other, units.
double farthest(const Mesh& from, const Mesh& to) {
  double most = 0;
  for (const Vec3& p : from.position) {
    double least = 1e30;
    for (const auto& t : to.triangle)
      least = std::min(least, to_triangle(Vec3d(p), Vec3d(to.position[t[0]]),
                                          Vec3d(to.position[t[1]]), Vec3d(to.position[t[2]])));
    most = std::max(most, least);
  }
  return most / kUnit;
}

void expect_closed(const Mesh& mesh, std::int64_t pieces) {
  const accuracy::ClosedFigures f = accuracy::check_topology(mesh);
  EXPECT_EQ(f.open_edges + f.bad_edges + f.bad_vertices, 0);
  EXPECT_EQ(f.pieces, pieces);
}

TEST(Simplify, FlatFacesTakeFewTrianglesAndCreasesStay) {
  const Mesh full = square_ring(240, 12, 0);
  const accuracy::ClosedFigures of_full = accuracy::check_topology(full);
  ASSERT_EQ(of_full.open_edges + of_full.bad_edges + of_full.bad_vertices, 0);
  const Mesh few = simplify(full, 0.05, kUnit);
  EXPECT_LT(5 * few.triangle.size(), full.triangle.size());
  expect_closed(few, of_full.pieces);
  EXPECT_LT(farthest(full, few), 0.0501);
  EXPECT_LT(farthest(few, full), 0.1);  // nothing sticks out either
  EXPECT_NEAR(accuracy::check_topology(few).volume / of_full.volume, 1, 1e-3);
}

TEST(Simplify, NoiseStaysClosedAndWithinTheTolerance) {
  for (const double noise : {0.2, 3.0}) {  // the latter turns triangles over
    SCOPED_TRACE(noise);
    const Mesh full = square_ring(120, 6, noise);
    for (const double tolerance : {0.05, 0.3}) {
      const Mesh few = simplify(full, tolerance, kUnit);
      EXPECT_LE(few.triangle.size(), full.triangle.size());
      expect_closed(few, 1);
      EXPECT_LT(farthest(full, few), tolerance + 1e-4);
    }
  }
}

TEST(Simplify, ValuesAreInterpolated) {
  const Mesh few = simplify(square_ring(240, 12, 0), 0.1, kUnit);
  ASSERT_EQ(few.velocity.size(), few.position.size());
  ASSERT_EQ(few.attributes.at(0).values.size(), few.position.size());
  ASSERT_EQ(few.normal.size(), few.position.size());
  for (std::size_t v = 0; v < few.position.size(); ++v) {
    EXPECT_NEAR(few.velocity[v].x, few.position[v].x, kUnit);
    EXPECT_NEAR(few.velocity[v].y, 2 * few.position[v].y, 2 * kUnit);
    EXPECT_NEAR(few.attributes[0].values[v], 3, 1e-5);
    EXPECT_NEAR(length(Vec3d(few.normal[v])), 1, 1e-5);
  }
}

TEST(Simplify, IsTheSameWithAnyThreads) {
  const Mesh full = square_ring(600, 12, 0.02);
  const Mesh few = simplify(full, 0.05, kUnit);
  const Mesh alone = on_threads(1, [&] { return simplify(full, 0.05, kUnit); });
  EXPECT_EQ(few.position, alone.position);
  EXPECT_EQ(few.normal, alone.normal);
  EXPECT_EQ(few.triangle, alone.triangle);
}

TEST(Simplify, WantsAClosedMesh) {
  EXPECT_TRUE(simplify({}, 0.05, kUnit).triangle.empty());
  Mesh open = square_ring(30, 3, 0);
  open.triangle.pop_back();
  EXPECT_THROW(simplify(open, 0.05, kUnit), InvalidArgument);
}

}  // namespace
}  // namespace meniscus
