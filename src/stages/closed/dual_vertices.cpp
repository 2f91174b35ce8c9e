#include "stages/closed/dual_vertices.hpp"

#include <Eigen/Core>
#include <algorithm>
#include <bit>
#include <cmath>
#include <numeric>

#include "base/parallel.hpp"
#include "stages/closed/planes_in_box.hpp"

namespace meniscus {
namespace {

constexpr std::size_t kGrain = 64;  // blocks that are worth a thread

// Of Placing::quick: a direction that the planes of a vertex fix by less than this share counts
// hardly. With a quarter of it vertices of drops follow noise. With as much, but damped once, they
// stay so far inside edges that twice as many rays beside these miss the mesh.
constexpr double kDamping = 0.02;

Vec3d clamped(const Vec3d& x, const std::array<Vec3d, 2>& bounds) {
  return {std::clamp(x.x, bounds[0].x, bounds[1].x), std::clamp(x.y, bounds[0].y, bounds[1].y),
          std::clamp(x.z, bounds[0].z, bounds[1].z)};
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
  each_bit(cell.crossed, [&](int e) {
    if (piece_of(cell, e) != which) return;
    const std::uint32_t crossing = crossing_of(grid, edges, cell, e);
    piece.crossing[piece.count++] = crossing;
    piece.middle += edges.position[crossing];
    piece.normal += edges.normal[crossing];
  });
  piece.middle = piece.middle / static_cast<double>(piece.count);
  return piece;
}

// Whether its unit normals have one direction, as nearest_in_box() finds it: along their mean the
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
  if (placing.quick && is_one_sheet(piece, placing.flat)) {
    const Eigen::Vector3d v(mean.x, mean.y, mean.z);
    const Vec3d at = middle + mean * (v.dot(planes.off) / v.dot(planes.normals * v));
    if (at == clamped(at, mesh.bounds[vertex])) {
      mesh.position[vertex] = at;
      return;
    }
  }
  if (placing.quick) {
    const Eigen::Vector3d move = nearest_damped(planes, kDamping);
    mesh.position[vertex] = clamped(middle + Vec3d(move[0], move[1], move[2]), mesh.bounds[vertex]);
    return;
  }
  int rank = 0;
  const Eigen::Vector3d from_middle(low.x - middle.x, low.y - middle.y, low.z - middle.z);
  const Eigen::Vector3d move = nearest_in_box(planes, from_middle, side, placing.flat, &rank);
  mesh.position[vertex] = clamped(middle + Vec3d(move[0], move[1], move[2]), mesh.bounds[vertex]);
  mesh.sharp[vertex] = rank > 1;
}

// The cells whose eight corners are all known: masks of their lowest corners, by block.
std::vector<std::uint64_t> known_cells(const SpaceGrid& grid) {
  const std::size_t blocks = grid.blocks.size();
  std::vector<std::uint64_t> cells(blocks), corners(blocks);
  for (std::size_t b = 0; b < blocks; ++b) cells[b] = grid.blocks[b].known;
  for (int axis = 0; axis < 3; ++axis) {
    corners = cells;
    for (std::size_t b = 0; b < blocks; ++b) {
      const std::int32_t next = next_block(grid, b, axis);
      cells[b] &=
          of_next(corners[b], next == kNoBlock ? 0 : corners[static_cast<std::size_t>(next)], axis);
    }
  }
  return cells;
}

// A mesh of the cells around some edges, with room for their vertices. The surface passes through
// these cells.
DualMesh list_cells(const SpaceGrid& grid, const CrossedEdges& edges,
                    const std::vector<std::uint32_t>& some) {
  const std::size_t blocks = grid.blocks.size();
  DualMesh mesh;
  mesh.mask = cells_of(grid, edges, some);
  mesh.first_cell.resize(blocks);
  const std::vector<std::uint64_t> known = known_cells(grid);
  std::uint32_t cells = 0;
  for (std::size_t b = 0; b < blocks; ++b) {
    mesh.mask[b] &= known[b];
    mesh.first_cell[b] = cells;
    cells += static_cast<std::uint32_t>(std::popcount(mesh.mask[b]));
  }
  mesh.cells.resize(cells);
  parallel_for(blocks, kGrain, [&](std::size_t begin, std::size_t end) {
    for (std::size_t b = begin; b < end; ++b) {
      std::size_t place = mesh.first_cell[b];
      each_bit(mesh.mask[b], [&](int bit) {
        SurfaceCell& cell = mesh.cells[place++];
        cell.block = static_cast<std::int32_t>(b);
        cell.bit = static_cast<std::uint8_t>(bit);
        find_pieces(values_of(grid, b, bit), cell);
      });
    }
  });
  std::uint32_t vertices = 0;
  for (SurfaceCell& cell : mesh.cells) {
    cell.first = vertices;
    vertices += cell.pieces;
  }
  mesh.position.resize(vertices);
  mesh.normal.resize(vertices);
  mesh.sharp.resize(vertices);
  mesh.open.resize(vertices);
  mesh.bounds.resize(vertices);
  return mesh;
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

}  // namespace meniscus
