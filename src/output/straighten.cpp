#include "output/straighten.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <limits>
#include <numeric>
#include <span>
#include <utility>
#include <vector>

#include "base/parallel.hpp"
#include "stages/vec.hpp"

namespace meniscus {
namespace {

constexpr std::uint32_t kNone = std::numeric_limits<std::uint32_t>::max();
constexpr std::size_t kGrain = 1024;  // vertices or triangles that are worth a thread

// How far normals around a vertex are from their mean (the length of the difference, for cells of
// one particle radius): below the first the place is flat; from the second pair on it is an edge.
constexpr double kFlat = 0.1, kCurved = 0.2;
constexpr double kSmooth = 0.15, kSharp = 0.35;
// In how many rings of vertices something flat is looked for, and how far beside an edge triangles
// are filtered.
constexpr int kFlatRings = 3, kSharpRings = 2;
// Normals farther apart than this (the length of the difference) do not count for each other.
constexpr double kAlike = 0.8;
// What a guide costs that is turned away from a triangle's own normal by 90 degrees, beside how
// much less than 1 the mean of its normals is long. Without it faces beside a corner, which have
// nothing flat around them, were guided by the next face.
constexpr double kOwn = 0.2;
constexpr int kRounds = 4, kMoves = 8;  // of the filter; of the vertices after each
// A triangle whose normal is farther than 90 degrees from its filtered one has turned over.
constexpr double kTurned = 0;
constexpr double kFarthest = 1;  // that a vertex moves along an axis, particle radii

// Calls work(k) for each k in [0, count).
template <class Work>
void for_each(std::size_t count, const Work& work) {
  parallel_for(count, kGrain, [&](std::size_t begin, std::size_t end) {
    for (std::size_t k = begin; k < end; ++k) work(k);
  });
}

// The triangles around each vertex, ascending.
struct Fans {
  std::vector<std::uint32_t> start, triangle;
  Fans(const std::vector<std::array<std::uint32_t, 3>>& triangles, std::size_t vertices)
      : start(vertices + 2), triangle(3 * triangles.size()) {
    for (const auto& t : triangles)
      for (const std::uint32_t v : t) ++start[v + 2];
    for (std::size_t v = 2; v < start.size(); ++v) start[v] += start[v - 1];
    for (std::size_t t = 0; t < triangles.size(); ++t)
      for (const std::uint32_t v : triangles[t])
        triangle[start[v + 1]++] = static_cast<std::uint32_t>(t);
    start.pop_back();
  }
  std::span<const std::uint32_t> of(std::size_t vertex) const {
    return std::span(triangle).subspan(start[vertex], start[vertex + 1] - start[vertex]);
  }
};

Vec3d twice_area(const Vec3d& a, const Vec3d& b, const Vec3d& c) { return cross(b - a, c - a); }

// The triangles that may change and those around them, by themselves. All numbers that there are of
// each count where a mesh is all edges: they are kept once, and as long as they are needed.
struct Patch {
  const Mesh& mesh;
  double unit;
  std::vector<std::uint32_t> vertex;                   // [vertices] of the mesh
  std::vector<Vec3d> position;                         // [vertices] particle radii
  std::vector<std::uint8_t> moves;                     // [vertices]
  std::vector<std::array<std::uint32_t, 3>> triangle;  // of `vertex`
  std::vector<double> share;                           // [triangles] of the filtered normal

