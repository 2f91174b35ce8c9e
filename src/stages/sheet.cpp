#include "stages/sheet.hpp"

#include "device/kernels.hpp"
#include "stages/density.hpp"

namespace meniscus {

std::array<std::vector<float>, 2> average_on_sheets(Device& device,
                                                    const std::vector<Vec3d>& position,
                                                    const std::vector<Vec3d>& normal,
                                                    const std::vector<float>& share,
                                                    const std::array<std::vector<float>, 2>& values,
                                                    const SheetWeights& weights) {
  return average_in_cells(device, make_cells(position, weights.reach), normal, share, values,
                          weights);
}

std::array<std::vector<float>, 2> average_in_cells(Device& device, const Cells& cells,
                                                   const std::vector<Vec3d>& normal,
                                                   const std::vector<float>& share,
                                                   const std::array<std::vector<float>, 2>& values,
                                                   const SheetWeights& weights) {
  const std::size_t n = cells.item.size();
  std::array<std::vector<float>, 2> result{std::vector<float>(n), std::vector<float>(n)};
  if (n == 0) return result;
  Upload<float> normals(device, 3 * n), shares(device, n), both(device, 2 * n);  // in bucket order
  for (std::size_t p = 0; p < n; ++p) {
    const std::size_t k = static_cast<std::size_t>(cells.item[p]);
    normals[p] = static_cast<float>(normal[k].x);
    normals[n + p] = static_cast<float>(normal[k].y);
    normals[2 * n + p] = static_cast<float>(normal[k].z);
    shares[p] = share[k];
    both[p] = values[0][k];
    both[n + p] = values[1][k];
  }
  const auto mean = allocate<float>(device, 2 * n);
  const int width = device.state().vector_width;
  launch(device, kernels::average_on_sheets, width, range_of_blocks(n, width), mean,
         upload(device, cells.x), upload(device, cells.y), upload(device, cells.z),
         upload(device, cells.tag), upload(device, cells.start), cells.inverse_cell, cells.mask,
         static_cast<cl_int>(n), normals.done(), shares.done(), both.done(), weights.reach,
         weights.low, weights.high);
  const std::vector<float> found = download(device, mean);
  for (std::size_t p = 0; p < n; ++p) {
    const std::size_t k = static_cast<std::size_t>(cells.item[p]);
    result[0][k] = found[p];
    result[1][k] = found[n + p];
  }
  return result;
}

}  // namespace meniscus
