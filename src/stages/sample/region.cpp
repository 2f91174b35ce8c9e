#include "stages/sample/region.hpp"

#include <algorithm>

#include "base/rounded_up.hpp"
#include "device/kernels.hpp"
#include "stages/frame/bins.hpp"
#include "stages/frame/minima.hpp"

namespace meniscus {

KeptTriangles upload_triangles(Device& device, const Triangulation& mesh) {
  std::vector<std::size_t> kept;
  for (std::size_t t = 0; t < mesh.triangle.size(); ++t)
    if (mesh.kind[t] == TriangleKind::kept) kept.push_back(t);
  if (kept.empty()) return {};
  const std::size_t n = kept.size(), stride = rounded_up(n, 64);
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
  return {corners.done(), static_cast<int>(n), static_cast<int>(stride)};
}

void draw_triangles(Device& device, const View& view, const KeptTriangles& triangles,
                    const SampleGrid& grid, const OccupiedBlocks& needed,
                    const Buffer<float>& into) {
  const bool by_minima = draws_by_minima(device);
  if (triangles.count == 0) {
    if (!by_minima) fill(device, into, kNoSurface);
    return;
  }
  const std::size_t n = static_cast<std::size_t>(triangles.count),
                    stride = static_cast<std::size_t>(triangles.stride);
  const cl_int perspective = !view.orthographic;
  const int width = device.state().vector_width;
  if (by_minima) {
    launch(device, kernels::lower_triangles, width, disc_items(triangles.count, width),
           triangles.corners, no_bound(device, grid), into,
           records::Outlined{triangles.count, triangles.stride, bins_of(grid).nx}, lattice_of(grid),
           perspective, needed);
    return;
  }
  const auto records = allocate<float>(device, 16 * stride);
  const Outlines outlines{allocate<cl_int>(device, 4 * stride), allocate<float>(device, stride),
                          triangles.count, triangles.stride};
  launch(device, kernels::outline_triangles, width, {n}, triangles.corners, records, outlines,
         outlines.count, outlines.stride, lattice_of(grid), perspective);
  draw_bins(device, outlines, no_bound(device, grid), grid, [&](const BinLists& lists) {
    launch(device, kernels::draw_triangles, width, bin_items(lists, width), records, lists, into,
           lists.bins, lattice_of(grid), perspective, needed);
  });
}

}  // namespace meniscus
