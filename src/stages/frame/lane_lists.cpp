#include "stages/frame/lane_lists.hpp"

#include <algorithm>
#include <array>
#include <cstddef>
#include <numeric>
#include <type_traits>

#include "base/parallel.hpp"
#include "base/x86.hpp"

namespace meniscus {
namespace {

constexpr std::int32_t kBlockPoints = 1024;

// The cells of the points of a group: one, or that and the next along x.
struct GroupCells {
  std::array<std::int32_t, 3> at{};
  std::uint32_t in_first = 0, in_next = 0;  // lanes
};

std::array<std::int32_t, 3> cell_at(const Cells& cells, std::int32_t p) {
  const auto along = [&](const std::vector<float>& of) {
    return cell_of(of[static_cast<std::size_t>(p)], cells.inverse_cell);
  };
  return {along(cells.x), along(cells.y), along(cells.z)};
}

// The group that begins at a point, before `end`.
GroupCells group_from(const Cells& cells, std::int32_t end, LaneLists::Group& group) {
  GroupCells own{cell_at(cells, group.first), 1, 0};
  for (group.count = 1; group.count < kListLanes && group.first + group.count < end;
       ++group.count) {
    std::array<std::int32_t, 3> at = cell_at(cells, group.first + group.count);
    const std::uint32_t lane = 1u << group.count;
    if (at == own.at && own.in_next == 0) {
      own.in_first |= lane;
    } else {
      --at[0];
      if (at != own.at) break;
      own.in_next |= lane;
    }
  }
  return own;
}

// Where the points of a group are; of those behind the last the last once more.
struct LanePlaces {
  std::array<float, kListLanes> x, y, z;
};

LanePlaces places_of(const Cells& cells, const LaneLists::Group& group) {
  LanePlaces at;
  for (std::int32_t lane = 0; lane < kListLanes; ++lane) {
    const auto p = static_cast<std::size_t>(group.first + std::min(lane, group.count - 1));
    const auto l = static_cast<std::size_t>(lane);
    at.x[l] = cells.x[p];
    at.y[l] = cells.y[p];
    at.z[l] = cells.z[p];
  }
  return at;
}

// What is near a group.
struct Found {
  std::vector<std::int32_t> place;
  std::vector<std::uint8_t> lanes;
  std::size_t count = 0;

