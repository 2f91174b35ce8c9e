// Lists of eight points together, and the forces that go through them, against loops over pairs.
#include "stages/frame/lane_lists.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cstddef>
#include <tuple>
#include <vector>

#include "stages/frame/push_lanes.hpp"
#include "verify/stage_cases/inputs.hpp"

namespace meniscus {
namespace {

constexpr float kReach = 4.4f;

// A block of fluid, a crowd of which a cell holds more than a step can tell, and drops so far away
// that many cells share a bucket with others.
Places clumps() {
  Random random(11);
  Places places;
  const auto add = [&](int count, double low, double high) {
    for (int k = 0; k < count; ++k)
      for (std::vector<float>* const of : {&places.x, &places.y, &places.z})
        of->push_back(static_cast<float>(random(low, high)));
  };
  add(3000, 0, 29);
  add(700, 60, 63);
  add(900, -4000, 4000);
  return places;
}

// The places in their canonical order, z, y, x of cells, that each of some points sees.
std::vector<std::vector<std::int32_t>> seen_by_all(const Places& places,
                                                   ListLanes* list = list_lanes) {
  const Cells cells = lane_cells(places.x, places.y, places.z, kReach);
  std::vector<std::vector<std::int32_t>> seen(places.x.size());
  for (const LaneLists::Block& block : list(cells, kReach).blocks)
    for (std::size_t g = 0; g + 1 < block.groups.size(); ++g)
      LaneLists::visit(block, g, [&](std::int32_t place, std::uint32_t lanes) {
        EXPECT_LT(lanes, 1u << block.groups[g].count);
        for (std::int32_t lane = 0; lane < block.groups[g].count; ++lane)
          if (lanes >> lane & 1)
            seen[static_cast<std::size_t>(
                     cells.item[static_cast<std::size_t>(block.groups[g].first + lane)])]
                .push_back(cells.item[static_cast<std::size_t>(place)]);
      });
  return seen;
}

TEST(LaneLists, HaveAllThatIsNearInTheOrderOfCells) {
  const Places places = clumps();
  const auto seen = seen_by_all(places);
  std::size_t most = 0;
  for (std::size_t i = 0; i < places.x.size(); ++i) {
    std::vector<std::tuple<std::int32_t, std::int32_t, std::int32_t, std::int32_t>> expected;
    for (std::size_t j = 0; j < places.x.size(); ++j) {
      const float dx = places.x[j] - places.x[i], dy = places.y[j] - places.y[i],
                  dz = places.z[j] - places.z[i];
      if (dx * dx + dy * dy + dz * dz < kReach * kReach)
        expected.emplace_back(cell_of(places.z[j], 1 / kReach), cell_of(places.y[j], 1 / kReach),
                              cell_of(places.x[j], 1 / kReach), static_cast<std::int32_t>(j));
    }
    std::sort(expected.begin(), expected.end());
    ASSERT_EQ(seen[i].size(), expected.size()) << i;
    for (std::size_t k = 0; k < expected.size(); ++k)
      ASSERT_EQ(seen[i][k], std::get<3>(expected[k])) << i;
    most = std::max(most, expected.size());
  }
  EXPECT_GT(most, 256u);
  for (ListLanes* const list : lane_listers()) EXPECT_TRUE(seen_by_all(places, list) == seen);
}

TEST(LaneLists, AreFullWhereFluidIsDense) {
  Places places;
  Random random(3);
  for (int k = 0; k < 27000; ++k)
    for (std::vector<float>* const of : {&places.x, &places.y, &places.z})
      of->push_back(static_cast<float>(random(0, 60)));
  std::size_t groups = 0;
  for (const LaneLists::Block& block :
       list_lanes(lane_cells(places.x, places.y, places.z, kReach), kReach).blocks)
    groups += block.groups.size() - 1;
  EXPECT_LT(static_cast<double>(groups), 1.25 * 27000 / kListLanes);
}

TEST(LaneLists, MayBeEmpty) {
  EXPECT_TRUE(list_lanes(lane_cells({}, {}, {}, kReach), kReach).blocks.empty());
}

TEST(PushLanes, DoesWhatALoopOverPairsDoes) {
  const Places places = clumps();
  const auto seen = seen_by_all(places);
  Cells cells = lane_cells(places.x, places.y, places.z, kReach);
  LaneLists lists = list_lanes(cells, kReach);
  for (LaneLists::Block& block : lists.blocks)
    for (LaneLists::Group& group : block.groups) group.rounds = 3;
  const PairForce force{1 / 16.0f, 1 / 5.3f, 0.4f};
  // Some have come nearer than they were, others gone out of reach.
  Places from{cells.x, cells.y, cells.z};
  Random random(5);
  for (std::vector<float>* const of : {&from.x, &from.y, &from.z})
    for (float& value : *of) value += static_cast<float>(random(-0.6, 0.6));
  std::vector<std::size_t> place_of(cells.item.size());
  for (std::size_t p = 0; p < cells.item.size(); ++p)
    place_of[static_cast<std::size_t>(cells.item[p])] = p;
  for (PushLanes* const push : lane_pushers()) {
    Places as_before = from;
    for (const LaneLists::Block& block : lists.blocks) push(block, force, 3, from, as_before);
    EXPECT_EQ(as_before.x, from.x) << "groups of three rounds";
    Places to = from;
    for (const LaneLists::Block& block : lists.blocks) push(block, force, 2, from, to);
    for (std::size_t i = 0; i < seen.size(); ++i) {
      const std::size_t p = place_of[i];
      std::array<float, 3> sum{};
      for (const std::int32_t other : seen[i]) {
        const std::size_t q = place_of[static_cast<std::size_t>(other)];
        const std::array d{from.x[p] - from.x[q], from.y[p] - from.y[q], from.z[p] - from.z[q]};
        const float squared = d[0] * d[0] + d[1] * d[1] + d[2] * d[2];
        const float fades = std::max(1 - squared * force.far, 0.0f), fades2 = fades * fades;
        const float by = (1 - squared * force.rest) * (fades2 * fades2);
        for (std::size_t axis = 0; axis < 3; ++axis) sum[axis] += d[axis] * by;
      }
      // The same bits, which is why lanes may be as they are.
      ASSERT_EQ(to.x[p], from.x[p] + force.step * sum[0]);
      ASSERT_EQ(to.y[p], from.y[p] + force.step * sum[1]);
      ASSERT_EQ(to.z[p], from.z[p] + force.step * sum[2]);
    }
  }
}

}  // namespace
}  // namespace meniscus
