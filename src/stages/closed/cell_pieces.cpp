#include "stages/closed/cell_pieces.hpp"

namespace meniscus {
namespace {

constexpr CellTables make_tables() {
  CellTables t;
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

// Whether a face's corners are alternately inside and outside.
bool alternates(const CornerValues& value, int face) {
  const auto& q = kCellTables.corners[face];
  return is_inside(value[q[0]]) != is_inside(value[q[1]]) &&
         is_inside(value[q[1]]) != is_inside(value[q[2]]) &&
         is_inside(value[q[2]]) != is_inside(value[q[3]]);
}

bool crossed(const CornerValues& value, int edge) {
  return is_inside(value[kCellTables.ends[edge][0]]) != is_inside(value[kCellTables.ends[edge][1]]);
}

// Which crossed edge each crossed edge of a cell goes on to, across both faces on which it lies.
using NextEdges = std::array<std::array<int, 2>, 12>;

NextEdges link_edges(const CornerValues& value) {
  NextEdges next{};
  for (int face = 0; face < 6; ++face) {
    const auto& edges = kCellTables.edges[face];
    const auto link = [&](int from, int to) {
      next[from][kCellTables.faces[from][0] == face ? 0 : 1] = to;
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
void number_pieces(const CornerValues& value, SurfaceCell& cell) {
  const NextEdges next = link_edges(value);
  std::uint16_t seen = 0;
  cell.pieces = 0;
  cell.piece = 0;
  for (int start = 0; start < 12; ++start) {
    if (!crossed(value, start) || (seen >> start & 1) != 0) continue;
    int edge = start, face = kCellTables.faces[start][0];
    do {
      seen |= static_cast<std::uint16_t>(1 << edge);
      cell.piece |= static_cast<std::uint32_t>(cell.pieces) << 2 * edge;
      const int to = next[edge][kCellTables.faces[edge][0] == face ? 0 : 1];
      // On across the other one of the two faces on which that edge lies.
      face = kCellTables.faces[to][0] == face ? kCellTables.faces[to][1] : kCellTables.faces[to][0];
      edge = to;
    } while (edge != start);
    ++cell.pieces;
  }
  cell.crossed = seen;
}

// Marks the faces that one piece crosses twice.
void find_doubled(const CornerValues& value, SurfaceCell& cell) {
  cell.doubled = 0;
  for (int face = 0; face < 6; ++face) {
    if (!alternates(value, face)) continue;
    const auto piece = [&](int q) { return piece_of(cell, kCellTables.edges[face][q]); };
    if (piece(0) == piece(1) && piece(0) == piece(2) && piece(0) == piece(3))
      cell.doubled |= static_cast<std::uint8_t>(1 << face);
  }
}

// The pieces of a cell whose corners have these signs. Where a face has them alternately, the
// values decide, else the signs suffice.
struct PiecesOfSigns {
  bool suffice;
  std::uint8_t pieces;
  std::uint16_t crossed;
  std::uint32_t piece;
};

std::array<PiecesOfSigns, 256> list_pieces() {
  std::array<PiecesOfSigns, 256> all{};
  for (std::size_t signs = 0; signs < all.size(); ++signs) {
    CornerValues value;
    for (std::size_t c = 0; c < value.size(); ++c) value[c] = (signs >> c & 1) != 0 ? -1.0f : 1.0f;
    bool any = false;
    for (int face = 0; face < 6; ++face) any |= alternates(value, face);
    SurfaceCell cell;
    number_pieces(value, cell);
    all[signs] = {!any, cell.pieces, cell.crossed, cell.piece};
  }
  return all;
}

}  // namespace

constexpr CellTables kCellTables = make_tables();

int edge_of(int axis, int b, int c) {
  const int corner = b << (axis + 1) % 3 | c << (axis + 2) % 3;
  return kCellTables.edge_between[corner][corner | 1 << axis];
}

CornerValues values_of(const SpaceGrid& grid, std::size_t block, int bit) {
  CornerValues value;
  for (int c = 0; c < 8; ++c)
    value[static_cast<std::size_t>(c)] = value_at(grid, corner_of_cell(grid, block, bit, c));
  return value;
}

// Pieces cut off either both outer corners or both inner ones.
std::array<int, 4> partners(const CornerValues& value, int face) {
  const auto& q = kCellTables.corners[face];
  const auto product = [&](int a, int b) { return double{value[q[a]]} * double{value[q[b]]}; };
  const bool even_inside = is_inside(value[q[0]]);
  const double of_inner = even_inside ? product(0, 2) : product(1, 3);
  const double of_outer = even_inside ? product(1, 3) : product(0, 2);
  const bool inner_joined = of_inner > of_outer;  // the saddle lies inside
  // Edges q - 1 and q meet at corner q: around even corners 3-0 and 1-2, around odd ones 0-1, 2-3.
  const bool cut_even = even_inside != inner_joined;
  return cut_even ? std::array{3, 2, 1, 0} : std::array{1, 0, 3, 2};
}

void find_pieces(const CornerValues& value, SurfaceCell& cell) {
  std::size_t signs = 0;
  for (std::size_t c = 0; c < value.size(); ++c)
    signs |= static_cast<std::size_t>(is_inside(value[c])) << c;
  static const std::array<PiecesOfSigns, 256> of_signs = list_pieces();
  const PiecesOfSigns& plain = of_signs[signs];
  if (plain.suffice) {
    cell.pieces = plain.pieces;
    cell.doubled = 0;
    cell.crossed = plain.crossed;
    cell.piece = plain.piece;
    return;
  }
  number_pieces(value, cell);
  find_doubled(value, cell);
}

}  // namespace meniscus
