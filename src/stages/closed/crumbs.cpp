#include "stages/closed/crumbs.hpp"

#include <algorithm>
#include <limits>
#include <numeric>

namespace meniscus {
namespace {

// [vertices] the lowest vertex of the piece of the mesh that each belongs to.
std::vector<std::uint32_t> pieces_of(const DualMesh& mesh) {
  std::vector<std::uint32_t> lowest(mesh.position.size());
  std::iota(lowest.begin(), lowest.end(), 0u);
  const auto lowest_of = [&](std::uint32_t v) {
    while (lowest[v] != v) v = lowest[v] = lowest[lowest[v]];
    return v;
  };
  for (const auto& t : mesh.triangle) {
    const std::uint32_t a = lowest_of(t[0]), b = lowest_of(t[1]), c = lowest_of(t[2]);
    lowest[a] = lowest[b] = lowest[c] = std::min({a, b, c});
  }
  for (std::uint32_t& v : lowest) v = lowest_of(v);
  return lowest;
}

// [vertices] what each piece encloses, at its lowest vertex; below 0: air. Open pieces enclose no
// end.
std::vector<double> volumes_of(const DualMesh& mesh, const std::vector<std::uint32_t>& piece) {
  std::vector<double> volume(piece.size(), 0.0);
  for (std::size_t v = 0; v < mesh.open.size(); ++v)
    if (mesh.open[v]) volume[piece[v]] = std::numeric_limits<double>::infinity();
  for (const auto& t : mesh.triangle) {
    if (volume[piece[t[0]]] == std::numeric_limits<double>::infinity()) continue;
    const Vec3d& from = mesh.position[piece[t[0]]];  // near by, so that little cancels
    volume[piece[t[0]]] += dot(mesh.position[t[0]] - from,
                               cross(mesh.position[t[1]] - from, mesh.position[t[2]] - from)) /
                           6;
  }
  return volume;
}

}  // namespace

std::vector<std::uint32_t> drop_crumbs(DualMesh& mesh, double least_fluid, double least_air) {
  constexpr std::uint32_t kDropped = ~0u;
  const std::vector<std::uint32_t> piece = pieces_of(mesh);
  const std::vector<double> volume = volumes_of(mesh, piece);
  const auto vertices = static_cast<std::uint32_t>(mesh.position.size());
  std::vector<std::uint32_t> place(vertices, kDropped), kept;
  kept.reserve(vertices);
  for (std::uint32_t v = 0; v < vertices; ++v) {
    const double of = volume[piece[v]];
    if (of >= 0 ? of < least_fluid : of > -least_air) continue;
    const auto to = static_cast<std::uint32_t>(kept.size());
    mesh.position[to] = mesh.position[v];
    mesh.normal[to] = mesh.normal[v];
    mesh.sharp[to] = mesh.sharp[v];
    kept.push_back(v);
    place[v] = to;
  }
  const std::size_t left = kept.size();
  if (left == vertices) return kept;
  mesh.position.resize(left);
  mesh.normal.resize(left);
  mesh.sharp.resize(left);
  std::erase_if(mesh.triangle, [&](const auto& t) { return place[t[0]] == kDropped; });
  for (auto& t : mesh.triangle)
    for (std::uint32_t& v : t) v = place[v];
  // What stood for cells stands for others now.
  mesh.cells.clear();
  mesh.open.clear();
  mesh.bounds.clear();
  mesh.between.clear();
  mesh.triangles_of.clear();
  return kept;
}

}  // namespace meniscus
