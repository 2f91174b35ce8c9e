#include "stages/surface_buffers.hpp"

namespace meniscus {

SurfaceBuffers empty_surface(Device& device, const SampleGrid& grid) {
  const std::size_t n = grid.size();
  return {grid,
          filled<float>(device, n, kNoSurface),
          filled<float>(device, 3 * n, 0.0f),
          filled<cl_int>(device, n, -1),
          filled<float>(device, n, 0.0f),
          filled<cl_uchar>(device, n, static_cast<cl_uchar>(Kind::surface))};
}

SurfaceMap download(Device& device, const SurfaceBuffers& surface) {
  const std::size_t n = surface.grid.size();
  SurfaceMap map;
  map.grid = surface.grid;
  map.depth = download(device, surface.depth);
  map.group = download(device, surface.group);
  const std::vector<float> normal = download(device, surface.normal);
  const std::vector<cl_uchar> kind = download(device, surface.kind);
  map.normal.resize(n);
  map.kind.assign(n, Kind::none);
  for (std::size_t s = 0; s < n; ++s) {
    if (!(map.depth[s] < kNoSurface)) {
      map.group[s] = -1;
      continue;
    }
    map.normal[s] = {normal[s], normal[n + s], normal[2 * n + s]};
    map.kind[s] = static_cast<Kind>(kind[s]);
  }
  return map;
}

cl_float16 kernel_rays(const View& view) {
  cl_float16 rays{};
  for (std::size_t k = 0; k < 12; ++k) rays.s[k] = static_cast<float>(view.ray[k]);
  return rays;
}

}  // namespace meniscus
