// Bounds and lists of bins against loops on the host, on every device.
#include "stages/bins.hpp"

#include <algorithm>
#include <cmath>
#include <set>
#include <tuple>

#include "stages/stage_test_support.hpp"

namespace meniscus {
namespace {

using Bins = OnDevice;

constexpr int kCount = 150, kStride = 192;

// Boxes of all sizes inside nx x ny, some of them empty along one axis or both.
std::vector<cl_int> boxes(int nx, int ny, unsigned seed) {
  Random random(seed);
  std::vector<cl_int> box(4 * kStride, 0);
  for (int p = 0; p < kCount; ++p)
    for (const int axis : {0, 1}) {
      const int size = axis == 0 ? nx : ny;
      const int first = static_cast<int>(random(0, size));
      const double longest = p % 3 == 0 ? size : 5;
      box[2 * axis * kStride + p] = first;
      box[(2 * axis + 1) * kStride + p] =
          std::min(size - 1, first + static_cast<int>(random(-1.5, longest)));
    }
  return box;
}

const SampleGrid kGrids[] = {{61, 47, 0, 1}, {8, 16, 0, 1}, {1, 1, 0, 1}, {3, 90, 0, 1}};

TEST_P(Bins, HoldTheParticlesWhoseKeyIsAtMostTheBound) {
  for (const SampleGrid& grid : kGrids)
    for (const std::size_t most : {std::size_t{1} << 24, std::size_t{40}, std::size_t{1}}) {
      const BinGrid bins = bins_of(grid);
      const std::vector<cl_int> box = boxes(grid.nx, grid.ny, 3);
      Random random(4);
      std::vector<float> key(kStride), bound(bins.size());
      for (float& k : key) k = static_cast<float>(static_cast<int>(random(0, 20)));
      for (float& b : bound) b = static_cast<float>(static_cast<int>(random(5, 25)));
      bound[0] = kNoSurface;

      using Entry = std::tuple<int, int, int, int, int, int>;  // bin, particle, box in the bin
      std::multiset<Entry> expected;
      for (int p = 0; p < kCount; ++p)
        for (int j = box[2 * kStride + p]; j <= box[3 * kStride + p]; ++j)
          for (int i = box[p]; i <= box[kStride + p]; ++i) {
            // Once for each bin: at the first sample of the box that lies in it.
            if ((i % 8 != 0 && i != box[p]) || (j % 8 != 0 && j != box[2 * kStride + p])) continue;
            const int bin = j / 8 * bins.nx + i / 8;
            if (key[p] > bound[bin]) continue;
            expected.emplace(bin, p, i % 8, std::min(box[kStride + p], i / 8 * 8 + 7) % 8, j % 8,
                             std::min(box[3 * kStride + p], j / 8 * 8 + 7) % 8);
          }

      std::multiset<Entry> actual;
      int next = 0;
      std::size_t rounds = 0;
      const Outlines outlines{upload(device_, box), upload(device_, key), kCount, kStride};
      draw_bins(
          device_, outlines, upload(device_, bound), grid,
          [&](const BinLists& lists) {
            ++rounds;
            EXPECT_EQ(lists.first, next);
            ASSERT_GT(lists.last, lists.first);
            next = lists.last;
            const auto end = download(device_, lists.end);
            const auto entry = download(device_, lists.entry);
            int begin = 0;
            for (int bin = lists.first; bin < lists.last; begin = end[bin++]) {
              if (static_cast<std::size_t>(end[bin]) > most) {
                EXPECT_EQ(lists.last, lists.first + 1);
              }
              for (int e = begin; e < end[bin]; ++e) {
                const int packed = entry[e].s[1];
                actual.emplace(bin, entry[e].s[0], packed & 15, packed >> 4 & 15, packed >> 8 & 15,
                               packed >> 12 & 15);
              }
            }
          },
          most);
      EXPECT_EQ(next, static_cast<int>(bins.size()));
      EXPECT_EQ(actual, expected);
      if (most == 1 && expected.size() > bins.size()) {
        EXPECT_GT(rounds, bins.size() / 2);
      }
      EXPECT_EQ(download(device_, outlines.box), box) << "outlines may be listed again";
    }
}

TEST_P(Bins, BoundsAreTheDeepestOfTheCells) {
  for (const SampleGrid& grid : kGrids)
    for (const int shift : {1, 2, 3}) {
      const int side = 1 << shift;
      const int nx = (grid.nx + side - 1) / side, ny = (grid.ny + side - 1) / side;
      const std::vector<cl_int> box = boxes(nx, ny, 6);
      Random random(7);
      std::vector<float> deepest(kStride);
      for (float& d : deepest) d = static_cast<float>(random(1, 50));
      std::vector<float> cell(static_cast<std::size_t>(nx * ny), kNoSurface);
      for (int p = 0; p < kCount; ++p)
        for (int j = box[2 * kStride + p]; j <= box[3 * kStride + p]; ++j)
          for (int i = box[p]; i <= box[kStride + p]; ++i)
            cell[j * nx + i] = std::min(cell[j * nx + i], deepest[p]);
      const BinGrid bins = bins_of(grid);
      std::vector<float> expected(bins.size(), 0.0f);
      for (int j = 0; j < grid.ny; ++j)
        for (int i = 0; i < grid.nx; ++i) {
          float& bound = expected[j / 8 * bins.nx + i / 8];
          bound = std::max(bound, cell[j / side * nx + i / side]);
        }
      const Covers covers{upload(device_, box), upload(device_, deepest), kCount, kStride};
      EXPECT_EQ(download(device_, bound_bins(device_, covers, grid, shift)), expected);
    }
}

MENISCUS_ON_EVERY_DEVICE(Bins);

}  // namespace
}  // namespace meniscus