  // Makes room for so many more.
  void reserve(std::size_t more) {
    if (place.size() >= count + more) return;
    place.resize(2 * (count + more));
    lanes.resize(2 * (count + more));
  }
};

// Adds those of points [begin, end), as far as their tag is this, that are near some of the
// `allowed` lanes. Without branches, which would be mispredicted.
using FindLanes = void(const Cells& cells, std::int32_t begin, std::int32_t end, std::uint32_t tag,
                       const LanePlaces& at, float squared_reach, std::uint32_t allowed,
                       Found& found);

void find_lanes(const Cells& cells, std::int32_t begin, std::int32_t end, std::uint32_t tag,
                const LanePlaces& at, float squared_reach, std::uint32_t allowed, Found& found) {
  for (std::int32_t place = begin; place < end; ++place) {
    const std::size_t p = static_cast<std::size_t>(place);
    std::uint32_t lanes = 0;
    for (std::size_t lane = 0; lane < kListLanes; ++lane) {
      const float dx = cells.x[p] - at.x[lane], dy = cells.y[p] - at.y[lane],
                  dz = cells.z[p] - at.z[lane];
      lanes |= static_cast<std::uint32_t>(dx * dx + dy * dy + dz * dz < squared_reach) << lane;
    }
    lanes &= allowed;
    found.place[found.count] = place;
    found.lanes[found.count] = static_cast<std::uint8_t>(lanes);
    found.count += (cells.tag[p] == tag) & (lanes != 0);
  }
}

#ifdef MENISCUS_X86
// All lanes at a time.
__attribute__((target("avx2"))) void find_lanes_avx2(const Cells& cells, std::int32_t begin,
                                                     std::int32_t end, std::uint32_t tag,
                                                     const LanePlaces& at, float squared_reach,
                                                     std::uint32_t allowed, Found& found) {
  static_assert(kListLanes == 8);
  const __m256 x = _mm256_loadu_ps(at.x.data()), y = _mm256_loadu_ps(at.y.data()),
               z = _mm256_loadu_ps(at.z.data()), most = _mm256_set1_ps(squared_reach);
  std::int32_t* place = found.place.data() + found.count;
  std::uint8_t* to = found.lanes.data() + found.count;
  for (std::int32_t p = begin; p < end; ++p) {
    const __m256 dx = _mm256_sub_ps(_mm256_broadcast_ss(cells.x.data() + p), x),
                 dy = _mm256_sub_ps(_mm256_broadcast_ss(cells.y.data() + p), y),
                 dz = _mm256_sub_ps(_mm256_broadcast_ss(cells.z.data() + p), z);
    const __m256 squared = _mm256_add_ps(
        _mm256_add_ps(_mm256_mul_ps(dx, dx), _mm256_mul_ps(dy, dy)), _mm256_mul_ps(dz, dz));
    const std::uint32_t lanes =
        static_cast<std::uint32_t>(_mm256_movemask_ps(_mm256_cmp_ps(squared, most, _CMP_LT_OQ))) &
        allowed;
    *place = p;
    *to = static_cast<std::uint8_t>(lanes);
    const std::ptrdiff_t more = (cells.tag[static_cast<std::size_t>(p)] == tag) & (lanes != 0);
    place += more;
    to += more;
  }
  found.count = static_cast<std::size_t>(to - found.lanes.data());
}
#endif

// Puts down what was found for a group.
void add_runs(const Found& found, LaneLists::Block& block) {
  std::int32_t last = 0;
  for (std::size_t k = 0; k < found.count; ++k) {
    const std::int32_t step = found.place[k] - last;
    const bool goes_on = k > 0 && step > 0 && step <= 255;
    if (!goes_on) block.runs.push_back({found.place[k], 0});
    block.near.push_back({static_cast<std::uint8_t>(goes_on ? step : 0), found.lanes[k]});
    ++block.runs.back().count;
    last = found.place[k];
  }
}

// What lies near a group, in the cells around its own.
template <FindLanes* find>
void look_around(const Cells& cells, const LaneLists::Group& group, const GroupCells& own,
                 float reach, Found& found) {
  const LanePlaces at = places_of(cells, group);
  const std::uint32_t all = own.in_first | own.in_next;
  const std::array allowed{own.in_first, all, all, own.in_next};
  found.count = 0;
  for (std::int32_t k = -1; k <= 1; ++k)
    for (std::int32_t j = -1; j <= 1; ++j)
      for (std::int32_t i = -1; i <= (own.in_next != 0 ? 2 : 1); ++i) {
        const std::int32_t x = own.at[0] + i, y = own.at[1] + j, z = own.at[2] + k;
        const std::uint32_t bucket = bucket_of(x, y, z, cells.mask);
        const std::int32_t begin = cells.start[bucket], end = cells.start[bucket + 1];
        found.reserve(static_cast<std::size_t>(end - begin) + 1);
        find(cells, begin, end, tag_of(x, y, z), at, reach * reach,
             allowed[static_cast<std::size_t>(i + 1)], found);
      }
}

template <FindLanes* find>
LaneLists::Block list_block(const Cells& cells, std::int32_t begin, std::int32_t end, float reach) {
  LaneLists::Block block;
  Found found;
  for (LaneLists::Group group{begin}; group.first < end; group.first += group.count) {
    const GroupCells own = group_from(cells, end, group);
    group.runs = static_cast<std::uint32_t>(block.runs.size());
    group.near = static_cast<std::uint32_t>(block.near.size());
    look_around<find>(cells, group, own, reach, found);
    add_runs(found, block);
    block.groups.push_back(group);
  }
  block.groups.push_back({end, 0, static_cast<std::uint32_t>(block.runs.size()),
                          static_cast<std::uint32_t>(block.near.size()), 0});
  block.runs.shrink_to_fit();
  block.near.shrink_to_fit();
  return block;
}

template <FindLanes* find>
LaneLists list_by(const Cells& cells, float reach) {
  const auto n = static_cast<std::int32_t>(cells.item.size());
  LaneLists lists;
  lists.blocks.resize(static_cast<std::size_t>((n + kBlockPoints - 1) / kBlockPoints));
  parallel_for(lists.blocks.size(), 1, [&](std::size_t begin, std::size_t end) {
    for (std::size_t b = begin; b < end; ++b) {
      const std::int32_t first = static_cast<std::int32_t>(b) * kBlockPoints;
      lists.blocks[b] = list_block<find>(cells, first, std::min(n, first + kBlockPoints), reach);
    }
  });
  return lists;
}

// Puts the points of each cell together where several share a bucket.
void part_buckets(Cells& cells) {
  std::vector<std::int32_t> order;
  for (std::uint32_t bucket = 0; bucket <= cells.mask; ++bucket) {
    const std::int32_t begin = cells.start[bucket], end = cells.start[bucket + 1];
    const auto tags = cells.tag.begin();
    if (std::adjacent_find(tags + begin, tags + end, std::not_equal_to<>()) == tags + end) continue;
    order.resize(static_cast<std::size_t>(end - begin));
    std::iota(order.begin(), order.end(), begin);
    std::stable_sort(order.begin(), order.end(), [&](std::int32_t a, std::int32_t b) {
      return cells.tag[static_cast<std::size_t>(a)] < cells.tag[static_cast<std::size_t>(b)];
    });
    const auto put = [&](auto& values) {
      std::remove_reference_t<decltype(values)> sorted;
      for (const std::int32_t p : order) sorted.push_back(values[static_cast<std::size_t>(p)]);
      std::copy(sorted.begin(), sorted.end(), values.begin() + begin);
    };
    put(cells.x);
    put(cells.y);
    put(cells.z);
    put(cells.item);
    put(cells.tag);
  }
}

}  // namespace

Cells lane_cells(const std::vector<float>& x, const std::vector<float>& y,
                 const std::vector<float>& z, float reach) {
  Cells cells = make_cells(x, y, z, reach);
  part_buckets(cells);
  for (std::vector<float>* const values : {&cells.x, &cells.y, &cells.z})
    values->resize(x.size() + kListLanes - 1, 0);
  return cells;
}

LaneLists list_lanes(const Cells& cells, float reach) { return lane_listers()[0](cells, reach); }

std::vector<ListLanes*> lane_listers() {
#ifdef MENISCUS_X86
  if (__builtin_cpu_supports("avx2")) return {list_by<find_lanes_avx2>, list_by<find_lanes>};
#endif
  return {list_by<find_lanes>};
}

}  // namespace meniscus
