// Silhouettes bisected on an analytic surface.
#include "stages/mesh/silhouettes.hpp"

#include <gtest/gtest.h>

#include <cmath>

#include "stages/mesh/mesh.hpp"

namespace meniscus {
namespace {

// A tilted disc in front of a plane: depth 10 + u / 32 within 13 pixels of (20, 17), else 40.
SurfaceSample show(double u, double v) {
  const bool front = std::hypot(u - 20, v - 17) < 13;
  return {front ? static_cast<float>(10 + u / 32) : 40.0f, {0, 0, 1}};
}

TEST(Silhouettes, AreCutWhereTheFrontLayerEnds) {
  SurfaceMap nodes;
  nodes.grid = {21, 18, 0, 2};
  for (int j = 0; j < nodes.grid.ny; ++j)
    for (int i = 0; i < nodes.grid.nx; ++i) {
      const SurfaceSample sample = show(2 * i, 2 * j);
      nodes.depth.push_back(sample.depth);
      nodes.normal.push_back(sample.normal);
    }
  const auto edges = find_silhouette_edges(nodes, 3);
  ASSERT_GT(edges.size(), 20u);
  const auto cut = bisect_silhouettes(
      nodes, edges, 3, [](const std::vector<float>& points, const std::vector<float>& near) {
        std::vector<SurfaceSample> samples;
        for (std::size_t k = 0; k < near.size(); ++k) {
          EXPECT_LT(near[k], 20);  // the front layer
          samples.push_back(show(points[k], points[near.size() + k]));
        }
        return samples;
      });
  ASSERT_EQ(cut.size(), edges.size());
  for (const SilhouetteEdge& edge : cut) {
    const double u = 2 * (edge.front % 21), v = 2 * (edge.front / 21);
    const double du = 2 * (edge.back % 21) - u, dv = 2 * (edge.back / 21) - v;
    // Where the circle ends along the edge: a quadratic.
    const double a = du * du + dv * dv, b = (u - 20) * du + (v - 17) * dv,
                 c = std::pow(u - 20, 2) + std::pow(v - 17, 2) - 169;
    const double end = (-b + std::sqrt(b * b - a * c)) / a;
    EXPECT_LE(edge.cut, end + 1e-6);
    EXPECT_GE(edge.cut, end - 1.0 / 64 - 1e-6);  // six bisections
    EXPECT_NEAR(edge.surface.depth, 10 + (u + edge.cut * du) / 32, 1e-5);
  }
}

}  // namespace
}  // namespace meniscus
