#include "stages/sheet.hpp"

#include <algorithm>
#include <utility>

#include "device/kernels.hpp"
#include "device/together.hpp"
#include "stages/density.hpp"

namespace meniscus {

std::array<std::vector<float>, 2> average_on_sheets(Device& device,
                                                    const std::vector<Vec3d>& position,
                                                    const std::vector<Vec3d>& normal,
                                                    const std::vector<float>& share,
                                                    const std::array<std::vector<float>, 2>& values,
                                                    const SheetWeights& weights) {
  auto means = average_in_cells(device, make_cells(position, weights.reach), normal, share,
                                {values[0], values[1]}, weights);
  return {std::move(means[0]), std::move(means[1])};
}

std::vector<std::vector<float>> average_in_cells(Device& device, const Cells& cells,
                                                 const std::vector<Vec3d>& normal,
                                                 const std::vector<float>& share,
                                                 const std::vector<std::vector<float>>& values,
                                                 const SheetWeights& weights) {
  const std::size_t n = cells.item.size(), pairs = (values.size() + 1) / 2;
  std::vector<std::vector<float>> result(values.size(), std::vector<float>(n));
  if (n == 0) return result;
  // All of a frame's values at once: normals, shares and values in bucket order behind the cells.
  const std::size_t buckets = cells.start.size();
  UploadTogether<float, float, float, cl_uint, cl_int, float, float, float, float> fits(
      device, {n, n, n, n, buckets, 3 * n, n, 2 * n, pairs > 1 ? 2 * n : 0});
  std::copy_n(cells.x.data(), n, fits.data<0>());
  std::copy_n(cells.y.data(), n, fits.data<1>());
  std::copy_n(cells.z.data(), n, fits.data<2>());
  std::copy_n(cells.tag.data(), n, fits.data<3>());
  std::copy_n(cells.start.data(), buckets, fits.data<4>());
  const std::array<float*, 2> rows{fits.data<7>(), fits.data<8>()};
  float *const normals = fits.data<5>(), *const shares = fits.data<6>();
  for (std::size_t p = 0; p < n; ++p) {
    const std::size_t k = static_cast<std::size_t>(cells.item[p]);
    normals[p] = static_cast<float>(normal[k].x);
    normals[n + p] = static_cast<float>(normal[k].y);
    normals[2 * n + p] = static_cast<float>(normal[k].z);
    shares[p] = share[k];
    for (std::size_t row = 0; row < 2 * pairs; ++row)
      rows[row / 2][row % 2 * n + p] = values[std::min(row, values.size() - 1)][k];
  }
  const auto on_device = fits.done();
  const Together<float, float> means(device, {2 * n, pairs > 1 ? 2 * n : 0});
  const int width = device.state().vector_width;
  const auto average = [&](const Buffer<float>& value, const Buffer<float>& mean) {
    const auto& [x, y, z, tag, start, toward, own_share, one, two] = on_device;
    launch(device, kernels::average_on_sheets, width, range_of_blocks(n, width), mean,
           DeviceCells{x, y, z, {}, tag, start, {cells.inverse_cell, cells.mask}},
           static_cast<cl_int>(n), toward, own_share, value, weights);
  };
  average(std::get<7>(on_device), means.part<0>());
  if (pairs > 1) average(std::get<8>(on_device), means.part<1>());
  const ViewTogether found(device, means);
  const std::array<const float*, 2> of_pair{found.data<0>(), found.data<1>()};
  for (std::size_t p = 0; p < n; ++p)
    for (std::size_t row = 0; row < values.size(); ++row)
      result[row][static_cast<std::size_t>(cells.item[p])] = of_pair[row / 2][row % 2 * n + p];
  return result;
}

}  // namespace meniscus
