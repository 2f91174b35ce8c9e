#include "stages/sheet/smooth_normals.hpp"

#include <algorithm>
#include <limits>
#include <memory>
#include <span>
#include <utility>

#include "base/parallel.hpp"

namespace meniscus {
namespace {

constexpr std::size_t kGrain = 256;  // triangles that are worth a thread

// The kept triangles around each kept triangle, itself among them: those that share a vertex.
struct Fans {
  std::vector<std::size_t> start;            // [triangles + 1] of room
  std::vector<std::int32_t> count;           // [triangles] that are there
  std::unique_ptr<std::int32_t[]> triangle;  // ascending for each
};

// In how many rounds each triangle takes part, the first ones, so that those around some vertices
// are smoothed in all of them: a round reaches from a triangle to those that share a vertex.
std::vector<int> rounds_around(const Triangulation& mesh, int rounds,
                               std::vector<std::int32_t> vertices) {
  std::vector<int> takes_part(mesh.triangle.size(), 0);
  std::vector<char> reached(mesh.position.size(), 0);
  for (const std::int32_t v : vertices) reached[v] = 1;
  std::vector<std::int32_t> next;
  for (int left = rounds; left > 0; --left) {
    next.clear();
    for (const std::int32_t v : vertices)
      for (std::int32_t f = mesh.fan_start[v]; f < mesh.fan_start[v + 1]; ++f) {
        int& own = takes_part[mesh.fan[f]];
        if (own > 0) continue;
        own = left;
        for (const std::int32_t w : mesh.triangle[mesh.fan[f]])
          if (!std::exchange(reached[w], 1)) next.push_back(w);
      }
    vertices.swap(next);
  }
  return takes_part;
}

// Around those triangles that take part in a round.
Fans fans_around(const Triangulation& mesh, const std::vector<int>& rounds) {
  const std::size_t n = mesh.triangle.size();
  Fans fans;
  fans.start.resize(n + 1);
  for (std::size_t t = 0; t < n; ++t) {
    std::size_t most = 0;
    if (rounds[t] > 0)
      for (const std::int32_t v : mesh.triangle[t])
        most += static_cast<std::size_t>(mesh.fan_start[v + 1] - mesh.fan_start[v]);
    fans.start[t + 1] = fans.start[t] + most;
  }
  fans.count.resize(n);
  fans.triangle = std::make_unique_for_overwrite<std::int32_t[]>(fans.start[n]);
  parallel_for(n, kGrain, [&](std::size_t begin, std::size_t end) {
    for (std::size_t t = begin; t < end; ++t) {
      if (rounds[t] == 0) continue;
      // The three fans are ascending: the least of their heads comes next.
      const std::int32_t *head[3], *last[3];
      for (int k = 0; k < 3; ++k) {
        head[k] = mesh.fan.data() + mesh.fan_start[mesh.triangle[t][k]];
        last[k] = mesh.fan.data() + mesh.fan_start[mesh.triangle[t][k] + 1];
      }
      std::int32_t* const first = fans.triangle.get() + fans.start[t];
      std::int32_t* next = first;
      for (;;) {
        std::int32_t least = std::numeric_limits<std::int32_t>::max();
        for (int k = 0; k < 3; ++k)
          if (head[k] != last[k]) least = std::min(least, *head[k]);
        if (least == std::numeric_limits<std::int32_t>::max()) break;
        for (int k = 0; k < 3; ++k) head[k] += head[k] != last[k] && *head[k] == least;
        *next++ = least;
      }
      fans.count[t] = static_cast<std::int32_t>(next - first);
    }
  });
  return fans;
}

// How much a normal counts for another: 1 where they are the same, falling like exp(-8 (1 - n.n')),
// from products alone.
double likeness(const Vec3d& a, const Vec3d& b) {
  double power = 0.5 + 0.5 * dot(a, b);
  for (int k = 0; k < 4; ++k) power *= power;  // to the 16th
  return power;
}

}  // namespace

std::vector<Vec3d> smooth_normals(const Triangulation& mesh, int rounds,
                                  const std::vector<std::int32_t>& vertices) {
  const std::vector<int> takes_part = rounds_around(mesh, rounds, vertices);
  const Fans near = fans_around(mesh, takes_part);
  const std::size_t n = mesh.triangle.size();
  std::vector<Vec3d> normals = mesh.normal, smoothed = normals;
  for (int round = 0; round < rounds; ++round) {
    parallel_for(n, kGrain, [&](std::size_t begin, std::size_t end) {
      for (std::size_t t = begin; t < end; ++t) {
        if (takes_part[t] <= round) continue;
        Vec3d sum;
        const std::int32_t* const around = near.triangle.get() + near.start[t];
        for (const std::int32_t k : std::span(around, static_cast<std::size_t>(near.count[t]))) {
          sum += normals[k] * (mesh.area[k] * likeness(normals[t], normals[k]));
        }
        smoothed[t] = normalized(sum, normals[t]);
      }
    });
    normals.swap(smoothed);
  }
  return normals;
}

}  // namespace meniscus
