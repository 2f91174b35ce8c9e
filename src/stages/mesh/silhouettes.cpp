#include "stages/mesh/silhouettes.hpp"

#include <cmath>

namespace meniscus {

std::vector<SilhouetteEdge> bisect_silhouettes(const SurfaceMap& nodes,
                                               std::vector<SilhouetteEdge> edges, double z_max,
                                               const SampleNear& sample) {
  const std::size_t n = edges.size();
  if (n == 0) return edges;
  const SampleGrid& grid = nodes.grid;
  const auto pixel = [&](std::int32_t node, bool vertical) {
    return grid.first + grid.step * static_cast<float>(vertical ? node / grid.nx : node % grid.nx);
  };
  std::vector<float> inside(n, 0.0f), outside(n, 1.0f);
  for (SilhouetteEdge& edge : edges)
    edge.surface = {nodes.depth[edge.front], nodes.normal[edge.front]};
  constexpr int kBisections = 6;
  for (int round = 0; round < kBisections; ++round) {
    std::vector<float> points(2 * n), near(n);
    for (std::size_t e = 0; e < n; ++e) {
      const float s = 0.5f * (inside[e] + outside[e]);
      for (const bool vertical : {false, true}) {
        const float from = pixel(edges[e].front, vertical), to = pixel(edges[e].back, vertical);
        points[(vertical ? n : 0) + e] = from + s * (to - from);
      }
      near[e] = edges[e].surface.depth;
    }
    const std::vector<SurfaceSample> found = sample(points, near);
    for (std::size_t e = 0; e < n; ++e) {
      const float s = 0.5f * (inside[e] + outside[e]);
      if (std::abs(found[e].depth - edges[e].surface.depth) < z_max) {
        inside[e] = s;
        edges[e].surface = found[e];
      } else {
        outside[e] = s;
      }
    }
  }
  for (std::size_t e = 0; e < n; ++e) edges[e].cut = inside[e];
  return edges;
}

}  // namespace meniscus
