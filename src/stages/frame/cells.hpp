// A hash grid over points: finds the points near a position, on the host and in kernels.
//
// A point's cell is floor(coordinate * inverse_cell) for each axis, in float, and its bucket a hash
// of the cell; points of several cells may share a bucket, so whoever visits a cell compares the
// points' tags. Buckets hold points in ascending order: sums over them have one fixed order.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <vector>

#include "stages/vec.hpp"

namespace meniscus {

/// Cells of one row (x) lie in buckets one behind the other. Eight of them, which a search takes at
/// a time (field.cl), never share one, and those that do share one are so far from each other that
/// distances tell their particles apart.
inline constexpr std::uint32_t kFewestBuckets = 64;

struct Cells {
  float inverse_cell = 1;           // 1 / particle radii
  std::uint32_t mask = 0;           // buckets - 1
  std::vector<std::int32_t> start;  // [buckets + 1]
  std::vector<float> x, y, z;       // [n] positions in bucket order, particle radii
  std::vector<std::uint32_t> tag;   // [n] tag_of each point's cell
  std::vector<std::int32_t> item;   // [n] index of each into the arrays it was built from
};

/// Points that lie farther away count as of this cell.
inline constexpr std::int32_t kFarthestCell = 1000000000;

inline std::int32_t cell_of(float coordinate, float inverse_cell) {
  constexpr float kFarthest = kFarthestCell;
  float scaled = coordinate * inverse_cell;
  scaled = scaled > -kFarthest ? scaled : -kFarthest;  // no branches, so that loops become vectors
  scaled = scaled < kFarthest ? scaled : kFarthest;
  // floor(), which without SSE 4.1 is a call
  const std::int32_t cut = static_cast<std::int32_t>(scaled);
  return cut - (scaled < static_cast<float>(cut) ? 1 : 0);
}

inline std::uint32_t bucket_of(std::int32_t cx, std::int32_t cy, std::int32_t cz,
                               std::uint32_t mask) {
  return (static_cast<std::uint32_t>(cx) + (static_cast<std::uint32_t>(cy) * 19349663u ^
                                            static_cast<std::uint32_t>(cz) * 83492791u)) &
         mask;
}

/// The low bits of a cell's coordinates: tells cells apart that are fewer than 1024 cells from each
/// other along each axis.
inline std::uint32_t tag_of(std::int32_t cx, std::int32_t cy, std::int32_t cz) {
  return (static_cast<std::uint32_t>(cx) & 2047u) | (static_cast<std::uint32_t>(cy) & 2047u) << 11 |
         (static_cast<std::uint32_t>(cz) & 1023u) << 22;
}

/// Whether two tags are of cells of one row (x).
inline bool same_row(std::uint32_t a, std::uint32_t b) { return ((a ^ b) & ~2047u) == 0; }

/// Sorts n points into cells of side `cell` (particle radii).
Cells make_cells(const std::vector<float>& x, const std::vector<float>& y,
                 const std::vector<float>& z, float cell);

/// The same of points that are rounded to float first.
Cells make_cells(const std::vector<Vec3d>& points, float cell);

/// The rows of cells around one: how many cells along y and z each lies from it.
using RowsAround = std::array<std::array<std::int32_t, 2>, 9>;
inline constexpr RowsAround kRowsInOrder{
    {{-1, -1}, {0, -1}, {1, -1}, {-1, 0}, {0, 0}, {1, 0}, {-1, 1}, {0, 1}, {1, 1}}};
/// Whoever looks for any point or for so many of them finds them sooner.
inline constexpr RowsAround kNearRowsFirst{
    {{0, 0}, {-1, 0}, {1, 0}, {0, -1}, {0, 1}, {-1, -1}, {1, -1}, {-1, 1}, {1, 1}}};

/// Calls visit(begin, end, tag) for the ranges of points (positions in bucket order) that hold the
/// 27 cells around (x, y, z) as far as they lie within a cell side of it, until visit returns
/// false. Points of the cells are those whose tags are of the row of `tag`. Every point within one
/// cell side is among them; a few may lie far away (more than kFewestBuckets - 3 cells).
template <class Visit>
void visit_ranges_near(const Cells& cells, float x, float y, float z, Visit&& visit,
                       const RowsAround& rows = kRowsInOrder) {
  const std::int32_t cx = cell_of(x, cells.inverse_cell), cy = cell_of(y, cells.inverse_cell),
                     cz = cell_of(z, cells.inverse_cell);
  // How far the cells on either side are, in cell sides; coordinates far from 0 are rounded.
  const float slack =
      1e-3f + 1e-6f * (std::abs(static_cast<float>(cx)) + std::abs(static_cast<float>(cy)) +
                       std::abs(static_cast<float>(cz)));
  const auto squares = [&](float coordinate, std::int32_t cell) {
    const float from_low = coordinate * cells.inverse_cell - static_cast<float>(cell);
    const auto square = [](float v) { return v * v; };
    return std::array<float, 3>{square(std::max(from_low - slack, 0.0f)), 0.0f,
                                square(std::max(1 - from_low - slack, 0.0f))};
  };
  const auto far_x = squares(x, cx), far_y = squares(y, cy), far_z = squares(z, cz);
  for (const auto& [j, k] : rows) {
    const float rest =
        1 - far_y[static_cast<std::size_t>(j + 1)] - far_z[static_cast<std::size_t>(k + 1)];
    if (rest < 0) continue;
    const std::int32_t low = far_x[0] > rest ? 0 : -1, high = far_x[2] > rest ? 0 : 1;
    const std::uint32_t tag = tag_of(cx, cy + j, cz + k);
    std::uint32_t bucket = bucket_of(cx + low, cy + j, cz + k, cells.mask);
    std::uint32_t left = static_cast<std::uint32_t>(high - low + 1);
    while (left > 0) {  // again where the last bucket lies between the row's
      const std::uint32_t count = std::min(left, cells.mask + 1 - bucket);
      if (!visit(cells.start[bucket], cells.start[bucket + count], tag)) return;
      left -= count;
      bucket = 0;
    }
  }
}

/// What a NearFinder may write beyond a range's length.
inline constexpr std::size_t kNearRoom = 16;

/// Values of points in bucket order, in the order of the arrays that cells were built from.
std::vector<float> by_item(const Cells& cells, const float* in_buckets);

/// Lists the items of those points [first, last), positions in bucket order, that lie in the row of
/// `tag` and within a reach of `at`. Returns how many; `found` has room for the range and
/// kNearRoom.
using NearFinder = std::size_t(const Cells& cells, std::int32_t first, std::int32_t last,
                               std::uint32_t tag, const std::array<float, 3>& at,
                               float squared_reach, std::int32_t* found);

/// Those that this processor can run, all with the same result, the fastest first.
std::vector<NearFinder*> near_finders();

/// How many points before one NearBefore looks at.
inline constexpr std::int32_t kBefore = 16;

/// Tells of each of the points [begin, end), in bucket order, which of the kBefore points before it
/// and not before `begin` lie within a reach of it: the lowest of `near`'s bits stands for the
/// first of them.
using NearBefore = void(const Cells& cells, std::int32_t begin, std::int32_t end,
                        float squared_reach, std::uint16_t* near);

/// Like near_finders().
std::vector<NearBefore*> before_finders();

/// Calls visit(k) for every point k of these cells, until visit returns false.
template <class Visit>
void visit_near(const Cells& cells, float x, float y, float z, Visit&& visit) {
  visit_ranges_near(cells, x, y, z, [&](std::int32_t begin, std::int32_t end, std::uint32_t tag) {
    for (std::int32_t p = begin; p < end; ++p)
      if (same_row(cells.tag[p], tag) && !visit(p)) return false;
    return true;
  });
}

}  // namespace meniscus
