// Means over sheets of fits that are given one by one.
#pragma once

#include <vector>

#include "stages/sheet/sheet.hpp"

namespace meniscus {

/// The means of one or three values over the sheet around each of n fits [n]; 0 where nothing
/// counts (average_sheet()).
///
///   position  [n] eye space, particle radii
///   normal    [n] unit
///   share     [n] how much each fit counts, 0 .. 1
///   values    [n] each
inline std::vector<std::vector<float>> average_on_sheets(
    Device& device, const std::vector<Vec3d>& position, const std::vector<Vec3d>& normal,
    const std::vector<float>& share, const std::vector<std::vector<float>>& values,
    const SheetWeights& weights) {
  const Cells cells = make_cells(position, weights.reach);
  const std::size_t n = cells.item.size(), rows = values.size();
  if (n == 0) return std::vector<std::vector<float>>(rows);
  std::vector<float> normals(3 * n), shares(n), row(rows * n);  // in bucket order
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
  const auto mean = allocate<float>(device, rows * n);
  average_sheet(device, {on_device, toward, share_of, value}, weights, mean);
  const HostView found(device, mean);
  std::vector<std::vector<float>> result;
  for (std::size_t r = 0; r < rows; ++r) result.push_back(by_item(cells, found.data() + r * n));
  return result;
}

}  // namespace meniscus
