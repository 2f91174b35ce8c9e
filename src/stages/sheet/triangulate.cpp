#include "stages/sheet/triangulate.hpp"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <numeric>
#include <utility>

#include "base/parallel.hpp"

namespace meniscus {
namespace {

using Triangles = std::vector<std::array<std::int32_t, 3>>;

// Pixels that a common radius spans at each vertex: a particle's own size does not stretch its
// neighbourhood.
std::vector<ScreenPoint> spans_of(const Projected& projected,
                                  const std::vector<std::int32_t>& particle) {
  std::vector<ScreenPoint> spans;
  spans.reserve(particle.size());
  for (const std::int32_t i : particle)
    spans.push_back({projected.ku[i] / projected.scale[i], projected.kv[i] / projected.scale[i]});
  return spans;
}

// Whether the screen edge a-b is longer than `most` particle radii, at the edge's mean scale.
bool is_longer(const std::vector<ScreenPoint>& screen, const std::vector<ScreenPoint>& spans,
               std::int32_t a, std::int32_t b, double most) {
  const double ku = 0.5 * (spans[a].u + spans[b].u), kv = 0.5 * (spans[a].v + spans[b].v);
  const double du = screen[a].u - screen[b].u, dv = screen[a].v - screen[b].v;
  // Decides without a division but for edges within rounding of the limit.
  const double across = du * kv, along = dv * ku, limit = most * ku * kv;
  const double squared = across * across + along * along, squared_limit = limit * limit;
  if (squared < 0.999 * squared_limit) return false;
  if (squared > 1.001 * squared_limit) return true;
  const double u = du / ku, v = dv / kv;
  return std::sqrt(u * u + v * v) > most;
}

// Whether vertex v lies in a pit of its ring, which is sorted here.
bool is_pit(const View& view, const Triangulation& mesh, std::size_t v,
            std::vector<std::int32_t>& ring) {
  constexpr double kDepth = 0.9;              // particle radii
  constexpr double kSurely = 0.999 * kDepth;  // the margin is for rounding
  const auto middle_of_ring = [&] {
    Vec3d middle;
    for (const std::int32_t w : ring) middle += mesh.position[w];
    return middle / static_cast<double>(ring.size());
  };
  // No plane through the middle is farther than the middle is.
  if (length(mesh.position[v] - middle_of_ring()) < kSurely) return false;
  std::sort(ring.begin(), ring.end());
  const Vec3d middle = middle_of_ring(), away = mesh.position[v] - middle;
  Eigen::Matrix3d spread = Eigen::Matrix3d::Zero();
  for (const std::int32_t w : ring) {
    const Vec3d d = mesh.position[w] - middle;
    const double c[3] = {d.x, d.y, d.z};
    for (int i = 0; i < 3; ++i)
      for (int j = 0; j < 3; ++j) spread(i, j) += c[i] * c[j];
  }
  // Nor farther than this from the plane that fits best, whose normal is the main axis of the
  // spread's adjugate A: (d.n)^2 <= d.Ad / (largest eigenvalue), which is at least tr(A^2) / tr(A).
  // Most are decided without the axes.
  Eigen::Matrix3d adjugate;
  for (int i = 0; i < 3; ++i) {
    const int j = (i + 1) % 3, k = (i + 2) % 3;
    adjugate.row(i) = spread.row(j).cross(spread.row(k));
  }
  const Eigen::Vector3d d(away.x, away.y, away.z);
  const double trace = adjugate.trace();
  if (trace > 1e-9 * spread.squaredNorm() &&
      d.dot(adjugate * d) * trace < kSurely * kSurely * adjugate.squaredNorm())
    return false;
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> axes(spread);
  Vec3d normal{axes.eigenvectors()(0, 0), axes.eigenvectors()(1, 0), axes.eigenvectors()(2, 0)};
  if (dot(normal, ray_direction(view, mesh.screen[v].u, mesh.screen[v].v)) > 0) normal = -normal;
  const double rms =
      std::sqrt(std::max(0.0, axes.eigenvalues()[0]) / static_cast<double>(ring.size()));
  return dot(away, normal) < -kDepth - rms;
}

// The vertices, and what is known of them.
Triangulation vertices_of(const Projected& projected, const Visible& visible) {
  Triangulation mesh;
  const std::size_t n = visible.index.size();
  mesh.particle = visible.index;
  mesh.owned = visible.owned;
  mesh.position.reserve(n);
  mesh.screen.reserve(n);
  for (const std::int32_t index : visible.index) {
    const std::size_t i = static_cast<std::size_t>(index);
    mesh.position.push_back(projected.eye(i));
    mesh.screen.push_back({projected.u[i], projected.v[i]});
  }
  return mesh;
}

// Takes the triangles that are not dropped, and are not there yet, beside those that are.
void take_triangles(const Projected& projected, const Triangles& triangles,
                    const TriangleParams& params, Triangulation& mesh) {
  const std::vector<ScreenPoint> spans = spans_of(projected, mesh.particle);
  const auto is_long = [&](std::int32_t a, std::int32_t b) {
    return is_longer(mesh.screen, spans, a, b, params.max_edge);
  };
  const Triangles had = std::exchange(mesh.triangle, {});
  const std::vector<TriangleKind> kind_had = std::exchange(mesh.kind, {});
  mesh.triangle.reserve(had.size() + triangles.size());
  mesh.kind.reserve(had.size() + triangles.size());
  std::size_t next = 0;
  const auto keep_before = [&](auto is_before) {
    for (; next < had.size() && is_before(had[next]); ++next) {
      mesh.triangle.push_back(had[next]);
      mesh.kind.push_back(kind_had[next]);
    }
  };
  for (const auto& t : triangles) {
    keep_before([&](const auto& other) { return other < t; });
    if (next < had.size() && had[next] == t) continue;
    if (is_long(t[0], t[1]) || is_long(t[1], t[2]) || is_long(t[2], t[0])) continue;
    const Vec3d &a = mesh.position[t[0]], &b = mesh.position[t[1]], &c = mesh.position[t[2]];
    const double range = std::max({-a.z, -b.z, -c.z}) - std::min({-a.z, -b.z, -c.z});
    mesh.triangle.push_back(t);
    mesh.kind.push_back(range > params.d_max ? TriangleKind::ghost : TriangleKind::kept);
  }
  keep_before([](const auto&) { return true; });
}

// Lists the kept triangles around each vertex.
void list_fans(Triangulation& mesh) {
  const std::size_t n = mesh.position.size();
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
}

// Drops some vertices, ascending, with their triangles; the others move up. Fans are not listed
// again.
void drop_vertices(const std::vector<std::int32_t>& gone, Triangulation& mesh) {
  std::vector<std::int32_t> place(mesh.particle.size(), 0);  // from now on
  for (const std::int32_t v : gone) place[v] = -1;
  std::size_t left = 0;
  for (std::size_t v = 0; v < place.size(); ++v) {
    if (place[v] < 0) continue;
    mesh.particle[left] = mesh.particle[v];
    mesh.owned[left] = mesh.owned[v];
    mesh.position[left] = mesh.position[v];
    mesh.screen[left] = mesh.screen[v];
    place[v] = static_cast<std::int32_t>(left++);
  }
  mesh.particle.resize(left);
  mesh.owned.resize(left);
  mesh.position.resize(left);
  mesh.screen.resize(left);
  std::size_t kept = 0;
  for (std::size_t t = 0; t < mesh.triangle.size(); ++t) {
    const auto& [a, b, c] = mesh.triangle[t];
    if (place[a] < 0 || place[b] < 0 || place[c] < 0) continue;
    mesh.kind[kept] = mesh.kind[t];
    mesh.triangle[kept++] = {place[a], place[b], place[c]};
  }
  mesh.triangle.resize(kept);
  mesh.kind.resize(kept);
}

void measure_triangles(const View& view, Triangulation& mesh) {
  const std::size_t n = mesh.triangle.size();
  mesh.normal.resize(n);
  mesh.area.resize(n);
  constexpr std::size_t kGrain = 1024;  // triangles that are worth a thread
  parallel_for(n, kGrain, [&](std::size_t begin, std::size_t end) {
    for (std::size_t t = begin; t < end; ++t) {
      const auto& corner = mesh.triangle[t];
      const Vec3d &a = mesh.position[corner[0]], &b = mesh.position[corner[1]],
                  &c = mesh.position[corner[2]];
      const Vec3d twice = cross(b - a, c - a);
      const Vec3d middle = (a + b + c) / 3;
      const PixelPosition at = project(view, middle);
      const Vec3d towards = -ray_direction(view, at.u, at.v);
      const Vec3d normal = normalized(twice, normalized(towards));
      mesh.normal[t] = dot(normal, towards) < 0 ? -normal : normal;
      mesh.area[t] = length(twice) / 2;
    }
  });
}

// Those of some vertices, ascending, that lie in a pit.
std::vector<std::int32_t> pits_among(const View& view, const Triangulation& mesh,
                                     const std::vector<std::int32_t>& vertices) {
  std::vector<char> pit(vertices.size(), 0);
  constexpr std::size_t kGrain = 256;  // vertices that are worth a thread
  parallel_for(vertices.size(), kGrain, [&](std::size_t begin, std::size_t end) {
    std::vector<std::int32_t> ring, ring_of(mesh.position.size(), -1);  // the last one it is in
    for (std::size_t k = begin; k < end; ++k) {
      const std::int32_t v = vertices[k];
      ring.clear();
      for (std::int32_t f = mesh.fan_start[v]; f < mesh.fan_start[v + 1]; ++f)
        for (const std::int32_t w : mesh.triangle[mesh.fan[f]])
          if (w != v && std::exchange(ring_of[w], v) != v) ring.push_back(w);
      pit[k] = ring.size() >= 4 && is_pit(view, mesh, static_cast<std::size_t>(v), ring);
    }
  });
  std::vector<std::int32_t> found;
  for (std::size_t k = 0; k < vertices.size(); ++k)
    if (pit[k]) found.push_back(vertices[k]);
  return found;
}

}  // namespace

Triangulation triangulate(const View& view, const Projected& projected, const Visible& visible,
                          const TriangleParams& params) {
  Triangulation mesh = vertices_of(projected, visible);
  take_triangles(projected, delaunay(mesh.screen), params, mesh);
  list_fans(mesh);
  measure_triangles(view, mesh);
  return mesh;
}

SeenMesh triangulate_without_pits(const View& view, const Projected& projected,
                                  const Visible& visible, const TriangleParams& params) {
  constexpr int kRounds = 3;
  Triangulation mesh = vertices_of(projected, visible);
  ScreenDelaunay net(mesh.screen);
  take_triangles(projected, net.triangles(), params, mesh);
  list_fans(mesh);
  std::vector<std::int32_t> changed(visible.index.size());  // vertices with other rings than before
  std::iota(changed.begin(), changed.end(), 0);
  for (int round = 0; round < kRounds; ++round) {
    const std::vector<std::int32_t> gone = pits_among(view, mesh, changed);
    if (gone.empty()) break;
    drop_vertices(gone, mesh);
    auto [points, triangles] = net.remove(gone);
    take_triangles(projected, triangles, params, mesh);
    list_fans(mesh);
    changed = std::move(points);
  }
  measure_triangles(view, mesh);
  Visible left{mesh.particle, mesh.owned, {}};
  return {std::move(left), std::move(mesh)};
}

}  // namespace meniscus
