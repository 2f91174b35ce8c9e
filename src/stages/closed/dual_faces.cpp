#include "stages/closed/dual_faces.hpp"

#include <algorithm>
#include <cmath>
#include <map>
#include <optional>

namespace meniscus {
namespace {

// The vertices between doubled neighbours, each made when it is first asked for.
class VerticesBetween {
 public:
  VerticesBetween(const SpaceGrid& grid, const CrossedEdges& edges, DualMesh& mesh)
      : grid_(grid), edges_(edges), mesh_(mesh) {}

  /// The vertex in the second edge through a doubled face of `cell`, if `edge` belongs to that one.
  std::optional<std::uint32_t> at(std::uint32_t cell, int face, int edge, std::int32_t block) {
    const SurfaceCell& of = mesh_.cells[cell];
    const CornerValues value = values_of(grid_, static_cast<std::size_t>(of.block), of.bit);
    const std::array<int, 4> to = partners(value, face);
    const auto& around = kCellTables.edges[face];
    // The second one is the one without the face's first edge.
    if (edge == around[0] || edge == around[to[0]]) return std::nullopt;
    const std::uint64_t key = std::uint64_t{cell} * 6 + static_cast<std::uint64_t>(face);
    const auto [entry, is_new] =
        made_.try_emplace(key, static_cast<std::uint32_t>(mesh_.position.size()));
    if (!is_new) return entry->second;
    Vec3d middle, normal;
    for (int q = 1; q < 4; ++q) {
      if (q == to[0]) continue;
      const std::uint32_t e = crossing_of(grid_, edges_, of, around[q]);
      middle += edges_.position[e] * 0.5;
      normal += edges_.normal[e];
    }
    mesh_.position.push_back(middle);
    mesh_.normal.push_back(normalized(normal));
    mesh_.sharp.push_back(0);
    mesh_.open.push_back(0);
    mesh_.between.push_back({cell, face / 2, block});
    return entry->second;
  }

