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
};
inline Bucket bucket_of(const Cells& cells, int i, int j, int k) {
  const std::uint32_t x = static_cast<std::uint32_t>(i), y = static_cast<std::uint32_t>(j),
                      z = static_cast<std::uint32_t>(k);
  const std::uint32_t bucket = (x + (y * 19349663u ^ z * 83492791u)) & cells.mask;
  return {cells.start[bucket], cells.start[bucket + 1],
          static_cast<std::int32_t>((x & 2047u) | (y & 2047u) << 11 | (z & 1023u) << 22)};
}

}  // namespace
}  // namespace meniscus::bench::native
