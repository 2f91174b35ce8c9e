#include "stages/sheet/sheet.hpp"

#include <algorithm>

#include "device/kernels.hpp"
#include "device/together.hpp"
#include "stages/frame/density.hpp"

namespace meniscus {

SheetFits upload_sheet(Device& device, const Cells& cells, const std::vector<Vec3d>& normal,
                       const std::vector<float>& share,
                       const std::vector<std::vector<float>>& values) {
  // Normals, shares and values in bucket order behind the cells.
  const std::size_t n = cells.item.size(), rows = values.size();
  std::vector<float> normals(3 * n), shares(n), row(rows * n);
  for (std::size_t p = 0; p < n; ++p) {
    const std::size_t k = static_cast<std::size_t>(cells.item[p]);
    normals[p] = static_cast<float>(normal[k].x);
    normals[n + p] = static_cast<float>(normal[k].y);
    normals[2 * n + p] = static_cast<float>(normal[k].z);
    shares[p] = share[k];
    for (std::size_t r = 0; r < rows; ++r) row[r * n + p] = values[r][k];
  }
  const auto [on_device, toward, share_of, value] =
      upload_with_cells(device, cells, normals, shares, row);
  return {on_device, toward, share_of, value};
}

void average_sheet(Device& device, const SheetFits& fits, const SheetWeights& weights,
                   const Buffer<float>& mean) {
  const std::size_t n = fits.share.size;
  if (n == 0) return;
  const int width = device.state().wide_width();
  launch(device, kernels::average_on_sheets, width, range_of_blocks(n, width), mean, fits.cells,
         fits.normal, fits.share, fits.value,
         records::SheetMeans{static_cast<cl_int>(n), static_cast<cl_int>(fits.value.size / n),
                             weights});
}

std::vector<std::vector<float>> average_on_sheets(Device& device,
                                                  const std::vector<Vec3d>& position,
                                                  const std::vector<Vec3d>& normal,
                                                  const std::vector<float>& share,
                                                  const std::vector<std::vector<float>>& values,
                                                  const SheetWeights& weights) {
  const Cells cells = make_cells(position, weights.reach);
  if (cells.item.empty()) return std::vector<std::vector<float>>(values.size());
  const SheetFits fits = upload_sheet(device, cells, normal, share, values);
  const auto mean = allocate<float>(device, fits.value.size);
  average_sheet(device, fits, weights, mean);
  const HostView found(device, mean);
  std::vector<std::vector<float>> result;
  for (std::size_t row = 0; row < values.size(); ++row)
    result.push_back(by_item(cells, found.data() + row * cells.item.size()));
  return result;
}

}  // namespace meniscus