 private:
  const SpaceGrid& grid_;
  const CrossedEdges& edges_;
  DualMesh& mesh_;
  std::map<std::uint64_t, std::uint32_t> made_;  // by cell and face
};

bool begins_in(const CornerBox& box, const SpaceGrid& grid, const CrossedEdges& edges,
               std::size_t e) {
  const std::array<int, 3> at = place_in_block(edges.bit[e]);
  const std::array<std::int32_t, 3>& of = grid.blocks[static_cast<std::size_t>(edges.block[e])].at;
  return box.holds(std::int64_t{kBlockSide} * of[0] + at[0],
                   std::int64_t{kBlockSide} * of[1] + at[1],
                   std::int64_t{kBlockSide} * of[2] + at[2]);
}

// The vertices around a crossed edge.
struct Ring {
  std::array<std::uint32_t, 8> vertex;
  std::size_t count = 0;
  int first_between = -1;  // the first one between doubled neighbours; -1: there is none
};

// The four cells around a crossed edge, counter-clockwise seen from its upper end.
struct CellsAround {
  /// How far each lies back along the two axes across the edge, which is where the edge lies in it.
  static constexpr std::array<std::array<int, 2>, 4> kBack{{{0, 0}, {1, 0}, {1, 1}, {0, 1}}};
  std::array<std::uint32_t, 4> cell;  // among all
  std::array<int, 4> edge;            // which one of the cell's it is
};

// Where those cells' lowest corners lie, of each axis and each bit at an edge's lower end.
constexpr auto kCellsAround = [] {
  std::array<std::array<std::array<CornerPlace, 4>, 64>, 3> all{};
  for (std::size_t axis = 0; axis < 3; ++axis)
    for (int bit = 0; bit < 64; ++bit)
      for (std::size_t q = 0; q < 4; ++q) {
        std::array<int, 3> at = place_in_block(bit);
        at[(axis + 1) % 3] -= CellsAround::kBack[q][0];
        at[(axis + 2) % 3] -= CellsAround::kBack[q][1];
        all[axis][bit][q] = corner_place(at[0], at[1], at[2]);
      }
  return all;
}();

CellsAround cells_around(const SpaceGrid& grid, const CrossedEdges& edges, std::size_t e,
                         const DualMesh& mesh) {
  const int axis = edges.axis[e];
  const auto& blocks = grid.around[static_cast<std::size_t>(edges.block[e])];
  CellsAround around;
  for (std::size_t q = 0; q < 4; ++q) {
    const auto [back_b, back_c] = CellsAround::kBack[q];
    const CornerPlace place = kCellsAround[static_cast<std::size_t>(axis)][edges.bit[e]][q];
    around.cell[q] = cell_at(mesh, {blocks[place.around], place.bit});
    around.edge[q] = edge_of(axis, back_b, back_c);
  }
  return around;
}

// Counter-clockwise, seen from the edge's upper end.
Ring ring_around(const SpaceGrid& grid, const CrossedEdges& edges, std::size_t e,
                 const DualMesh& mesh, VerticesBetween& between) {
  const CellsAround around = cells_around(grid, edges, e, mesh);
  Ring ring;
  for (std::size_t q = 0; q < 4; ++q) {
    const SurfaceCell& own = mesh.cells[around.cell[q]];
    ring.vertex[ring.count++] = own.first + piece_of(own, around.edge[q]);
    // On to the next cell, across a face along one of the other axes, from its low or high side.
    const std::size_t to = (q + 1) % 4, other = q % 2;
    const int across = (edges.axis[e] + 1 + static_cast<int>(other)) % 3;
    const bool from_low = CellsAround::kBack[q][other] == 0;
    const int face = 2 * across + (from_low ? 0 : 1), opposite = face ^ 1;
    if ((own.doubled >> face & 1) == 0 ||
        (mesh.cells[around.cell[to]].doubled >> opposite & 1) == 0)
      continue;
    // The face is named as the low one of the cell behind it.
    const std::size_t owner = from_low ? q : to;
    const auto vertex =
        between.at(around.cell[owner], 2 * across, around.edge[owner], edges.block[e]);
    if (!vertex) continue;
    if (ring.first_between < 0) ring.first_between = static_cast<int>(ring.count);
    ring.vertex[ring.count++] = *vertex;
  }
  return ring;
}

void turn_round(Ring& ring) {
  std::reverse(ring.vertex.begin(), ring.vertex.begin() + static_cast<std::ptrdiff_t>(ring.count));
  if (ring.first_between >= 0)
    ring.first_between = static_cast<int>(ring.count) - 1 - ring.first_between;
}

// The vertex that all triangles of a ring have: one between doubled neighbours, else the one on the
// better diagonal of the four.
std::size_t middle_of_fan(const Ring& ring, const DualMesh& mesh, const Vec3d& crossing,
                          const Vec3d& normal, double cell) {
  if (ring.first_between >= 0) return static_cast<std::size_t>(ring.first_between);
  // How far a diagonal's middle is from the surface, and how far its triangles turn back.
  const auto badness = [&](std::size_t k) {
    const auto at = [&](std::size_t q) { return mesh.position[ring.vertex[(k + q) % 4]]; };
    const std::array<Vec3d, 4> p{at(0), at(1), at(2), at(3)};
    const Vec3d one = cross(p[1] - p[0], p[2] - p[0]), two = cross(p[2] - p[0], p[3] - p[0]);
    const double turned = std::max(0.0, -dot(normal, one)) + std::max(0.0, -dot(normal, two));
    return std::abs(dot(normal, (p[0] + p[2]) * 0.5 - crossing)) + 0.02 * length(p[2] - p[0]) +
           4 * turned / cell;
  };
  return badness(1) < badness(0) ? 1 : 0;
}

// A quadrangle around each of some crossed edges.
void join_around(const SpaceGrid& grid, const CrossedEdges& edges,
                 const std::vector<std::uint32_t>& some, DualMesh& mesh) {
  VerticesBetween between(grid, edges, mesh);
  mesh.triangle.reserve(2 * some.size());
  mesh.triangles_of.assign(grid.blocks.size(), 0);
  for (const std::uint32_t e : some) {
    Ring ring = ring_around(grid, edges, e, mesh, between);
    const CornerBlock& block = grid.blocks[static_cast<std::size_t>(edges.block[e])];
    const bool outward_up = is_inside(block.value[static_cast<std::size_t>(edges.bit[e])]);
    if (!outward_up) turn_round(ring);
    const std::size_t from =
        middle_of_fan(ring, mesh, edges.position[e], edges.normal[e], grid.cell);
    for (std::size_t k = 1; k + 1 < ring.count; ++k)
      mesh.triangle.push_back({ring.vertex[from], ring.vertex[(from + k) % ring.count],
                               ring.vertex[(from + k + 1) % ring.count]});
    mesh.triangles_of[static_cast<std::size_t>(edges.block[e])] +=
        static_cast<std::uint32_t>(ring.count) - 2;
  }
}

}  // namespace

void join_vertices(const SpaceGrid& grid, const CrossedEdges& edges, DualMesh& mesh,
                   const CornerBox& within) {
  std::vector<std::uint32_t> begin_within;
  begin_within.reserve(edges.size());
  for (std::size_t e = 0; e < edges.size(); ++e)
    if (begins_in(within, grid, edges, e)) begin_within.push_back(static_cast<std::uint32_t>(e));
  join_around(grid, edges, begin_within, mesh);
}

void join_vertices(const SpaceGrid& grid, const CrossedEdges& edges,
                   const std::vector<std::uint32_t>& some, DualMesh& mesh) {
  join_around(grid, edges, some, mesh);
}

}  // namespace meniscus
