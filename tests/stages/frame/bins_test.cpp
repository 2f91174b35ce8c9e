// Bounds and lists of bins against loops on the host, on every device.
#include "verify/reference/bins.hpp"

#include "stages/stage_test_support.hpp"

namespace meniscus {
namespace {

using reference::BinEntry, reference::kBoxes, reference::kBoxStride;

using Bins = OnDevice;

const SampleGrid kGrids[] = {{61, 47, 0, 1}, {8, 16, 0, 1}, {1, 1, 0, 1}, {3, 90, 0, 1}};

TEST_P(Bins, HoldTheParticlesWhoseKeyIsAtMostTheBound) {
  for (const SampleGrid& grid : kGrids)
    for (const std::size_t most : {std::size_t{1} << 24, std::size_t{40}, std::size_t{1}}) {
      const BinGrid bins = bins_of(grid);
      const std::vector<cl_int> box = reference::boxes(grid.nx, grid.ny, 3);
      const reference::KeysAndBounds of = reference::keys_and_bounds(bins);
      const std::multiset<BinEntry> expected = reference::bin_entries(box, of, bins);
      std::multiset<BinEntry> actual;
      int next = 0;
      std::size_t rounds = 0;
      const Outlines outlines{upload(device_, box), upload(device_, of.key), kBoxes, kBoxStride};
      draw_bins(
          device_, outlines, upload(device_, of.bound), grid,
          [&](const BinLists& lists) {
            ++rounds;
            EXPECT_EQ(lists.bins.begin, next);
            ASSERT_GT(lists.bins.end, lists.bins.begin);
            next = lists.bins.end;
            const auto end = download(device_, lists.end);
            const auto entry = download(device_, lists.entry);
            int begin = 0;
            for (int bin = lists.bins.begin; bin < lists.bins.end; begin = end[bin++]) {
              if (static_cast<std::size_t>(end[bin]) > most) {
                EXPECT_EQ(lists.bins.end, lists.bins.begin + 1);
              }
              for (int e = begin; e < end[bin]; ++e)
                actual.emplace(bin, entry[e].s[0], entry[e].s[1]);
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
  const std::vector<float> deepest = reference::box_depths();
  for (const SampleGrid& grid : kGrids)
    for (const int shift : {1, 2, 3}) {
      const std::vector<cl_int> box = reference::boxes_of_cells(grid, shift);
      const Covers covers{upload(device_, box), upload(device_, deepest), kBoxes, kBoxStride};
      EXPECT_EQ(download(device_, bound_bins(device_, covers, grid, shift)),
                reference::bin_bounds(box, deepest, grid, shift));
    }
}

MENISCUS_ON_EVERY_DEVICE(Bins);

}  // namespace
}  // namespace meniscus
