#include "stages/density.hpp"

#include <numeric>

#include "device/kernels.hpp"
#include "device/together.hpp"

namespace meniscus {
namespace {

// Work-items for n points, WIDTH = `width` each.
Range items_for(std::size_t n, int width) {
  const std::size_t lanes = static_cast<std::size_t>(width);
  return {(n + lanes - 1) / lanes};
}

}  // namespace

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
  const auto [x, y, z, tag, start] =
      upload_together(device, cells.x, cells.y, cells.z, cells.tag, cells.start);
  return {x,
          y,
          z,
          constant(device, cells.x.size(), mass),
          tag,
          start,
          {cells.inverse_cell, cells.mask}};
}

std::vector<float> measure_density(Device& device, const DeviceCells& cells,
                                   const std::vector<Vec3d>& points) {
  const auto density = allocate<float>(device, points.size());
  std::vector<std::int32_t> place(points.size());
  std::iota(place.begin(), place.end(), 0);
  measure_density(device, cells, make_cells(points, 1 / cells.grid.inverse_cell), place, density);
  return download(device, density);
}

void measure_density(Device& device, const DeviceCells& cells, const Cells& points,
                     const std::vector<std::int32_t>& place, const Buffer<float>& density) {
  const std::size_t n = points.item.size();  // those of one cell share a search
  std::vector<cl_int> to;
  to.reserve(n);
  for (const std::int32_t item : points.item) to.push_back(place[static_cast<std::size_t>(item)]);
  const auto [x, y, z, places] = upload_together(device, points.x, points.y, points.z, to);
  const int width = device.state().wide_width();
  launch(device, kernels::measure_density, width, items_for(n, width), DevicePoints{x, y, z},
         places, density, cells_with(cells, cells.weight), static_cast<cl_int>(n));
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
         static_cast<cl_float>(params.blob_density), static_cast<cl_float>(lone));
  return levelled;
}

DeviceCells level_cells(Device& device, const DeviceCells& cells, const RegionParams& params,
                        Measured where, double lone) {
  return level_cells(device, cells, where, params, allocate<float>(device, 4 * cells.x.size), lone);
}

}  // namespace meniscus
