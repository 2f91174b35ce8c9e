// count_bins, fill_bins, bound_cells and bound_bins: boxes of all sizes, with keys and bounds that
// are often the same.
#include "stages/bins.hpp"

#include <algorithm>
#include <set>
#include <tuple>

#include "verify/references/cases.hpp"
#include "verify/references/inputs.hpp"
#include "verify/references/worst.hpp"

namespace meniscus::verify {
namespace {

constexpr int kCount = 150, kStride = 192;

// Inside nx x ny, some of them empty along one axis or both.
std::vector<cl_int> boxes(int nx, int ny, unsigned seed) {
  Random random(seed);
  std::vector<cl_int> box(4 * kStride, 0);
  for (int p = 0; p < kCount; ++p)
    for (const int axis : {0, 1}) {
      const int size = axis == 0 ? nx : ny, first = static_cast<int>(random(0, size));
      const double longest = p % 3 == 0 ? size : 5;
      box[2 * axis * kStride + p] = first;
      box[(2 * axis + 1) * kStride + p] =
          std::min(size - 1, first + static_cast<int>(random(-1.5, longest)));
    }
  return box;
}

// Calls see(i, j) for each place of a box.
template <class See>
void for_each(const std::vector<cl_int>& box, int p, const See& see) {
  for (int j = box[2 * kStride + p]; j <= box[3 * kStride + p]; ++j)
    for (int i = box[p]; i <= box[kStride + p]; ++i) see(i, j);
}

ReferenceError lists(Device& device, const SampleGrid& grid) {
  const BinGrid bins = bins_of(grid);
  const std::vector<cl_int> box = boxes(grid.nx, grid.ny, 3);
  Random random(4);
  std::vector<float> key(kStride), bound(bins.size());
  for (float& k : key) k = static_cast<float>(static_cast<int>(random(0, 20)));
  for (float& b : bound) b = static_cast<float>(static_cast<int>(random(5, 25)));
  bound[0] = kNoSurface;
  using Entry = std::tuple<int, int, int>;  // bin, particle, first and last of its box in the bin
  std::multiset<Entry> expected, found;
  for (int p = 0; p < kCount; ++p)
    for_each(box, p, [&](int i, int j) {
      const int i0 = box[p], i1 = box[kStride + p], j0 = box[2 * kStride + p];
      const int j1 = box[3 * kStride + p], bin = j / 8 * bins.nx + i / 8;
      // Once for each bin: at the first sample of the box that lies in it.
      if ((i % 8 != 0 && i != i0) || (j % 8 != 0 && j != j0) || key[p] > bound[bin]) return;
      expected.emplace(bin, p,
                       i % 8 | std::min(i1, i / 8 * 8 + 7) % 8 << 4 | j % 8 << 8 |
                           std::min(j1, j / 8 * 8 + 7) % 8 << 12);
    });
  draw_bins(device, {upload(device, box), upload(device, key), kCount, kStride},
            upload(device, bound), grid, [&](const BinLists& lists) {
              const auto end = download(device, lists.end);
              const auto entry = download(device, lists.entry);
              int e = 0;
              for (int bin = lists.first; bin < lists.last; ++bin)
                for (; e < end[bin]; ++e) found.emplace(bin, entry[e].s[0], entry[e].s[1]);
            });
  std::vector<Entry> differing;
  std::set_symmetric_difference(expected.begin(), expected.end(), found.begin(), found.end(),
                                std::back_inserter(differing));
  Worst worst("fill_bins", "entries that differ");
  worst.see(static_cast<double>(differing.size()), 0, 0, 1);
  return worst.error();
}

ReferenceError bounds(Device& device, const SampleGrid& grid) {
  Worst worst("bound_bins", "bound");
  for (const int shift : {1, 2, 3}) {
    const int side = 1 << shift;
    const int nx = (grid.nx + side - 1) / side, ny = (grid.ny + side - 1) / side;
    const std::vector<cl_int> box = boxes(nx, ny, 6);
    Random random(7);
    std::vector<float> deepest(kStride);
    for (float& d : deepest) d = static_cast<float>(random(1, 50));
    std::vector<float> cell(static_cast<std::size_t>(nx * ny), kNoSurface);
    for (int p = 0; p < kCount; ++p)
      for_each(box, p,
               [&](int i, int j) { cell[j * nx + i] = std::min(cell[j * nx + i], deepest[p]); });
    const BinGrid bins = bins_of(grid);
    std::vector<float> expected(bins.size(), 0.0f);
    for (int j = 0; j < grid.ny; ++j)
      for (int i = 0; i < grid.nx; ++i) {
        float& bound = expected[j / 8 * bins.nx + i / 8];
        bound = std::max(bound, cell[j / side * nx + i / side]);
      }
    const Covers covers{upload(device, box), upload(device, deepest), kCount, kStride};
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
