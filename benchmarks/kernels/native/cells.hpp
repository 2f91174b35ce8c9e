// Which cell of a hash grid a point lies in, and which particles its bucket holds, as cells.cl has
// it. Everything has internal linkage.
#pragma once

#include <cmath>

#include "kernels/native/native.hpp"

namespace meniscus::bench::native {
namespace {

inline int cell_of(float coordinate, float inverse_cell) {
  const float cell = coordinate * inverse_cell;
  const float low = cell > -1e9f ? cell : -1e9f;
  return static_cast<int>(std::floor(low < 1e9f ? low : 1e9f));
}

struct Bucket {
  std::int32_t begin, end, tag;  // particles of other cells have other tags
  std::uint32_t number;
};
inline Bucket bucket_of(const Cells& cells, int i, int j, int k) {
  const std::uint32_t x = static_cast<std::uint32_t>(i), y = static_cast<std::uint32_t>(j),
                      z = static_cast<std::uint32_t>(k);
  const std::uint32_t bucket = (x + (y * 19349663u ^ z * 83492791u)) & cells.mask;
  return {cells.start[bucket], cells.start[bucket + 1],
          static_cast<std::int32_t>((x & 2047u) | (y & 2047u) << 11 | (z & 1023u) << 22), bucket};
}

/// Calls visit(begin, end) for the one or two ranges of particles in the buckets of `count` cells
/// of a row from (i, j, k) on; some may be of other rows.
template <class Visit>
[[gnu::always_inline]] inline void visit_row(const Cells& cells, int i, int j, int k, int count,
                                             const Visit& visit) {
  std::uint32_t bucket = bucket_of(cells, i, j, k).number;
  for (std::uint32_t left = static_cast<std::uint32_t>(count); left > 0; bucket = 0) {
    const std::uint32_t room = cells.mask + 1 - bucket, here = left < room ? left : room;
    visit(cells.start[bucket], cells.start[bucket + here]);
    left -= here;
  }
}

inline bool same_row(std::int32_t a, std::int32_t b) { return ((a ^ b) & ~2047) == 0; }

}  // namespace
}  // namespace meniscus::bench::native
