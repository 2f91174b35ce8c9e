#include "stages/bins.hpp"

#include <algorithm>

namespace meniscus {

BinGrid bins_of(const SampleGrid& grid) {
  return {(grid.nx + kBinSide - 1) / kBinSide, (grid.ny + kBinSide - 1) / kBinSide};
}

int cover_shift(double radius) { return radius >= 14 ? 3 : radius >= 7 ? 2 : 1; }

Buffer<float> bound_bins(Device& device, const Covers& covers, const SampleGrid& grid, int shift) {
  const int side = 1 << shift;
  const BinGrid bins = bins_of(grid);
  const cl_int2 cells{{(grid.nx + side - 1) / side, (grid.ny + side - 1) / side}};
  const auto cell = filled<float>(
      device, static_cast<std::size_t>(cells.s[0]) * static_cast<std::size_t>(cells.s[1]),
      kNoSurface);
  const auto bound = allocate<float>(device, bins.size());
  launch(device, "bins.cl", "bound_cells", {static_cast<std::size_t>(covers.count)}, "",
         covers.cells, covers.deepest, cell, covers.count, covers.stride, cells.s[0]);
  launch(device, "bins.cl", "bound_bins",
         {static_cast<std::size_t>(bins.nx), static_cast<std::size_t>(bins.ny), 8, 8}, "", cell,
         bound, cells, cl_int2{{bins.nx, bins.ny}}, cl_int{kBinSide / side});
  return bound;
}

void draw_bins(Device& device, const Outlines& outlines, const Buffer<float>& bound,
               const SampleGrid& grid, const std::function<void(const BinLists&)>& draw,
               std::size_t most_entries) {
  const BinGrid bins = bins_of(grid);
  const Range particles{static_cast<std::size_t>(outlines.count)};
  const auto count = filled<cl_int>(device, bins.size(), 0);
  const auto shown = allocate<cl_uchar>(device, static_cast<std::size_t>(outlines.stride));
  launch(device, "bins.cl", "count_bins", particles, "", outlines.box, outlines.key, bound, count,
         shown, outlines.count, outlines.stride, bins.nx);
  const std::vector<cl_int> counts = download(device, count);

  std::vector<cl_int> begin(bins.size());
  most_entries = std::min(most_entries, most_values<cl_int2>(device));
  for (std::size_t first = 0, last = 0; first < bins.size(); first = last) {
    std::size_t entries = 0;
    while (last < bins.size() &&
           (last == first || entries + static_cast<std::size_t>(counts[last]) <= most_entries)) {
      begin[last] = static_cast<cl_int>(entries);
      entries += static_cast<std::size_t>(counts[last++]);
    }
    const BinLists lists{upload(device, begin),
                         allocate<cl_int2>(device, std::max<std::size_t>(entries, 1)),
                         static_cast<int>(first), static_cast<int>(last)};
    if (entries > 0)
      launch(device, "bins.cl", "fill_bins", particles, "", outlines.box, outlines.key, bound,
             shown, lists.end, lists.entry, outlines.count, outlines.stride, bins.nx,
             cl_int2{{lists.first, lists.last}});
    draw(lists);
  }
}

Range bin_items(const BinLists& lists, int width) {
  const std::size_t bins = static_cast<std::size_t>(lists.last - lists.first);
  // Few bins a work-group where one item draws a whole bin: they differ much in cost.
  return width > 1 ? Range{bins, 1, 8} : Range{bins * kBinSide * kBinSide, 1, 64};
}

}  // namespace meniscus
