#include "stages/other_methods/merge_groups.hpp"

#include <algorithm>
#include <limits>
#include <numeric>

namespace meniscus {
namespace {

struct Edge {
  std::int32_t a, b;  // groups, a < b
  bool operator==(const Edge&) const = default;
  auto operator<=>(const Edge&) const = default;
};

// Pairs of kept triangles that share an edge.
std::vector<Edge> neighbours(const Triangulation& mesh) {
  struct Side {
    std::int32_t from, to, triangle;
    auto operator<=>(const Side&) const = default;
  };
  std::vector<Side> sides;
  for (std::size_t t = 0; t < mesh.triangle.size(); ++t) {
    if (mesh.kind[t] != TriangleKind::kept) continue;
    for (int k = 0; k < 3; ++k) {
      const std::int32_t a = mesh.triangle[t][k], b = mesh.triangle[t][(k + 1) % 3];
      sides.push_back({std::min(a, b), std::max(a, b), static_cast<std::int32_t>(t)});
    }
  }
  std::sort(sides.begin(), sides.end());
  std::vector<Edge> edges;
  for (std::size_t s = 1; s < sides.size(); ++s)
    if (sides[s - 1].from == sides[s].from && sides[s - 1].to == sides[s].to)
      edges.push_back({sides[s - 1].triangle, sides[s].triangle});
  std::sort(edges.begin(), edges.end());
  return edges;
}

// Label of the merged group of each triangle; ghosts keep their own.
std::vector<std::int32_t> merge_labels(const Triangulation& mesh, const std::vector<Vec3d>& normals,
                                       const MergeParams& params) {
  const std::size_t n = mesh.triangle.size();
  std::vector<Vec3d> normal_sum(n), position_sum(n);  // area-weighted
  std::vector<double> area = mesh.area;
  for (std::size_t t = 0; t < n; ++t) {
    normal_sum[t] = normals[t] * area[t];
    for (const std::int32_t v : mesh.triangle[t])
      position_sum[t] += mesh.position[v] * (area[t] / 3);
  }
  // Whether two groups' centres are near each other (2.2: "similar normals and positions").
  const auto are_near = [&](const Edge& edge) {
    if (params.distance == 0) return true;
    const Vec3d apart = position_sum[edge.a] / area[edge.a] - position_sum[edge.b] / area[edge.b];
    return dot(apart, apart) < params.distance * params.distance;
  };
  std::vector<std::int32_t> label(n);
  std::iota(label.begin(), label.end(), 0);
  std::vector<Edge> edges = neighbours(mesh);
  std::vector<std::int32_t> best(n), into(n);
  std::vector<double> cost(n);
  for (;;) {
    std::fill(best.begin(), best.end(), -1);
    std::fill(cost.begin(), cost.end(), std::numeric_limits<double>::infinity());
    for (const Edge& edge : edges) {
      const double k = 1 - dot(normalized(normal_sum[edge.a]), normalized(normal_sum[edge.b]));
      if (!(k < 1 - params.cosine) || !are_near(edge)) continue;
      const auto offer = [&](std::int32_t to, std::int32_t other) {
        if (k < cost[to] || (k == cost[to] && other < best[to])) {
          cost[to] = k;
          best[to] = other;
        }
      };
      offer(edge.a, edge.b);
      offer(edge.b, edge.a);
    }
    std::iota(into.begin(), into.end(), 0);
    bool merged = false;
    for (const Edge& edge : edges) {
      if (best[edge.a] != edge.b || best[edge.b] != edge.a || into[edge.b] != edge.b) continue;
      into[edge.b] = edge.a;
      normal_sum[edge.a] += normal_sum[edge.b];
      position_sum[edge.a] += position_sum[edge.b];
      area[edge.a] += area[edge.b];
      merged = true;
    }
    if (!merged) return label;
    for (std::int32_t& l : label) l = into[l];
    std::vector<Edge> left;
    for (const Edge& edge : edges) {
      const std::int32_t a = into[edge.a], b = into[edge.b];
      if (a != b) left.push_back({std::min(a, b), std::max(a, b)});
    }
    edges.swap(left);
    std::sort(edges.begin(), edges.end());
    edges.erase(std::unique(edges.begin(), edges.end()), edges.end());
  }
}

}  // namespace

Groups merge_groups(const Triangulation& mesh, const std::vector<Vec3d>& normals,
                    const MergeParams& params) {
  const std::vector<std::int32_t> label = merge_labels(mesh, normals, params);
  Groups groups;
  groups.group_of_triangle.assign(mesh.triangle.size(), -1);

  // Members of each label, labels ascending (a label is its group's lowest triangle).
  std::vector<std::int32_t> members;
  for (std::size_t t = 0; t < mesh.triangle.size(); ++t)
    if (mesh.kind[t] == TriangleKind::kept) members.push_back(static_cast<std::int32_t>(t));
  std::stable_sort(members.begin(), members.end(),
                   [&](std::int32_t a, std::int32_t b) { return label[a] < label[b]; });

  std::vector<std::int32_t> seen(mesh.position.size(), -1);  // last group that took the vertex
  groups.start.push_back(0);
  for (std::size_t first = 0; first < members.size();) {
    std::size_t last = first;
    while (last < members.size() && label[members[last]] == label[members[first]]) ++last;
    const std::int32_t g = static_cast<std::int32_t>(groups.size());

    Vec3d normal_sum, position_sum;
    std::vector<std::int32_t> points;
    for (std::size_t m = first; m < last; ++m) {
      const std::int32_t t = members[m];
      groups.group_of_triangle[t] = g;
      normal_sum += normals[t] * mesh.area[t];
      for (const std::int32_t v : mesh.triangle[t])
        if (seen[v] != g) {
          seen[v] = g;
          points.push_back(v);
        }
    }
    std::sort(points.begin(), points.end());
    for (const std::int32_t v : points) position_sum += mesh.position[v];
    const Vec3d centre = position_sum / static_cast<double>(points.size());
    const Vec3d normal = normalized(normal_sum, mesh.normal[members[first]]);
    double radius = 0.6;
    for (const std::int32_t v : points)
      radius = std::max(radius, length(mesh.position[v] - centre));

    groups.centre.push_back(centre);
    groups.normal.push_back(normal);
    groups.radius.push_back(radius);
    groups.triangles.push_back(static_cast<std::int32_t>(last - first));
    groups.point.insert(groups.point.end(), points.begin(), points.end());
    groups.start.push_back(static_cast<std::int32_t>(groups.point.size()));
    first = last;
  }
  return groups;
}

}  // namespace meniscus
