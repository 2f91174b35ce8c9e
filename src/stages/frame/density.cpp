#include "stages/frame/density.hpp"

#include <algorithm>

#include "device/kernels.hpp"
#include "device/together.hpp"

namespace meniscus {

Range range_of_blocks(std::size_t n, int width) {
  // BLOCK particles an item (cells.cl), few items a group, which spreads them over the processors.
  const std::size_t block = width == 1 ? 1 : 128;
  return {(n + block - 1) / block, 1, width == 1 ? std::size_t{64} : 4, 1};
}

DevicePoints upload_points(Device& device, const Cells& cells) {
  const auto [x, y, z] = upload_together(device, cells.x, cells.y, cells.z);
  return {x, y, z};
}

DeviceCells upload_cells(Device& device, const Cells& cells, float mass) {
  auto [uploaded] = upload_with_cells(device, cells);
  uploaded.weight = constant(device, cells.x.size(), mass);
  return uploaded;
}

std::vector<float> measure_density(Device& device, const DeviceCells& cells,
                                   const std::vector<Vec3d>& points) {
  // Those of one cell share a search.
  const Cells sorted = make_cells(points, 1 / cells.grid.inverse_cell);
  const std::size_t n = points.size();
  Upload<float> at(device, 3 * n);
  std::ranges::copy_n(sorted.x.begin(), static_cast<std::ptrdiff_t>(n), at.data());
  std::ranges::copy_n(sorted.y.begin(), static_cast<std::ptrdiff_t>(n), at.data() + n);
  std::ranges::copy_n(sorted.z.begin(), static_cast<std::ptrdiff_t>(n), at.data() + 2 * n);
  const auto density = allocate<float>(device, n);
  measure_density(device, cells, at.done(), density);
  const HostView found(device, density);
  return by_item(sorted, found.data());
}

void measure_density(Device& device, const DeviceCells& cells, const Buffer<float>& points,
                     const Buffer<float>& density, int rows) {
  const int width = device.state().wide_width();
  if (width < rows) rows = 1;  // one point a work-item
  const std::size_t n = points.size / 3 / static_cast<std::size_t>(rows);
  launch(device, kernels::measure_density, width, range_of_blocks(n, width), points, density,
         cells_with(cells, cells.weight), cl_int2{{static_cast<cl_int>(n), rows}});
}

Buffer<float> measure_gradients(Device& device, const DeviceCells& cells, Measured where) {
  const auto result = allocate<float>(device, 4 * cells.x.size);
  level_cells(device, cells, where, {}, result);
  return result;
}

DeviceCells level_cells(Device& device, const DeviceCells& cells, Measured where,
                        const RegionParams& params, const Buffer<float>& field, double lone) {
  const std::size_t n = cells.x.size;
  const int width = device.state().wide_width();
  DeviceCells levelled = cells;
  levelled.weight = allocate<float>(device, n);
  launch(device, kernels::measure_gradients, width, range_of_blocks(n, width), field,
         levelled.weight, cells_with(cells, cells.weight), static_cast<cl_int>(n),
         where == Measured::everywhere ? 0 : kFilledCell,
         cl_float2{{static_cast<cl_float>(params.blob_density), static_cast<cl_float>(lone)}});
  return levelled;
}

}  // namespace meniscus
