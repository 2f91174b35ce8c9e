#include "stages/mesh/silhouettes.hpp"

#include <cmath>
#include <string>

#include "meniscus/error.hpp"

namespace meniscus {

void check_nodes(const SurfaceMap& nodes) {
  require(nodes.grid.nx >= 0 && nodes.grid.ny >= 0 && nodes.depth.size() == nodes.grid.size() &&
              (nodes.normal.empty() || nodes.normal.size() == nodes.grid.size()),
          "mesh: the maps have " + std::to_string(nodes.depth.size()) + " depths and " +
              std::to_string(nodes.normal.size()) + " normals but the grid has " +
              std::to_string(nodes.grid.nx) + " x " + std::to_string(nodes.grid.ny) + " nodes");
}

std::vector<SilhouetteEdge> find_silhouette_edges(const SurfaceMap& nodes, double z_max) {
  check_nodes(nodes);
  require(z_max > 0, "mesh: z_max is " + std::to_string(z_max) + ", must be > 0");
  const int nx = nodes.grid.nx, ny = nodes.grid.ny;
  std::vector<SilhouetteEdge> edges;
  const auto test = [&](int a, int b) {
    const float da = nodes.depth[a], db = nodes.depth[b];
    if (!std::isfinite(da) && !std::isfinite(db)) return;
    if (std::isfinite(da) && std::isfinite(db) && std::abs(double{da} - db) <= z_max) return;
    const bool a_in_front = !std::isfinite(db) || (std::isfinite(da) && da < db);
    SilhouetteEdge edge;
    edge.front = a_in_front ? a : b;
    edge.back = a_in_front ? b : a;
    edges.push_back(edge);
  };
  for (int j = 0; j < ny; ++j)
    for (int i = 0; i < nx; ++i) {
      const int node = j * nx + i;
      if (i + 1 < nx) test(node, node + 1);
      if (j + 1 < ny) test(node, node + nx);
    }
  return edges;
}

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
