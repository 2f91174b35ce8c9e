#include "stages/cells.hpp"

#include <bit>

#include "parallel.hpp"

namespace meniscus {

Cells make_cells(const std::vector<float>& x, const std::vector<float>& y,
                 const std::vector<float>& z, float cell) {
  Cells cells;
  cells.inverse_cell = 1.0f / cell;
  const std::size_t n = x.size();
  const std::uint32_t buckets =
      std::max(std::bit_ceil(static_cast<std::uint32_t>(n / 2 + 1)), kFewestBuckets);
  cells.mask = buckets - 1;
  constexpr std::size_t kGrain = 4096;  // points that are worth a thread
  std::vector<std::uint32_t> bucket(n), tag(n);
  parallel_for(n, kGrain, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) {
      const std::int32_t cx = cell_of(x[i], cells.inverse_cell),
                         cy = cell_of(y[i], cells.inverse_cell),
                         cz = cell_of(z[i], cells.inverse_cell);
      bucket[i] = bucket_of(cx, cy, cz, cells.mask);
      tag[i] = tag_of(cx, cy, cz);
    }
  });
  // Where bucket b begins stands at b + 1, until the points that go there have moved it to b's end.
  cells.start.assign(buckets + 2, 0);
  for (const std::uint32_t b : bucket) ++cells.start[b + 2];
  for (std::size_t b = 0; b < buckets; ++b) cells.start[b + 2] += cells.start[b + 1];
  cells.item.resize(n);
  for (std::size_t i = 0; i < n; ++i)
    cells.item[static_cast<std::size_t>(cells.start[bucket[i] + 1]++)] =
        static_cast<std::int32_t>(i);
  cells.start.pop_back();
  cells.x.resize(n);
  cells.y.resize(n);
  cells.z.resize(n);
  cells.tag.resize(n);
  parallel_for(n, kGrain, [&](std::size_t begin, std::size_t end) {
    for (std::size_t p = begin; p < end; ++p) {
      const std::size_t i = static_cast<std::size_t>(cells.item[p]);
      cells.x[p] = x[i];
      cells.y[p] = y[i];
      cells.z[p] = z[i];
      cells.tag[p] = tag[i];
    }
  });
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
