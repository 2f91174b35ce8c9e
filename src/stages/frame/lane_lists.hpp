// lane_lists: who lies near whom among all of some points, for loops that go through them eight at
// a time. A list of eight points that lie beside each other has four times as many entries as that
// of one, not eight times as many, and each entry's place is read once for all of them.
#pragma once

#include <cstdint>
#include <vector>

#include "stages/frame/cells.hpp"

namespace meniscus {

inline constexpr int kListLanes = 8;

/// Lists of so many points together as groups of up to kListLanes that follow each other in bucket
/// order and lie in one cell or two beside each other.
struct LaneLists {
  struct Group {
    std::int32_t first = 0, count = 0;  // points, in bucket order
    std::uint32_t runs = 0, near = 0;   // where its own begin in the block
    int rounds = 0;                     // in how many it is moved, see push_lanes.hpp
  };
  /// Points that are near some of a group: the first one, and how many.
  struct Run {
    std::int32_t first = 0;
    std::uint32_t count = 0;
  };
  struct Near {
    std::uint8_t step;   // from the one before in the run, in bucket order; 0 for the first
    std::uint8_t lanes;  // bit l: near the group's point l
  };
  struct Block {
    std::vector<Group> groups;  // and one behind the last, which ends the others
    std::vector<Run> runs;
    std::vector<Near> near;
  };
  std::vector<Block> blocks;

  /// Calls visit(place, lanes) for all that are near points of a group, in the order of cells, z,
  /// then y, then x, and in a cell as `item` is ordered: whatever else there is, a point sees the
  /// same others in the same order.
  template <class Visit>
  static void visit(const Block& block, std::size_t group, Visit&& visit) {
    const Near* near = block.near.data() + block.groups[group].near;
    for (std::uint32_t r = block.groups[group].runs; r < block.groups[group + 1].runs; ++r) {
      std::int32_t place = block.runs[r].first;
      for (const Near* const end = near + block.runs[r].count; near < end; ++near)
        visit(place += near->step, std::uint32_t{near->lanes});
    }
  }
};

/// Points that lie in cells of side `reach`, those of each cell together where cells share a
/// bucket. There are kListLanes - 1 more coordinates than points, so that loops may read eight.
Cells lane_cells(const std::vector<float>& x, const std::vector<float>& y,
                 const std::vector<float>& z, float reach);

/// All points nearer than `reach` to each (itself among them).
using ListLanes = LaneLists(const Cells& cells, float reach);
ListLanes list_lanes;

/// Those that this processor can run, all with the same result, the fastest first, which
/// list_lanes() is.
std::vector<ListLanes*> lane_listers();

}  // namespace meniscus
