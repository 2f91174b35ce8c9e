#include "stages/triangulate.hpp"

#include <Eigen/Eigenvalues>
#include <algorithm>

#include "parallel.hpp"

namespace meniscus {
namespace {

// Length of the screen edge a-b in particle radii, at the edge's mean scale.
double edge_length(const Projected& projected, const Triangulation& mesh, std::int32_t a,
                   std::int32_t b) {
  const std::size_t pa = mesh.particle[a], pb = mesh.particle[b];
  // Pixels per common radius: a particle's own size does not stretch its neighbourhood.
  const double ku =
      0.5 * (projected.ku[pa] / projected.scale[pa] + projected.ku[pb] / projected.scale[pb]);
  const double kv =
      0.5 * (projected.kv[pa] / projected.scale[pa] + projected.kv[pb] / projected.scale[pb]);
  return std::hypot((mesh.screen[a].u - mesh.screen[b].u) / ku,
                    (mesh.screen[a].v - mesh.screen[b].v) / kv);
}

// Whether vertex v lies in a pit of its ring.
bool is_pit(const View& view, const Triangulation& mesh, std::size_t v,
            const std::vector<std::int32_t>& ring) {
  constexpr double kDepth = 0.9;  // particle radii
  Vec3d middle;
  for (const std::int32_t w : ring) middle += mesh.position[w];
  middle = middle / static_cast<double>(ring.size());
  // No plane through the middle is farther than the middle is; the margin is for rounding.
  if (length(mesh.position[v] - middle) < 0.999 * kDepth) return false;
  Eigen::Matrix3d spread = Eigen::Matrix3d::Zero();
  for (const std::int32_t w : ring) {
    const Vec3d d = mesh.position[w] - middle;
    const double c[3] = {d.x, d.y, d.z};
    for (int i = 0; i < 3; ++i)
      for (int j = 0; j < 3; ++j) spread(i, j) += c[i] * c[j];
  }
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> axes(spread);
  Vec3d normal{axes.eigenvectors()(0, 0), axes.eigenvectors()(1, 0), axes.eigenvectors()(2, 0)};
  if (dot(normal, ray_direction(view, mesh.screen[v].u, mesh.screen[v].v)) > 0) normal = -normal;
  const double rms =
      std::sqrt(std::max(0.0, axes.eigenvalues()[0]) / static_cast<double>(ring.size()));
  return dot(mesh.position[v] - middle, normal) < -kDepth - rms;
}

}  // namespace

Triangulation triangulate(const View& view, const Projected& projected, const Visible& visible,
                          const TriangleParams& params) {
  Triangulation mesh;
  const std::size_t n = visible.index.size();
  for (std::size_t k = 0; k < n; ++k) {
    const std::size_t i = static_cast<std::size_t>(visible.index[k]);
    mesh.particle.push_back(visible.index[k]);
    mesh.position.push_back(projected.eye(i));
    mesh.screen.push_back({projected.u[i], projected.v[i]});
    mesh.owned.push_back(visible.owned[k]);
  }

  for (const auto& t : delaunay(mesh.screen)) {
    const Vec3d &a = mesh.position[t[0]], &b = mesh.position[t[1]], &c = mesh.position[t[2]];
    const double longest = std::max({edge_length(projected, mesh, t[0], t[1]),
                                     edge_length(projected, mesh, t[1], t[2]),
                                     edge_length(projected, mesh, t[2], t[0])});
    const double range = std::max({-a.z, -b.z, -c.z}) - std::min({-a.z, -b.z, -c.z});
    const TriangleKind kind = longest > params.max_edge ? TriangleKind::dropped
                              : range > params.d_max    ? TriangleKind::ghost
                                                        : TriangleKind::kept;
    if (kind == TriangleKind::dropped) continue;
    const Vec3d twice = cross(b - a, c - a);
    const Vec3d middle = (a + b + c) / 3;
    const PixelPosition at = project(view, middle);
    const Vec3d towards = -ray_direction(view, at.u, at.v);
    Vec3d normal = normalized(twice, normalized(towards));
    if (dot(normal, towards) < 0) normal = -normal;
    mesh.triangle.push_back(t);
    mesh.kind.push_back(kind);
    mesh.normal.push_back(normal);
    mesh.area.push_back(length(twice) / 2);
  }

  mesh.fan_start.assign(n + 1, 0);
  for (std::size_t t = 0; t < mesh.triangle.size(); ++t)
    if (mesh.kind[t] == TriangleKind::kept)
      for (const std::int32_t v : mesh.triangle[t]) ++mesh.fan_start[v + 1];
  for (std::size_t v = 0; v < n; ++v) mesh.fan_start[v + 1] += mesh.fan_start[v];
  mesh.fan.resize(mesh.fan_start[n]);
  std::vector<std::int32_t> next(mesh.fan_start.begin(), mesh.fan_start.end() - 1);
  for (std::size_t t = 0; t < mesh.triangle.size(); ++t)
    if (mesh.kind[t] == TriangleKind::kept)
      for (const std::int32_t v : mesh.triangle[t])
        mesh.fan[next[v]++] = static_cast<std::int32_t>(t);
  return mesh;
}

Visible without_pits(const View& view, const Triangulation& mesh, const Visible& visible) {
  const std::size_t n = mesh.position.size();
  std::vector<char> pit(n, 0);
  constexpr std::size_t kGrain = 256;  // vertices that are worth a thread
  parallel_for(n, kGrain, [&](std::size_t begin, std::size_t end) {
    std::vector<std::int32_t> ring;
    for (std::size_t v = begin; v < end; ++v) {
      ring.clear();
      for (std::int32_t f = mesh.fan_start[v]; f < mesh.fan_start[v + 1]; ++f)
        for (const std::int32_t w : mesh.triangle[mesh.fan[f]])
          if (w != static_cast<std::int32_t>(v)) ring.push_back(w);
      std::sort(ring.begin(), ring.end());
      ring.erase(std::unique(ring.begin(), ring.end()), ring.end());
      pit[v] = ring.size() >= 4 && is_pit(view, mesh, v, ring);
    }
  });
  Visible kept;
  for (std::size_t v = 0; v < n; ++v) {
    if (pit[v]) continue;
    kept.index.push_back(visible.index[v]);
    kept.owned.push_back(visible.owned[v]);
  }
  return kept;
}

}  // namespace meniscus
