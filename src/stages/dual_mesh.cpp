#include "stages/dual_mesh.hpp"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <bit>
#include <cmath>
#include <limits>
#include <map>
#include <numeric>
#include <optional>

#include "base/parallel.hpp"

namespace meniscus {
namespace {

constexpr std::size_t kGrain = 64;  // blocks that are worth a thread

// A cell's corners are i + 2 j + 4 k; its edges 0 to 3 along x, then y, then z, in the order of
// their lower corners; its faces 2 axis + side.
struct Tables {
  std::array<std::array<int, 2>, 12> ends{};    // corners of an edge
  std::array<std::array<int, 4>, 6> corners{};  // of a face, all around
  std::array<std::array<int, 4>, 6> edges{};    // edge q lies between corners q and q + 1
  std::array<std::array<int, 2>, 12> faces{};   // on which an edge lies
  std::array<std::array<int, 8>, 8> edge_between{};
};

constexpr Tables make_tables() {
  Tables t;
  int edge = 0;
  for (int axis = 0; axis < 3; ++axis)
    for (int corner = 0; corner < 8; ++corner) {
      if ((corner >> axis & 1) != 0) continue;
      const int other = corner | 1 << axis;
      t.ends[edge] = {corner, other};
      t.edge_between[corner][other] = t.edge_between[other][corner] = edge;
      ++edge;
    }
  for (int axis = 0; axis < 3; ++axis)
    for (int side = 0; side < 2; ++side) {
      const int b = 1 << (axis + 1) % 3, c = 1 << (axis + 2) % 3, from = side << axis;
      t.corners[2 * axis + side] = {from, from | b, from | b | c, from | c};
    }
  std::array<int, 12> found{};
  for (int face = 0; face < 6; ++face)
    for (int q = 0; q < 4; ++q) {
      const int e = t.edge_between[t.corners[face][q]][t.corners[face][(q + 1) % 4]];
      t.edges[face][q] = e;
      t.faces[e][found[e]++] = face;
    }
  return t;
}

constexpr Tables kTables = make_tables();

// The edge of a cell along `axis` whose lower corner has these coordinates along the next axes.
int edge_of(int axis, int b, int c) {
  const int corner = b << (axis + 1) % 3 | c << (axis + 2) % 3;
  return kTables.edge_between[corner][corner | 1 << axis];
}

using Values = std::array<float, 8>;

bool inside(float value) { return value < 0; }

// Whether a face's corners are alternately inside and outside.
bool alternates(const Values& value, int face) {
  const auto& q = kTables.corners[face];
  return inside(value[q[0]]) != inside(value[q[1]]) && inside(value[q[1]]) != inside(value[q[2]]) &&
         inside(value[q[2]]) != inside(value[q[3]]);
}

// Of such a face: which edge (a place in Tables::edges) each one goes on to. Pieces cut off either
// both outer corners or both inner ones.
std::array<int, 4> partners(const Values& value, int face) {
  const auto& q = kTables.corners[face];
  const auto product = [&](int a, int b) { return double{value[q[a]]} * double{value[q[b]]}; };
  const bool even_inside = inside(value[q[0]]);
  const double of_inner = even_inside ? product(0, 2) : product(1, 3);
  const double of_outer = even_inside ? product(1, 3) : product(0, 2);
  const bool inner_joined = of_inner > of_outer;  // the saddle lies inside
  // Edges q - 1 and q meet at corner q: around even corners 3-0 and 1-2, around odd ones 0-1, 2-3.
  const bool cut_even = even_inside != inner_joined;
  return cut_even ? std::array{3, 2, 1, 0} : std::array{1, 0, 3, 2};
}

// Corner c of the cell whose lowest corner has this bit in a block.
Corner corner_of_cell(const SpaceGrid& grid, std::size_t block, int bit, int c) {
  const auto [i, j, k] = place_in_block(bit);
  return corner_at(grid, block, i + (c & 1), j + (c >> 1 & 1), k + (c >> 2));
}

// The values at a cell's corners. Returns whether all are known.
bool values_of(const SpaceGrid& grid, std::size_t block, int bit, Values& value) {
  for (int c = 0; c < 8; ++c) {
    const Corner corner = corner_of_cell(grid, block, bit, c);
    if (corner.block == kNoBlock) return false;
    const std::uint64_t known = grid.blocks[static_cast<std::size_t>(corner.block)].known;
    if ((known >> corner.bit & 1) == 0) return false;
    value[static_cast<std::size_t>(c)] = value_at(grid, corner);
  }
  return true;
}

bool crossed(const Values& value, int edge) {
  return inside(value[kTables.ends[edge][0]]) != inside(value[kTables.ends[edge][1]]);
}

// Which crossed edge each crossed edge of a cell goes on to, across both faces on which it lies.
using NextEdges = std::array<std::array<int, 2>, 12>;

NextEdges link_edges(const Values& value) {
  NextEdges next{};
  for (int face = 0; face < 6; ++face) {
    const auto& edges = kTables.edges[face];
    const auto link = [&](int from, int to) {
      next[from][kTables.faces[from][0] == face ? 0 : 1] = to;
    };
    if (alternates(value, face)) {
      const std::array<int, 4> to = partners(value, face);
      for (int q = 0; q < 4; ++q) link(edges[q], edges[to[q]]);
      continue;
    }
    int first = -1;
    for (const int e : edges) {
      if (!crossed(value, e)) continue;
      if (first >= 0) {
        link(first, e);
        link(e, first);
      }
      first = e;
    }
  }
  return next;
}

// Numbers the pieces of surface of a cell: follows each from edge to edge until it is back.
void find_pieces(const Values& value, SurfaceCell& cell) {
  const NextEdges next = link_edges(value);
  std::uint16_t seen = 0;
  cell.pieces = 0;
  cell.piece = 0;
  for (int start = 0; start < 12; ++start) {
    if (!crossed(value, start) || (seen >> start & 1) != 0) continue;
    int edge = start, face = kTables.faces[start][0];
    do {
      seen |= static_cast<std::uint16_t>(1 << edge);
      cell.piece |= static_cast<std::uint32_t>(cell.pieces) << 2 * edge;
      const int to = next[edge][kTables.faces[edge][0] == face ? 0 : 1];
      // On across the other one of the two faces on which that edge lies.
      face = kTables.faces[to][0] == face ? kTables.faces[to][1] : kTables.faces[to][0];
      edge = to;
    } while (edge != start);
    ++cell.pieces;
  }
  cell.crossed = seen;
}

std::uint32_t piece_of(const SurfaceCell& cell, int edge) { return cell.piece >> 2 * edge & 3; }

// Marks the faces that one piece crosses twice.
void find_doubled(const Values& value, SurfaceCell& cell) {
  cell.doubled = 0;
  for (int face = 0; face < 6; ++face) {
    if (!alternates(value, face)) continue;
    const auto piece = [&](int q) { return piece_of(cell, kTables.edges[face][q]); };
    if (piece(0) == piece(1) && piece(0) == piece(2) && piece(0) == piece(3))
      cell.doubled |= static_cast<std::uint8_t>(1 << face);
  }
}

// How many bits of a mask come before this one.
std::uint32_t count_before(std::uint64_t mask, int bit) {
  return static_cast<std::uint32_t>(std::popcount(mask & ((std::uint64_t{1} << bit) - 1)));
}

// The place of a cell's crossed edge among all.
std::uint32_t crossing_of(const SpaceGrid& grid, const CrossedEdges& edges, const SurfaceCell& cell,
                          int edge) {
  const Corner lower =
      corner_of_cell(grid, static_cast<std::size_t>(cell.block), cell.bit, kTables.ends[edge][0]);
  const auto block = static_cast<std::size_t>(lower.block),
             axis = static_cast<std::size_t>(edge / 4);
  return edges.first[block][axis] + count_before(edges.mask[block][axis], lower.bit);
}

// The place of a cell among all.
std::uint32_t cell_at(const DualMesh& mesh, const Corner& lowest) {
  const std::size_t b = static_cast<std::size_t>(lowest.block);
  return mesh.first_cell[b] + count_before(mesh.mask[b], lowest.bit);
}

Vec3d clamped(const Vec3d& x, const std::array<Vec3d, 2>& bounds) {
  return {std::clamp(x.x, bounds[0].x, bounds[1].x), std::clamp(x.y, bounds[0].y, bounds[1].y),
          std::clamp(x.z, bounds[0].z, bounds[1].z)};
}

// Planes n x = n p, all together: the x of the least squared distance from them solves
// normals x = off.
struct Planes {
  Eigen::Matrix3d normals = Eigen::Matrix3d::Zero();  // sum of n n^T
  Eigen::Vector3d off = Eigen::Vector3d::Zero();      // sum of n (n p)
};

// What planes say of the other coordinates where these ones of x are fixed.
Planes with_fixed(const Planes& planes, const std::array<bool, 3>& fixed,
                  const Eigen::Vector3d& x) {
  Planes rest = planes;
  for (int k = 0; k < 3; ++k) {
    if (!fixed[k]) continue;
    rest.off -= planes.normals.col(k) * x[k];
    rest.normals.row(k).setZero();
    rest.normals.col(k).setZero();
  }
  for (int k = 0; k < 3; ++k)
    if (fixed[k]) rest.off[k] = 0;
  return rest;
}

// The x of the least squared distance from planes in a box, `low` to `low + side` along each axis.
// Where it lies outside, the coordinate that is farthest beyond is fixed at the box's side, and the
// others are found once more. Directions with at most `flat` of the largest eigenvalue are left
// out; `rank`: how many are not.
Eigen::Vector3d nearest_in_box(const Planes& planes, const Eigen::Vector3d& low, double side,
                               double flat, int* rank) {
  Eigen::Vector3d x = Eigen::Vector3d::Zero();
  std::array<bool, 3> fixed{};
  double most = 0;  // eigenvalue of all
  for (int round = 0; round < 4; ++round) {
    const Planes rest = with_fixed(planes, fixed, x);
    const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> solver(rest.normals);
    const Eigen::Vector3d values = solver.eigenvalues();
    if (round == 0) most = values[2];
    Eigen::Vector3d move = Eigen::Vector3d::Zero();
    for (int k = 0; k < 3; ++k) {
      if (!(values[k] > flat * most)) continue;
      const Eigen::Vector3d v = solver.eigenvectors().col(k);
      move += v * (v.dot(rest.off) / values[k]);
      if (round == 0) ++*rank;
    }
    int farthest = -1;
    double beyond = 0;
    for (int k = 0; k < 3; ++k) {
      if (fixed[k]) continue;
      x[k] = move[k];
      const double over = std::max(low[k] - x[k], x[k] - low[k] - side);
      if (over > beyond) {
        beyond = over;
        farthest = k;
      }
    }
    if (farthest < 0) break;
    fixed[farthest] = true;
    x[farthest] = std::clamp(x[farthest], low[farthest], low[farthest] + side);
  }
  return x;
}

// The crossings of one piece of surface in a cell.
struct Piece {
  std::array<std::uint32_t, 12> crossing;
  std::size_t count = 0;
  Vec3d middle;  // of the crossings
  Vec3d normal;  // their sum
};

Piece find_piece(const SpaceGrid& grid, const CrossedEdges& edges, const SurfaceCell& cell,
                 std::uint32_t which) {
  Piece piece;
  for (int e = 0; e < 12; ++e) {
    if ((cell.crossed >> e & 1) == 0 || piece_of(cell, e) != which) continue;
    const std::uint32_t crossing = crossing_of(grid, edges, cell, e);
    piece.crossing[piece.count++] = crossing;
    piece.middle += edges.position[crossing];
    piece.normal += edges.normal[crossing];
  }
  piece.middle = piece.middle / static_cast<double>(piece.count);
  return piece;
}

// Whether its unit normals have one direction, as nearest_in_box() tells it: along their mean the
// sum of their squares is at least |sum|^2 / count, and the rest of the count lies across.
bool is_one_sheet(const Piece& piece, double flat) {
  const auto n = static_cast<double>(piece.count);
  return dot(piece.normal, piece.normal) * (1 + flat) >= n * n;
}

// The planes of its crossings, seen from its middle. A crossing at which F is not zero moves by F
// along its normal, unless F jumps there.
Planes planes_of(const Piece& piece, const CrossedEdges& edges, double most_off) {
  Planes planes;
  for (std::size_t k = 0; k < piece.count; ++k) {
    const std::uint32_t e = piece.crossing[k];
    const Vec3d& n = edges.normal[e];
    const double value = edges.value[e];
    const double out =
        dot(n, edges.position[e] - piece.middle) - (std::abs(value) < most_off ? value : 0);
    const Eigen::Vector3d v(n.x, n.y, n.z);
    planes.normals += v * v.transpose();
    planes.off += v * out;
  }
  return planes;
}

// Where the planes of a piece's crossings meet, its normal, and whether it is on a crease.
void place_vertex(const SpaceGrid& grid, const CrossedEdges& edges, const SurfaceCell& cell,
                  const Piece& piece, std::uint32_t which, const Placing& placing, DualMesh& mesh) {
  const Planes planes = planes_of(piece, edges, placing.most_off);
  const double margin = placing.margin * grid.cell, side = grid.cell - 2 * margin;
  const Vec3d low =
      grid.position(static_cast<std::size_t>(cell.block), cell.bit) + Vec3d(margin, margin, margin);
  const Vec3d& middle = piece.middle;
  const std::size_t vertex = cell.first + which;
  mesh.bounds[vertex] = {low, low + Vec3d(side, side, side)};
  const Vec3d mean = normalized(piece.normal);
  mesh.normal[vertex] = mean;
  if (placing.sheets_by_mean && is_one_sheet(piece, placing.flat)) {
    const Eigen::Vector3d v(mean.x, mean.y, mean.z);
    const Vec3d at = middle + mean * (v.dot(planes.off) / v.dot(planes.normals * v));
    if (at == clamped(at, mesh.bounds[vertex])) {
      mesh.position[vertex] = at;
      return;
    }
  }
  int rank = 0;
  const Eigen::Vector3d from_middle(low.x - middle.x, low.y - middle.y, low.z - middle.z);
  const Eigen::Vector3d move = nearest_in_box(planes, from_middle, side, placing.flat, &rank);
  mesh.position[vertex] = clamped(middle + Vec3d(move[0], move[1], move[2]), mesh.bounds[vertex]);
  mesh.sharp[vertex] = rank > 1;
}

// The vertices between doubled neighbours, each made when it is first asked for.
class VerticesBetween {
 public:
  VerticesBetween(const SpaceGrid& grid, const CrossedEdges& edges, DualMesh& mesh)
      : grid_(grid), edges_(edges), mesh_(mesh) {}

