#include "stages/region.hpp"

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

}  // namespace meniscus