  // Where a vertex was at first.
  Vec3d from(std::size_t v) const { return Vec3d(mesh.position[vertex[v]]) / unit; }
  // Twice the area of a triangle, along its normal.
  Vec3d area_of(std::size_t t) const {
    const auto& [a, b, c] = triangle[t];
    return twice_area(position[a], position[b], position[c]);
  }
};

// How far the normals around each vertex are from their mean.
std::vector<float> measure_bends(const Mesh& mesh, const Fans& fans, double unit) {
  std::vector<float> bend(mesh.position.size());
  parallel_for(bend.size(), kGrain, [&](std::size_t begin, std::size_t end) {
    std::vector<Vec3d> area;
    for (std::size_t v = begin; v < end; ++v) {
      area.clear();
      Vec3d sum;
      for (const std::uint32_t t : fans.of(v)) {
        const auto& [a, b, c] = mesh.triangle[t];
        area.push_back(twice_area(Vec3d(mesh.position[a]) / unit, Vec3d(mesh.position[b]) / unit,
                                  Vec3d(mesh.position[c]) / unit));
        sum += area.back();
      }
      const Vec3d mean = normalized(sum);
      double farthest = 0;
      for (const Vec3d& n : area) {
        const Vec3d apart = normalized(n, mean) - mean;
        farthest = std::max(farthest, dot(apart, apart));
      }
      bend[v] = static_cast<float>(std::sqrt(farthest));
    }
  });
  return bend;
}

// What `pick` chooses of the values around each vertex.
template <class Pick>
std::vector<float> ring_of(const Mesh& mesh, const Fans& fans, const std::vector<float>& value,
                           const Pick& pick) {
  std::vector<float> result(value.size());
  for_each(value.size(), [&](std::size_t v) {
    float picked = value[v];
    for (const std::uint32_t t : fans.of(v))
      for (const std::uint32_t other : mesh.triangle[t]) picked = pick(picked, value[other]);
    result[v] = picked;
  });
  return result;
}

// How much of the filtered normal triangles at each vertex take.
std::vector<float> measure_shares(const Mesh& mesh, double cell, double unit) {
  const Fans fans(mesh.triangle, mesh.position.size());
  const double scale = std::min(1.0, cell / unit);
  const auto least = [](float a, float b) { return std::min(a, b); };
  const auto most = [](float a, float b) { return std::max(a, b); };
  std::vector<float> sharp = measure_bends(mesh, fans, unit);
  std::vector<float> flat = ring_of(mesh, fans, sharp, most);
  for (int ring = 0; ring < kFlatRings; ++ring) flat = ring_of(mesh, fans, flat, least);
  for (int ring = 0; ring < kSharpRings; ++ring) sharp = ring_of(mesh, fans, sharp, most);
  std::vector<float> share(flat.size());
  for (std::size_t v = 0; v < share.size(); ++v)
    share[v] = static_cast<float>((1 - smooth_step(kFlat * scale, kCurved * scale, flat[v])) *
                                  smooth_step(kSmooth, kSharp, sharp[v]));
  return share;
}

Patch patch_of(const Mesh& mesh, const std::vector<float>& share, double unit) {
  Patch patch{mesh, unit, {}, {}, {}, {}, {}};
  const auto share_of = [&](const std::array<std::uint32_t, 3>& t) {
    return (double{share[t[0]]} + double{share[t[1]]} + double{share[t[2]]}) / 3;
  };
  // Vertices of triangles that change move; what is around these is looked at.
  std::vector<std::uint8_t> state(mesh.position.size());  // 1: looked at, 2: moves
  for (const auto& t : mesh.triangle)
    if (share_of(t) > 0)
      for (const std::uint32_t v : t) state[v] = 2;
  for (const auto& t : mesh.triangle)
    if (state[t[0]] == 2 || state[t[1]] == 2 || state[t[2]] == 2)
      for (const std::uint32_t v : t) state[v] = std::max<std::uint8_t>(state[v], 1);
  std::vector<std::uint32_t> place(mesh.position.size(), kNone);
  for (std::size_t v = 0; v < place.size(); ++v) {
    if (state[v] == 0) continue;
    place[v] = static_cast<std::uint32_t>(patch.vertex.size());
    patch.vertex.push_back(static_cast<std::uint32_t>(v));
    patch.position.push_back(patch.from(patch.position.size()));
    patch.moves.push_back(state[v] == 2);
  }
  for (const auto& t : mesh.triangle) {
    if (state[t[0]] != 2 && state[t[1]] != 2 && state[t[2]] != 2) continue;
    patch.triangle.push_back({place[t[0]], place[t[1]], place[t[2]]});
    patch.share.push_back(share_of(t));
  }
  return patch;
}

// What is around a vertex: the sum of the triangles' areas as vectors, and as numbers.
struct Around {
  Vec3d sum;
  double all = 0;
};

// Normals of triangles, and what is made of them.
struct Normals {
  std::vector<Vec3d> own, guide, filtered;  // unit
  std::vector<double> area, bent;  // bent: how much less than 1 the mean of normals around is long
  std::vector<Around> around;      // [vertices]
  explicit Normals(const Patch& patch)
      : own(patch.triangle.size()),
        guide(own),
        filtered(own),
        area(own.size()),
        bent(own.size()),
        around(patch.vertex.size()) {}
};

void filter_normals(const Patch& patch, const Fans& fans, Normals& n) {
  const std::size_t triangles = patch.triangle.size(), vertices = patch.vertex.size();
  for_each(triangles, [&](std::size_t t) {
    const Vec3d area = patch.area_of(t);
    n.area[t] = length(area);
    n.own[t] = normalized(area, n.own[t]);
  });
  for_each(vertices, [&](std::size_t v) {
    Around& around = n.around[v] = {};
    for (const std::uint32_t t : fans.of(v)) {
      around.sum += n.own[t] * n.area[t];
      around.all += n.area[t];
    }
  });
  std::vector<Vec3d>& mean = n.filtered;  // which is made once these are no longer needed
  for_each(triangles, [&](std::size_t t) {
    Vec3d sum;
    double all = 1e-30;
    for (const std::uint32_t v : patch.triangle[t]) {
      sum += n.around[v].sum;
      all += n.around[v].all;
    }
    mean[t] = normalized(sum, n.own[t]);
    n.bent[t] = 1 - length(sum) / all;
  });
  for_each(triangles, [&](std::size_t t) {
    double least = std::numeric_limits<double>::infinity();
    for (const std::uint32_t v : patch.triangle[t])
      for (const std::uint32_t other : fans.of(v)) {
        const double off = n.bent[other] + kOwn * (1 - dot(n.own[t], mean[other]));
        if (!(off < least)) continue;
        least = off;
        n.guide[t] = mean[other];
      }
  });
  for_each(triangles, [&](std::size_t t) {
    n.filtered[t] = n.own[t];
    if (!(patch.share[t] > 0)) return;
    Vec3d sum;
    for (const std::uint32_t v : patch.triangle[t])
      for (const std::uint32_t other : fans.of(v)) {
        const Vec3d apart = n.guide[other] - n.guide[t];
        const double alike = std::max(0.0, 1 - dot(apart, apart) / (kAlike * kAlike));
        sum += n.own[other] * (n.area[other] * alike * alike * alike);
      }
    const double share = patch.share[t];
    n.filtered[t] =
        normalized(n.own[t] * (1 - share) + normalized(sum, n.own[t]) * share, n.own[t]);
  });
}

// Vertices to where the triangles around them would have the filtered normals. `moved` and `height`
// have room for vertices and triangles.
void move_vertices(Patch& patch, const Fans& fans, const Normals& n, std::vector<Vec3d>& moved,
                   std::vector<double>& height) {
  moved = patch.position;
  for (int move = 0; move < kMoves; ++move) {
    for_each(height.size(), [&](std::size_t t) {
      const auto& [a, b, c] = patch.triangle[t];
      const Vec3d sum = patch.position[a] + patch.position[b] + patch.position[c];
      height[t] = dot(n.filtered[t], sum) * (1.0 / 3);
    });
    for_each(moved.size(), [&](std::size_t v) {
      if (patch.moves[v] == 0) return;
      const Vec3d &at = patch.position[v], from = patch.from(v);
      Vec3d sum;
      for (const std::uint32_t t : fans.of(v))
        sum += n.filtered[t] * (height[t] - dot(n.filtered[t], at));
      const Vec3d to = at + sum / static_cast<double>(fans.of(v).size());
      moved[v] = {std::clamp(to.x, from.x - kFarthest, from.x + kFarthest),
                  std::clamp(to.y, from.y - kFarthest, from.y + kFarthest),
                  std::clamp(to.z, from.z - kFarthest, from.z + kFarthest)};
    });
    std::swap(moved, patch.position);
  }
}

// Puts vertices of triangles that have turned over back to where they came from, `before`, and
// those of triangles that turn over for it.
void put_back(Patch& patch, const Fans& fans, const Normals& n, const std::vector<Vec3d>& before) {
  std::vector<std::uint8_t> back(patch.vertex.size());
  std::vector<std::uint32_t> looked_at(patch.triangle.size());
  std::iota(looked_at.begin(), looked_at.end(), 0u);
  while (!looked_at.empty()) {
    std::vector<std::uint32_t> moved;
    for (const std::uint32_t t : looked_at) {
      const double agrees = dot(normalized(patch.area_of(t)), n.filtered[t]);
      if (!(agrees < kTurned && agrees < dot(n.own[t], n.filtered[t]))) continue;
      for (const std::uint32_t v : patch.triangle[t])
        if (std::exchange(back[v], std::uint8_t{1}) == 0) moved.push_back(v);
    }
    looked_at.clear();
    for (const std::uint32_t v : moved) {
      patch.position[v] = before[v];
      looked_at.insert(looked_at.end(), fans.of(v).begin(), fans.of(v).end());
    }
  }
}

}  // namespace

void straighten_edges(Mesh& mesh, double cell, double unit) {
  if (mesh.triangle.empty()) return;
  const std::vector<float> share = measure_shares(mesh, cell, unit);
  Patch patch = patch_of(mesh, share, unit);
  if (patch.triangle.empty()) return;
  const Fans fans(patch.triangle, patch.vertex.size());
  Normals normals(patch);
  std::vector<Vec3d> before, moved;
  std::vector<double> height(patch.triangle.size());  // of their middles along their normals
  for (int round = 0; round < kRounds; ++round) {
    filter_normals(patch, fans, normals);
    before = patch.position;
    move_vertices(patch, fans, normals, moved, height);
    put_back(patch, fans, normals, before);
  }
  for_each(patch.vertex.size(), [&](std::size_t k) {
    if (patch.moves[k] == 0) return;
    const std::uint32_t v = patch.vertex[k];
    Vec3d sum;
    for (const std::uint32_t t : fans.of(k)) sum += normals.filtered[t] * normals.area[t];
    const Vec3d old(mesh.normal[v]);
    const double of = double{share[v]};
    mesh.position[v] = static_cast<Vec3>(patch.position[k] * unit);
    mesh.normal[v] = static_cast<Vec3>(normalized(old * (1 - of) + normalized(sum, old) * of, old));
  });
}

}  // namespace meniscus