  /// The vertex in the second edge through a doubled face of `cell`, if `edge` belongs to that one.
  std::optional<std::uint32_t> at(std::uint32_t cell, int face, int edge, std::int32_t block) {
    const SurfaceCell& of = mesh_.cells[cell];
    Values value;
    values_of(grid_, static_cast<std::size_t>(of.block), of.bit, value);
    const std::array<int, 4> to = partners(value, face);
    const auto& around = kTables.edges[face];
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

CellsAround cells_around(const SpaceGrid& grid, const CrossedEdges& edges, std::size_t e,
                         const DualMesh& mesh) {
  const int axis = edges.axis[e];
  CellsAround around;
  for (std::size_t q = 0; q < 4; ++q) {
    const auto [back_b, back_c] = CellsAround::kBack[q];
    std::array<int, 3> at = place_in_block(edges.bit[e]);
    at[(axis + 1) % 3] -= back_b;
    at[(axis + 2) % 3] -= back_c;
    around.cell[q] = cell_at(
        mesh, corner_at(grid, static_cast<std::size_t>(edges.block[e]), at[0], at[1], at[2]));
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

// Those cells of a block whose corners are all known, their vertices not numbered yet. The surface
// passes through them.
std::vector<SurfaceCell> find_cells(const SpaceGrid& grid, std::size_t block,
                                    std::uint64_t wanted) {
  std::vector<SurfaceCell> cells;
  cells.reserve(static_cast<std::size_t>(std::popcount(wanted)));
  for (std::uint64_t left = wanted; left != 0; left &= left - 1) {
    const int bit = std::countr_zero(left);
    Values value;
    if (!values_of(grid, block, bit, value)) continue;
    SurfaceCell cell;
    cell.block = static_cast<std::int32_t>(block);
    cell.bit = static_cast<std::uint8_t>(bit);
    find_pieces(value, cell);
    find_doubled(value, cell);
    cells.push_back(cell);
  }
  return cells;
}

// A mesh of the cells around some edges, with room for their vertices.
DualMesh list_cells(const SpaceGrid& grid, const CrossedEdges& edges,
                    const std::vector<std::uint32_t>& some) {
  const std::size_t blocks = grid.blocks.size();
  const std::vector<std::uint64_t> wanted = cells_of(grid, edges, some);
  std::vector<std::vector<SurfaceCell>> found(blocks);
  parallel_for(blocks, kGrain, [&](std::size_t begin, std::size_t end) {
    for (std::size_t b = begin; b < end; ++b) found[b] = find_cells(grid, b, wanted[b]);
  });
  DualMesh mesh;
  mesh.mask.resize(blocks);
  mesh.first_cell.resize(blocks);
  std::uint32_t vertices = 0;
  for (std::size_t b = 0; b < blocks; ++b) {
    mesh.first_cell[b] = static_cast<std::uint32_t>(mesh.cells.size());
    for (SurfaceCell& cell : found[b]) {
      mesh.mask[b] |= std::uint64_t{1} << cell.bit;
      cell.first = vertices;
      vertices += cell.pieces;
      mesh.cells.push_back(cell);
    }
  }
  mesh.position.resize(vertices);
  mesh.normal.resize(vertices);
  mesh.sharp.resize(vertices);
  mesh.open.resize(vertices);
  mesh.bounds.resize(vertices);
  return mesh;
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
    const bool outward_up = inside(block.value[static_cast<std::size_t>(edges.bit[e])]);
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

// [vertices] the lowest vertex of the piece of the mesh that each belongs to.
std::vector<std::uint32_t> pieces_of(const DualMesh& mesh) {
  std::vector<std::uint32_t> lowest(mesh.position.size());
  std::iota(lowest.begin(), lowest.end(), 0u);
  const auto lowest_of = [&](std::uint32_t v) {
    while (lowest[v] != v) v = lowest[v] = lowest[lowest[v]];
    return v;
  };
  for (const auto& t : mesh.triangle)
    for (const std::uint32_t v : {t[1], t[2]}) {
      const std::uint32_t a = lowest_of(t[0]), b = lowest_of(v);
      lowest[std::max(a, b)] = std::min(a, b);
    }
  for (std::uint32_t& v : lowest) v = lowest_of(v);
  return lowest;
}

// [vertices] what each piece encloses, at its lowest vertex; below 0: air.
std::vector<double> volumes_of(const DualMesh& mesh, const std::vector<std::uint32_t>& piece) {
  std::vector<double> volume(piece.size(), 0.0);
  for (const auto& t : mesh.triangle) {
    const Vec3d& from = mesh.position[piece[t[0]]];  // near by, so that little cancels
    volume[piece[t[0]]] += dot(mesh.position[t[0]] - from,
                               cross(mesh.position[t[1]] - from, mesh.position[t[2]] - from)) /
                           6;
  }
  return volume;
}

}  // namespace

DualMesh place_vertices(const SpaceGrid& grid, const CrossedEdges& edges, const Placing& placing) {
  std::vector<std::uint32_t> all(edges.size());
  std::iota(all.begin(), all.end(), 0u);
  return place_vertices(grid, edges, all, placing);
}

DualMesh place_vertices(const SpaceGrid& grid, const CrossedEdges& edges,
                        const std::vector<std::uint32_t>& some, const Placing& placing) {
  DualMesh mesh = list_cells(grid, edges, some);
  std::vector<std::uint8_t> joined(edges.size(), 0);
  for (const std::uint32_t e : some) joined[e] = 1;
  parallel_for(mesh.cells.size(), 256, [&](std::size_t begin, std::size_t end) {
    for (std::size_t c = begin; c < end; ++c)
      for (std::uint32_t which = 0; which < mesh.cells[c].pieces; ++which) {
        const Piece piece = find_piece(grid, edges, mesh.cells[c], which);
        place_vertex(grid, edges, mesh.cells[c], piece, which, placing, mesh);
        mesh.open[mesh.cells[c].first + which] =
            std::any_of(piece.crossing.begin(), piece.crossing.begin() + piece.count,
                        [&](std::uint32_t e) { return joined[e] == 0; });
      }
  });
  return mesh;
}

void settle_vertices(Device& device, const ImplicitFunction& function, DualMesh& mesh) {
  std::vector<std::uint32_t> smooth;
  for (std::size_t v = 0; v < mesh.position.size(); ++v)
    if (!mesh.sharp[v]) smooth.push_back(static_cast<std::uint32_t>(v));
  const auto measure = [&] {
    Points points;
    points.reserve(smooth.size());
    for (const std::uint32_t v : smooth) points.add(mesh.position[v]);
    return measure_implicit(device, function, points);
  };
  const Levels before = measure();
  for (std::size_t k = 0; k < smooth.size(); ++k) {
    Vec3d& at = mesh.position[smooth[k]];
    at = clamped(at - Vec3d(before.gradient[k]) * double{before.value[k]}, mesh.bounds[smooth[k]]);
  }
  const Levels after = measure();
  constexpr double kAlike = 0.5;  // of a vertex's normal with its crossings': else F jumps there
  for (std::size_t k = 0; k < smooth.size(); ++k) {
    const Vec3d normal(after.gradient[k]);
    if (dot(normal, mesh.normal[smooth[k]]) > kAlike) mesh.normal[smooth[k]] = normal;
  }
}

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

std::vector<std::uint32_t> drop_crumbs(DualMesh& mesh, double least_fluid, double least_air) {
  constexpr std::uint32_t kDropped = ~0u;
  const std::vector<std::uint32_t> piece = pieces_of(mesh);
  std::vector<double> volume = volumes_of(mesh, piece);
  for (std::size_t v = 0; v < mesh.open.size(); ++v)
    if (mesh.open[v]) volume[piece[v]] = std::numeric_limits<double>::infinity();
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
