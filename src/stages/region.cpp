#include "stages/region.hpp"

#include <algorithm>

#include "device/kernels.hpp"
#include "device/together.hpp"
#include "stages/bins.hpp"
#include "stages/minima.hpp"

namespace meniscus {

Buffer<float> draw_triangles(Device& device, const View& view, const Triangulation& mesh,
                             const SampleGrid& grid, const OccupiedBlocks& asked) {
  std::vector<std::size_t> kept;
  for (std::size_t t = 0; t < mesh.triangle.size(); ++t)
    if (mesh.kind[t] == TriangleKind::kept) kept.push_back(t);
  if (kept.empty()) return filled<float>(device, grid.size(), kNoSurface);
  const std::size_t n = kept.size(), stride = (n + 63) / 64 * 64;
  Upload<float> corners(device, 9 * stride);
  for (std::size_t k = 0; k < n; ++k)
    for (std::size_t c = 0; c < 3; ++c) {
      const std::size_t v = static_cast<std::size_t>(mesh.triangle[kept[k]][c]);
      corners[(3 * c) * stride + k] = static_cast<float>(mesh.screen[v].u);
      corners[(3 * c + 1) * stride + k] = static_cast<float>(mesh.screen[v].v);
      corners[(3 * c + 2) * stride + k] = static_cast<float>(-mesh.position[v].z);
    }
  for (std::size_t row = 0; row < 9; ++row)
    std::fill(corners.data() + row * stride + n, corners.data() + (row + 1) * stride, 0.0f);
  const cl_int perspective = !view.orthographic;
  const auto records = allocate<float>(device, 16 * stride);
  const Outlines outlines{allocate<cl_int>(device, 4 * stride), allocate<float>(device, stride),
                          static_cast<int>(n), static_cast<int>(stride)};
  launch(device, kernels::outline_triangles, 1, {n}, corners.done(), records, outlines,
         outlines.count, outlines.stride, lattice_of(grid), perspective);
  if (draws_by_minima(device)) {
    const auto [depth, no_bound] =
        filled_together<float, float>(device, kNoSurface, {grid.size(), bins_of(grid).size()});
    draw_minima(device, kernels::lower_triangles, records, outlines, no_bound, grid,
                std::tie(depth), lattice_of(grid), perspective, asked);
    return depth;
  }
  const auto no_bound = filled<float>(device, bins_of(grid).size(), kNoSurface);
  const auto depth = allocate<float>(device, grid.size());
  const int width = device.state().vector_width;
  draw_bins(device, outlines, no_bound, grid, [&](const BinLists& lists) {
    launch(device, kernels::draw_triangles, width, bin_items(lists, width), records, lists, depth,
           lists.bins, lattice_of(grid), perspective, asked);
  });
  return depth;
}

}  // namespace meniscus
