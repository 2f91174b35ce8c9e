#include "stages/sample/surface_buffers.hpp"

#include "base/parallel.hpp"

namespace meniscus {

SurfaceBuffers surface_of(Device& device, const SampleGrid& grid,
                          const Together<float, float, cl_uchar>& shown) {
  const std::size_t n = grid.size();
  const auto& [depth, normal, kind] = shown.parts;
  return {grid, depth, normal, allocate<cl_int>(device, n), allocate<float>(device, n),
          kind, shown};
}

SurfaceBuffers empty_surface(Device& device, const SampleGrid& grid) {
  const std::size_t n = grid.size();
  const Together<float, float, cl_uchar> shown(device, {n, 3 * n, n});
  fill(device, shown.part<0>(), kNoSurface);
  fill(device, shown.part<2>(), cl_uchar{0});
  return surface_of(device, grid, shown);
}

ShownView::ShownView(Device& device, const SurfaceBuffers& surface, bool wants_normal,
                     bool wants_kind) {
  const auto& shown = surface.shown;
  if ((wants_normal || wants_kind) && shown.whole.size > 0 &&
      same_memory(surface.depth.memory, shown.part<0>().memory) &&
      same_memory(surface.normal.memory, shown.part<1>().memory) &&
      same_memory(surface.kind.memory, shown.part<2>().memory)) {
    all_.emplace(device, shown);
    depth = all_->data<0>();
    if (wants_normal) normal = all_->data<1>();
    if (wants_kind) kind = all_->data<2>();
    return;
  }
  depth = depth_.emplace(device, surface.depth).data();
  if (wants_normal) normal = normal_.emplace(device, surface.normal).data();
  if (wants_kind) kind = kind_.emplace(device, surface.kind).data();
}

SurfaceMap download(Device& device, const SurfaceBuffers& surface) {
  const std::size_t n = surface.grid.size();
  const HostView group(device, surface.group);
  const ShownView shown(device, surface, true, true);
  const float *const depth = shown.depth, *const normal = shown.normal;
  const cl_uchar* const kind = shown.kind;
  SurfaceMap map;
  map.grid = surface.grid;
  parallel_both([&] { map.normal.resize(n); },  // which write all of it
                [&] {
                  map.depth.resize(n);
                  map.group.resize(n);
                  map.kind.resize(n);
                });
  constexpr std::size_t kGrain = std::size_t{1} << 15;  // samples that are worth a thread
  parallel_for(n, kGrain, [&](std::size_t begin, std::size_t end) {
    for (std::size_t s = begin; s < end; ++s) {
      const bool there = depth[s] < kNoSurface;
      map.depth[s] = depth[s];
      map.group[s] = there && group.size() > 0 ? group[s] : -1;
      if (!there) continue;  // zero as made
      map.normal[s] = {normal[s], normal[n + s], normal[2 * n + s]};
      map.kind[s] = kind ? kind_of(kind[s]) : Kind::surface;
    }
  });
  return map;
}

SurfaceBuffers upload(Device& device, const SurfaceMap& map) {
  const std::size_t n = map.grid.size();
  std::vector<float> normal(3 * n);
  std::vector<cl_uchar> kind(n);
  for (std::size_t s = 0; s < n; ++s) {
    normal[s] = map.normal[s].x;
    normal[n + s] = map.normal[s].y;
    normal[2 * n + s] = map.normal[s].z;
    kind[s] = static_cast<cl_uchar>(map.kind[s]);
  }
  return {map.grid, upload(device, map.depth), upload(device, normal), upload(device, map.group),
          {},       upload(device, kind)};
}

records::RayMap kernel_rays(const View& view) {
  const auto at = [&](std::size_t k) { return static_cast<float>(view.ray[k]); };
  return {at(0), at(1), at(2), at(3), at(4), at(5), at(6), at(7), at(8), at(9), at(10), at(11)};
}

records::Screen screen_of(const View& view, const SampleGrid& grid) {
  return {grid.nx, grid.ny, grid.first, grid.step, kernel_rays(view)};
}

}  // namespace meniscus
