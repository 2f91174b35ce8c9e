#include "stages/cells.hpp"

#include <bit>

namespace meniscus {

Cells make_cells(const std::vector<float>& x, const std::vector<float>& y,
                 const std::vector<float>& z, float cell) {
  Cells cells;
  cells.inverse_cell = 1.0f / cell;
  const std::size_t n = x.size();
  const std::uint32_t buckets =
      std::max(std::bit_ceil(static_cast<std::uint32_t>(n / 2 + 1)), kFewestBuckets);
  cells.mask = buckets - 1;
  cells.start.assign(buckets + 1, 0);
  std::vector<std::uint32_t> bucket(n), tag(n);
  for (std::size_t i = 0; i < n; ++i) {
    const std::int32_t cx = cell_of(x[i], cells.inverse_cell),
                       cy = cell_of(y[i], cells.inverse_cell),
                       cz = cell_of(z[i], cells.inverse_cell);
    bucket[i] = bucket_of(cx, cy, cz, cells.mask);
    tag[i] = tag_of(cx, cy, cz);
    ++cells.start[bucket[i] + 1];
  }
  for (std::size_t b = 0; b < buckets; ++b) cells.start[b + 1] += cells.start[b];
  std::vector<std::int32_t> next(cells.start.begin(), cells.start.end() - 1);
  cells.x.resize(n);
  cells.y.resize(n);
  cells.z.resize(n);
  cells.tag.resize(n);
  cells.item.resize(n);
  for (std::size_t i = 0; i < n; ++i) {
    const std::size_t place = static_cast<std::size_t>(next[bucket[i]]++);
    cells.x[place] = x[i];
    cells.y[place] = y[i];
    cells.z[place] = z[i];
    cells.tag[place] = tag[i];
    cells.item[place] = static_cast<std::int32_t>(i);
  }
  return cells;
}

Cells make_cells(const std::vector<Vec3d>& points, float cell) {
  const std::size_t n = points.size();
  std::vector<float> x(n), y(n), z(n);
  for (std::size_t k = 0; k < n; ++k) {
    x[k] = static_cast<float>(points[k].x);
    y[k] = static_cast<float>(points[k].y);
    z[k] = static_cast<float>(points[k].z);
  }
  return make_cells(x, y, z, cell);
}

}  // namespace meniscus
