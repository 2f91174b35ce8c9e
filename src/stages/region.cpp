#include "stages/region.hpp"

#include <utility>

namespace meniscus {

Buffer<float> draw_triangles(Device& device, const View& view, const Triangulation& mesh,
                             const SampleGrid& grid) {
  const auto depth = filled<float>(device, grid.size(), kNoSurface);
  std::vector<std::size_t> kept;
  for (std::size_t t = 0; t < mesh.triangle.size(); ++t)
    if (mesh.kind[t] == TriangleKind::kept) kept.push_back(t);
  const std::size_t n = kept.size(), stride = (n + 63) / 64 * 64;
  std::vector<float> corners(9 * stride, 0.0f);
  for (std::size_t k = 0; k < n; ++k)
    for (std::size_t c = 0; c < 3; ++c) {
      const std::size_t v = static_cast<std::size_t>(mesh.triangle[kept[k]][c]);
      corners[(3 * c) * stride + k] = static_cast<float>(mesh.screen[v].u);
      corners[(3 * c + 1) * stride + k] = static_cast<float>(mesh.screen[v].v);
      corners[(3 * c + 2) * stride + k] = static_cast<float>(-mesh.position[v].z);
    }
  launch(device, "region.cl", "draw_triangles", {n}, "", upload(device, corners), depth,
         static_cast<cl_int>(n), static_cast<cl_int>(stride), cl_int2{{grid.nx, grid.ny}},
         grid.first, grid.step, static_cast<cl_int>(!view.orthographic));
  return depth;
}

void close_specks(Device& device, const SurfaceBuffers& surface) {
  constexpr int kRounds = 4;
  constexpr float kJump = 3;  // particle radii
  const SampleGrid& grid = surface.grid;
  const std::size_t n = grid.size();
  constexpr int kBlockRows = 8;  // as in specks.cl
  const int width = device.state().vector_width;
  const int across = (grid.nx + width - 1) / width, down = (grid.ny + kBlockRows - 1) / kBlockRows;
  const cl_int2 blocks{{across, down}};
  const Range range{static_cast<std::size_t>(across), static_cast<std::size_t>(down), 16, 2};
  const auto depth = allocate<float>(device, n), normal = allocate<float>(device, 3 * n);
  const auto group = allocate<cl_int>(device, n);
  const auto kind = allocate<cl_uchar>(device, n), change = allocate<cl_uchar>(device, n);
  auto changed = filled<cl_uchar>(device, range.nx * range.ny, 1);
  auto changes = allocate<cl_uchar>(device, range.nx * range.ny);
  for (int round = 0; round < kRounds; ++round) {
    launch(device, "specks.cl", "close_specks", range, width_option(width), surface.depth,
           surface.normal, surface.group, surface.kind, depth, normal, group, kind, change, changed,
           changes, cl_int2{{grid.nx, grid.ny}}, blocks, kJump);
    launch(device, "specks.cl", "apply_closed", range, width_option(width), depth, normal, group,
           kind, change, changes, surface.depth, surface.normal, surface.group, surface.kind,
           cl_int2{{grid.nx, grid.ny}}, blocks);
    std::swap(changed, changes);
  }
}

}  // namespace meniscus
