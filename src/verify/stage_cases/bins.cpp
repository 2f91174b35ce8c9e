// count_bins, fill_bins, bound_cells and bound_bins: boxes of all sizes, with keys and bounds that
// are often the same.
#include "verify/reference/bins.hpp"

#include "verify/stage_cases/cases.hpp"
#include "verify/stage_cases/worst.hpp"

namespace meniscus::verify {
namespace {

ReferenceError lists(Device& device, const SampleGrid& grid) {
  const BinGrid bins = bins_of(grid);
  const std::vector<cl_int> box = reference::boxes(grid.nx, grid.ny, 3);
  const reference::KeysAndBounds of = reference::keys_and_bounds(bins);
  const std::multiset<reference::BinEntry> expected = reference::bin_entries(box, of, bins);
  std::multiset<reference::BinEntry> found;
  draw_bins(device,
            {upload(device, box), upload(device, of.key), reference::kBoxes, reference::kBoxStride},
            upload(device, of.bound), grid, [&](const BinLists& lists) {
              const auto end = download(device, lists.end);
              const auto entry = download(device, lists.entry);
              int e = 0;
              for (int bin = lists.bins.begin; bin < lists.bins.end; ++bin)
                for (; e < end[bin]; ++e) found.emplace(bin, entry[e].s[0], entry[e].s[1]);
            });
  std::vector<reference::BinEntry> differing;
  std::set_symmetric_difference(expected.begin(), expected.end(), found.begin(), found.end(),
                                std::back_inserter(differing));
  Worst worst("fill_bins", "entries that differ");
  worst.see(static_cast<double>(differing.size()), 0, 0, 1);
  return worst.error();
}

ReferenceError bounds(Device& device, const SampleGrid& grid) {
  Worst worst("bound_bins", "bound");
  const std::vector<float> deepest = reference::box_depths();
  for (const int shift : {1, 2, 3}) {
    const std::vector<cl_int> box = reference::boxes_of_cells(grid, shift);
    const std::vector<float> expected = reference::bin_bounds(box, deepest, grid, shift);
    const Covers covers{upload(device, box), upload(device, deepest), reference::kBoxes,
                        reference::kBoxStride};
    const std::vector<float> found = download(device, bound_bins(device, covers, grid, shift));
    for (std::size_t k = 0; k < expected.size(); ++k) worst.see(found[k], expected[k], 0);
  }
  return worst.error();
}

}  // namespace

ReferenceErrors bins_case(Device& device, int size) {
  const SampleGrid grid{size, size * 3 / 4 + 1, 0, 1};
  return {lists(device, grid), bounds(device, grid)};
}

}  // namespace meniscus::verify
