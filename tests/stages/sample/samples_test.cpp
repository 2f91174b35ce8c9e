// Lists of samples against what they must hold, on every device.
#include "stages/sample/samples.hpp"

#include <algorithm>
#include <set>

#include "stages/stage_test_support.hpp"
#include "verify/stage_cases/into_new.hpp"

namespace meniscus {
namespace {

using Samples = OnDevice;

const SampleGrid kGrids[] = {{37, 21, 0.5f, 1}, {16, 32, 0, 2}, {1, 1, 0.5f, 1}, {70, 3, 0.5f, 1}};

std::vector<float> random_map(std::size_t n, unsigned seed) {
  Random random(seed);
  std::vector<float> map(n);
  for (float& value : map) {
    const double x = random(0, 1);
    value = x < 0.6 ? kNoSurface : static_cast<float>(10 + x);
  }
  return map;
}

// The listed samples; each must be named once, in the list of its own tile.
std::set<int> listed(Device& device, const SampleLists& lists) {
  const std::vector<cl_int> sample = download(device, lists.sample);
  const std::vector<cl_int> count = download(device, lists.count);
  std::set<int> all;
  for (std::size_t t = 0; t < lists.tiles(); ++t) {
    EXPECT_LE(count[t], 256);
    for (cl_int k = 0; k < count[t]; ++k) {
      const int s = sample[t * 256 + static_cast<std::size_t>(k)];
      const int tile = s / lists.grid.nx / 16 * lists.nx + s % lists.grid.nx / 16;
      EXPECT_EQ(tile, static_cast<int>(t));
      EXPECT_TRUE(all.insert(s).second) << "sample " << s << " is listed twice";
    }
  }
  return all;
}

// The samples of every `every`th row and column where a map is finite.
std::set<int> finite_ones(const SampleGrid& grid, const std::vector<float>& map, int every) {
  std::set<int> all;
  for (int s = 0; s < static_cast<int>(grid.size()); ++s)
    if (map[s] < kNoSurface && s % grid.nx % every == 0 && s / grid.nx % every == 0) all.insert(s);
  return all;
}

TEST_P(Samples, AreThoseWhereAMapIsFinite) {
  for (const SampleGrid& grid : kGrids) {
    const std::vector<float> map = random_map(grid.size(), 1);
    EXPECT_EQ(listed(device_, list_gaps(device_, grid, upload(device_, map), 0).lists),
              finite_ones(grid, map, 1));
  }
}

TEST_P(Samples, AreThoseOnTheLatticeWhereFrontsAre) {
  for (const SampleGrid& grid : kGrids)
    for (const int every : {1, 2, 4}) {
      const std::vector<float> fronts = random_map(grid.size(), 6),
                               splash = random_map(grid.size(), 7);
      const auto reference = upload(device_, fronts), splash_reference = upload(device_, splash);
      const OccupiedBlocks any = any_blocks(device_, grid);
      const LayerSamples lists =
          list_fronts(device_, grid, {reference, splash_reference, any, any}, every);
      EXPECT_EQ(listed(device_, lists.surface), finite_ones(grid, fronts, every));
      EXPECT_EQ(listed(device_, lists.splash), finite_ones(grid, splash, every));
    }
}

TEST_P(Samples, AreNotSoughtInBlocksThatAreNotOccupied) {
  for (const SampleGrid& grid : kGrids) {
    const std::vector<float> map = random_map(grid.size(), 2);
    const int across = (grid.nx + 15) / 16 * 2;
    std::vector<cl_int> occupied(static_cast<std::size_t>(across * ((grid.ny + 15) / 16 * 2)));
    for (std::size_t k = 0; k < occupied.size(); k += 3) occupied[k] = 1;
    std::set<int> expected;
    for (int s = 0; s < static_cast<int>(grid.size()); ++s)
      if (map[s] < kNoSurface && (s / grid.nx / 8 * across + s % grid.nx / 8) % 3 == 0)
        expected.insert(s);
    EXPECT_EQ(
        listed(device_, list_gaps(device_, grid, upload(device_, map), upload(device_, occupied),
                                  blocks_of(device_, grid, false), 0)
                            .lists),
        expected);
  }
}

TEST_P(Samples, AreThoseThatCellsWant) {
  for (const SampleGrid& grid : kGrids)
    for (const int every : {1, 2, 4, 8}) {
      const int stride = (grid.nx + 15) / 16 * 8;
      std::vector<cl_uchar> wanted(static_cast<std::size_t>(stride) * ((grid.ny + 15) / 16 * 8));
      Random random(5);
      std::set<int> surface, splash;
      for (int s = 0; s < static_cast<int>(grid.size()); ++s) {
        const int i = s % grid.nx / every, j = s / grid.nx / every;
        if (s % grid.nx % every != 0 || s / grid.nx % every != 0 || (i % 2 == 0 && j % 2 == 0))
          continue;
        const int which = random(0, 6);
        const bool shows = which < 3;
        // Some cells want nothing of the one or of the other.
        if (which == 6 || (shows ? i / 16 % 3 == 0 : i / 16 % 3 == 1)) continue;
        wanted[static_cast<std::size_t>(j / 2 * stride + i / 2)] |=
            static_cast<cl_uchar>(1 << ((shows ? 0 : 3) + i % 2 + 2 * (j % 2) - 1));
        (shows ? surface : splash).insert(s);
      }
      const ListedBlocks blocks = blocks_of(device_, grid, false);
      const LayerSamples lists =
          list_between(device_, grid, upload(device_, wanted), stride, every, blocks);
      EXPECT_EQ(listed(device_, lists.surface), surface);
      EXPECT_EQ(listed(device_, lists.splash), splash);
      std::set<int> expected_blocks, found_blocks;
      const int across = (grid.nx + 15) / 16 * 2;
      for (const std::set<int>& all : {surface, splash})
        for (const int s : all) expected_blocks.insert(s / grid.nx / 8 * across + s % grid.nx / 8);
      const std::vector<cl_uchar> in_blocks = download(device_, blocks);
      for (int k = 0; k < static_cast<int>(in_blocks.size()); ++k)
        if (in_blocks[static_cast<std::size_t>(k)]) found_blocks.insert(k);
      EXPECT_EQ(found_blocks, expected_blocks);
    }
}

TEST_P(Samples, AreKeptWhereTheyLieNearer) {
  for (const SampleGrid& grid : kGrids) {
    const std::vector<float> a = random_map(grid.size(), 3), b = random_map(grid.size(), 4);
    const auto near = upload(device_, a), far = upload(device_, b);
    const auto all = filled<float>(device_, grid.size(), 0.0f);
    const SampleLists lists = list_gaps(device_, grid, all, 0).lists;
    const std::vector<float> c = random_map(grid.size(), 6);
    std::set<int> nearer, unless;
    for (int s = 0; s < static_cast<int>(grid.size()); ++s) {
      if (a[s] < b[s]) nearer.insert(s);
      if (a[s] < b[s] && !(c[s] < kNoSurface)) unless.insert(s);
    }
    EXPECT_EQ(listed(device_, keep_samples(device_, lists, near, far)), nearer);
    EXPECT_EQ(listed(device_, keep_samples(device_, lists, near, far, upload(device_, c))), unless);
  }
}

TEST_P(Samples, NeighboursInAListLieCloseTogether) {
  const SampleGrid grid{32, 32, 0.5f, 1};
  const auto all = filled<float>(device_, grid.size(), 0.0f);
  const std::vector<cl_int> sample =
      download(device_, list_gaps(device_, grid, all, 0).lists.sample);
  // Eight places of a full list are a block of 4 x 2 samples.
  for (std::size_t first = 0; first < sample.size(); first += 8) {
    const auto [low, high] =
        std::minmax_element(sample.begin() + static_cast<std::ptrdiff_t>(first),
                            sample.begin() + static_cast<std::ptrdiff_t>(first + 8),
                            [&](cl_int a, cl_int b) { return a % grid.nx < b % grid.nx; });
    EXPECT_EQ(*high % grid.nx - *low % grid.nx, 3);
    EXPECT_EQ(sample[first + 7] / grid.nx - sample[first] / grid.nx, 1);
  }
}

MENISCUS_ON_EVERY_DEVICE(Samples);

}  // namespace
}  // namespace meniscus
