// What bins hold and what bounds them, by plain loops over the samples of every box (bins.cl).
#pragma once

#include <algorithm>
#include <set>
#include <tuple>
#include <vector>

#include "stages/frame/bins.hpp"
#include "verify/random.hpp"

namespace meniscus::reference {

inline constexpr int kBoxes = 150, kBoxStride = 192;

/// Boxes of all sizes inside nx x ny [4][kBoxStride], as of Outlines, some of them empty along one
/// axis or both.
inline std::vector<cl_int> boxes(int nx, int ny, unsigned seed) {
  Random random(seed);
  std::vector<cl_int> box(4 * kBoxStride, 0);
  for (int p = 0; p < kBoxes; ++p)
    for (const int axis : {0, 1}) {
      const int size = axis == 0 ? nx : ny, first = static_cast<int>(random(0, size));
      const double longest = p % 3 == 0 ? size : 5;
      box[2 * axis * kBoxStride + p] = first;
      box[(2 * axis + 1) * kBoxStride + p] =
          std::min(size - 1, first + static_cast<int>(random(-1.5, longest)));
    }
  return box;
}

/// Keys of the boxes and bounds of the bins, of which many are the same.
struct KeysAndBounds {
  std::vector<float> key, bound;
};

inline KeysAndBounds keys_and_bounds(const BinGrid& bins) {
  Random random(4);
  KeysAndBounds made{std::vector<float>(kBoxStride), std::vector<float>(bins.size())};
  for (float& k : made.key) k = static_cast<float>(static_cast<int>(random(0, 20)));
  for (float& b : made.bound) b = static_cast<float>(static_cast<int>(random(5, 25)));
  made.bound[0] = kNoSurface;
  return made;
}

/// Calls see(i, j) for each place of a box.
template <class See>
void for_each_place(const std::vector<cl_int>& box, int p, const See& see) {
  for (int j = box[2 * kBoxStride + p]; j <= box[3 * kBoxStride + p]; ++j)
    for (int i = box[p]; i <= box[kBoxStride + p]; ++i) see(i, j);
}

/// A bin, a box that it holds, and the part of the box in the bin, packed as in fill_bins.
using BinEntry = std::tuple<int, int, int>;

/// What the bins hold: boxes whose key is at most the bin's bound.
inline std::multiset<BinEntry> bin_entries(const std::vector<cl_int>& box, const KeysAndBounds& of,
                                           const BinGrid& bins) {
  std::multiset<BinEntry> entries;
  for (int p = 0; p < kBoxes; ++p)
    for_each_place(box, p, [&](int i, int j) {
      const int i0 = box[p], i1 = box[kBoxStride + p], j0 = box[2 * kBoxStride + p];
      const int j1 = box[3 * kBoxStride + p], bin = j / 8 * bins.nx + i / 8;
      // Once for each bin: at the first sample of the box that lies in it.
      if ((i % 8 != 0 && i != i0) || (j % 8 != 0 && j != j0) || of.key[p] > of.bound[bin]) return;
      entries.emplace(bin, p,
                      i % 8 | std::min(i1, i / 8 * 8 + 7) % 8 << 4 | j % 8 << 8 |
                          std::min(j1, j / 8 * 8 + 7) % 8 << 12);
    });
  return entries;
}

inline std::vector<float> box_depths() {
  Random random(7);
  std::vector<float> deepest(kBoxStride);
  for (float& d : deepest) d = static_cast<float>(random(1, 50));
  return deepest;
}

/// Cells of a side of 1 << shift samples that cover a grid, and boxes in them.
inline std::vector<cl_int> boxes_of_cells(const SampleGrid& grid, int shift) {
  const int side = 1 << shift;
  return boxes((grid.nx + side - 1) / side, (grid.ny + side - 1) / side, 6);
}

/// The deepest of each bin's cells, where a cell has the nearest depth of the boxes that hold it.
inline std::vector<float> bin_bounds(const std::vector<cl_int>& box,
                                     const std::vector<float>& deepest, const SampleGrid& grid,
                                     int shift) {
  const int side = 1 << shift;
  const int nx = (grid.nx + side - 1) / side, ny = (grid.ny + side - 1) / side;
  std::vector<float> cell(static_cast<std::size_t>(nx * ny), kNoSurface);
  for (int p = 0; p < kBoxes; ++p)
    for_each_place(
        box, p, [&](int i, int j) { cell[j * nx + i] = std::min(cell[j * nx + i], deepest[p]); });
  const BinGrid bins = bins_of(grid);
  std::vector<float> bounds(bins.size(), 0.0f);
  for (int j = 0; j < grid.ny; ++j)
    for (int i = 0; i < grid.nx; ++i) {
      float& bound = bounds[j / 8 * bins.nx + i / 8];
      bound = std::max(bound, cell[j / side * nx + i / side]);
    }
  return bounds;
}

}  // namespace meniscus::reference
