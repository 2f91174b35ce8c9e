#include "stages/interpolate.hpp"

#include <algorithm>

#include "device/kernels.hpp"

namespace meniscus {
namespace {

// Within cells up to this side, in radii of the smallest particle, normals may turn farther.
constexpr double kFineCell = 2.0 / 3;

}  // namespace

LayerSamples interpolate_samples(Device& device, const View& view, const Buffer<float>& reference,
                                 const OccupiedBlocks& occupied, const Buffer<float>& splash,
                                 const OccupiedBlocks& splash_occupied, const Buffer<float>& open,
                                 const SurfaceBuffers& surface, double tolerance,
                                 double least_radius, const ListedBlocks& blocks, int every) {
  const SampleGrid& grid = surface.grid;
  const int cell = 2 * every;
  const int nx = (grid.nx + cell - 1) / cell, ny = (grid.ny + cell - 1) / cell;
  const cl_float step = grid.step * static_cast<cl_float>(every);
  const cl_int2 samples{{grid.nx, grid.ny}}, cells{{nx, ny}};
  const int width = device.state().vector_width;
  // Rows as long as can be: the arrays are read ahead along them.
  const Range range{static_cast<std::size_t>((nx + width - 1) / width),
                    static_cast<std::size_t>(ny), 64, 1};
  // In radii of the smallest particle.
  const double side = 2 * every * static_cast<double>(grid.step) / least_radius;
  const cl_float agreeing = side <= kFineCell ? 0.85f : 0.9f;
  const cl_float spread = static_cast<cl_float>(std::min(0.5 / side, 1.25) * tolerance);
  // Padded to whole tiles of samples, and to what a work-item takes.
  const auto padded = [](int n) { return (n + 7) / 8 * 8; };
  const cl_int stride = padded(nx), rows = padded(ny);
  const Range padded_range{static_cast<std::size_t>(stride / width), static_cast<std::size_t>(rows),
                           64, 1};
  const std::size_t size = static_cast<std::size_t>(stride) * static_cast<std::size_t>(rows);
  const auto shows = allocate<cl_uchar>(device, size), wanted = allocate<cl_uchar>(device, size);
  launch(device, kernels::compare_corners, width, range, surface.depth, surface.normal,
         surface.kind, open, occupied, splash_occupied, shows, samples, cells, stride, grid.first,
         step, kernel_rays(view), cl_int{every}, static_cast<cl_float>(tolerance), agreeing,
         static_cast<cl_int>(side <= kWidestCell));
  launch(device, kernels::interpolate_samples, width, padded_range, shows, reference, splash,
         occupied, splash_occupied, surface.depth, surface.normal, surface.group, surface.kind,
         wanted, open, samples, cells, cl_int2{{stride, rows}}, grid.first, step, kernel_rays(view),
         cl_int{every}, spread, static_cast<cl_int>(!view.orthographic));
  return list_between(device, grid, wanted, stride, every, blocks);
}

}  // namespace meniscus
