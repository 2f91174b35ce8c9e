#include "stages/closed/space_grid.hpp"

#include <algorithm>
#include <atomic>
#include <mutex>

#include "base/key_table.hpp"
#include "base/parallel.hpp"
#include "base/printed.hpp"
#include "base/rounded_up.hpp"
#include "meniscus/error.hpp"
#include "stages/frame/cells.hpp"

namespace meniscus {
namespace {

constexpr std::size_t kMostBlocks = std::size_t{1} << 24;  // 6 GiB
constexpr std::int64_t kFarthestBlock = (1 << 20) - 2;     // in a key, to either side
constexpr std::size_t kGrain = 64, kPointGrain = 1024;     // blocks, points that are worth a thread

using Place = std::array<std::int32_t, 3>;

Place place_of(std::uint64_t key) {
  const auto part = [&](int shift) {
    return static_cast<std::int32_t>(key >> shift & 0x1fffff) - (1 << 20);
  };
  return {part(0), part(21), part(42)};
}

static_assert(static_cast<std::int32_t>(KeyTable::kNone) == kNoBlock);
std::int32_t find_block(const SpaceGrid& grid, std::uint64_t key) {
  return static_cast<std::int32_t>(grid.numbers.find(key));
}

// Finds who is around the blocks from the first one on, which are new. Of two new blocks the one
// that comes behind the other, z, y, x, looks for it, and both note each other.
void find_around(SpaceGrid& grid, std::size_t first) {
  constexpr int kSelf = 13;
  std::array<std::int32_t, 27> nobody;
  nobody.fill(kNoBlock);
  grid.around.resize(grid.blocks.size(), nobody);
  parallel_for(grid.blocks.size() - first, kGrain, [&](std::size_t begin, std::size_t end) {
    for (std::size_t b = first + begin; b < first + end; ++b) {
      const Place& at = grid.blocks[b].at;
      grid.around[b][kSelf] = static_cast<std::int32_t>(b);
      for (int n = 0; n < (first > 0 ? 27 : kSelf); ++n) {
        if (n == kSelf) continue;
        const std::int32_t other =
            find_block(grid, key_of({at[0] + n % 3 - 1, at[1] + n / 3 % 3 - 1, at[2] + n / 9 - 1}));
        if (other == kNoBlock || (n > kSelf && static_cast<std::size_t>(other) >= first)) continue;
        grid.around[b][static_cast<std::size_t>(n)] = other;
        grid.around[static_cast<std::size_t>(other)][static_cast<std::size_t>(26 - n)] =
            static_cast<std::int32_t>(b);
      }
    }
  });
}

// Adds blocks that are not there, in the order of their keys, and finds who is around whom.
void add_blocks(SpaceGrid& grid, std::vector<std::uint64_t> keys) {
  std::sort(keys.begin(), keys.end());
  keys.erase(std::unique(keys.begin(), keys.end()), keys.end());
  if (grid.blocks.size() + keys.size() > kMostBlocks)
    refuse_cells(grid.cell, "the surface takes more than " +
                                grouped(static_cast<std::int64_t>(kMostBlocks * 64)) +
                                " corners of cells");
  const std::size_t first = grid.blocks.size();
  grid.blocks.reserve(first + keys.size());
  for (const std::uint64_t key : keys) {
    grid.numbers.add(key);
    grid.blocks.push_back({.at = place_of(key)});
  }
  find_around(grid, first);
}

// Corners of a block and of those around it, as in SpaceGrid::around.
using CornersAround = std::array<std::uint64_t, 27>;

// The 18 corners of the cells around an edge: two along its axis, three along the others.
constexpr CornersAround corners_around(int bit, int axis) {
  CornersAround corners{};
  const int b = (axis + 1) % 3, c = (axis + 2) % 3;
  for (int along = 0; along <= 1; ++along)
    for (int db = -1; db <= 1; ++db)
      for (int dc = -1; dc <= 1; ++dc) {
        std::array<int, 3> at = place_in_block(bit);  // from the block before on
        at[axis] += kBlockSide + along;
        at[b] += kBlockSide + db;
        at[c] += kBlockSide + dc;
        corners[at[0] / 4 + 3 * (at[1] / 4) + 9 * (at[2] / 4)] |=
            std::uint64_t{1} << (at[0] % 4 + 4 * (at[1] % 4) + 16 * (at[2] % 4));
      }
  return corners;
}

// Of each axis and each bit at an edge's lower end.
constexpr auto kCornersAround = [] {
  std::array<std::array<CornersAround, 64>, 3> all{};
  for (int axis = 0; axis < 3; ++axis)
    for (int bit = 0; bit < 64; ++bit) all[axis][bit] = corners_around(bit, axis);
  return all;
}();

// floor(), which without SSE 4.1 is a call.
std::int64_t floor_of(double value) {
  const auto cut = static_cast<std::int64_t>(value);
  return cut - (value < static_cast<double>(cut) ? 1 : 0);
}

// The corners that may lie within `reach` of a point: from the first to the last one along each
// axis.
struct CornerRange {
  std::array<std::int64_t, 3> first, last;

  CornerRange(const std::array<double, 3>& point, double reach, double cell) {
    for (std::size_t axis = 0; axis < 3; ++axis) {
      first[axis] = -floor_of(-((point[axis] - reach) / cell));
      last[axis] = floor_of((point[axis] + reach) / cell);
    }
  }
};

std::int64_t block_of(std::int64_t corner) { return corner >> 2; }
static_assert(kBlockSide == 1 << 2);

// The corners of block `at` within `reach` of a point, around which they lie in `range`.
std::uint64_t corners_near(const std::array<double, 3>& point, const CornerRange& range,
                           double reach, double cell, const std::array<std::int64_t, 3>& at) {
  const double side = kBlockSide * cell, squared = reach * reach;
  std::array<int, 3> first, last;
  double apart[3][kBlockSide];  // squared distances along each axis of the block's planes
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const std::int64_t origin = kBlockSide * at[axis];
    first[axis] = static_cast<int>(std::max<std::int64_t>(range.first[axis] - origin, 0));
    last[axis] =
        static_cast<int>(std::min<std::int64_t>(range.last[axis] - origin, kBlockSide - 1));
    for (int c = first[axis]; c <= last[axis]; ++c) {
      const double along = side * static_cast<double>(at[axis]) + cell * c - point[axis];
      apart[axis][c] = along * along;
    }
  }
  std::uint64_t near = 0;
  for (int z = first[2]; z <= last[2]; ++z)
    for (int y = first[1]; y <= last[1]; ++y) {
      const double y2 = apart[1][y], z2 = apart[2][z];
      for (int x = first[0]; x <= last[0]; ++x)
        near |= std::uint64_t{apart[0][x] + y2 + z2 <= squared} << (x + 4 * y + 16 * z);
    }
  return near;
}

// Some corners of a block: its key, and their mask.
using BlockCorners = std::pair<std::uint64_t, std::uint64_t>;

// The corners within `reach` of the points, in no order, and some of the blocks several times.
std::vector<BlockCorners> near_corners(const Points& points, double reach, double cell) {
  std::mutex joining;
  std::vector<BlockCorners> all;
  std::atomic<bool> too_far{false};
  parallel_for(points.size(), kPointGrain, [&](std::size_t begin, std::size_t end) {
    std::vector<BlockCorners> own;
    KeyTable seen;
    for (std::size_t p = begin; p < end; ++p) {
      const std::array<double, 3> point{points.x[p], points.y[p], points.z[p]};
      const CornerRange range(point, reach, cell);
      std::array<std::int64_t, 3> first, last;
      for (std::size_t axis = 0; axis < 3; ++axis) {
        first[axis] = block_of(range.first[axis]);
        last[axis] = block_of(range.last[axis]);
        if (first[axis] < -kFarthestBlock || last[axis] > kFarthestBlock) too_far = true;
      }
      if (too_far) return;
      for (std::int64_t k = first[2]; k <= last[2]; ++k)
        for (std::int64_t j = first[1]; j <= last[1]; ++j)
          for (std::int64_t i = first[0]; i <= last[0]; ++i) {
            const std::uint64_t key =
                key_of({static_cast<std::int32_t>(i), static_cast<std::int32_t>(j),
                        static_cast<std::int32_t>(k)});
            const std::uint32_t number = seen.add(key);
            if (number == own.size()) own.emplace_back(key, 0);
            own[number].second |= corners_near(point, range, reach, cell, {i, j, k});
          }
    }
    const std::scoped_lock lock(joining);
    all.insert(all.end(), own.begin(), own.end());
  });
  if (too_far)
    refuse_cells(cell, "the particles span more than " + grouped(8 * kFarthestBlock) + " cells");
  return all;
}

// Wants corners of blocks, which are added where they are not there.
void want_blocks(SpaceGrid& grid, const std::vector<BlockCorners>& corners) {
  std::vector<std::uint64_t> keys;
  keys.reserve(corners.size());
  for (const auto& [key, mask] : corners) keys.push_back(key);
  add_blocks(grid, std::move(keys));
  for (const auto& [key, mask] : corners)
    grid.blocks[static_cast<std::size_t>(find_block(grid, key))].wanted |= mask;
}

// Wants those corners of the block around another one that are not known. Returns whether there are
// any; where the block is not there, adds them to `missing`.
bool want_corners(SpaceGrid& grid, std::size_t from, std::size_t around, std::uint64_t corners,
                  std::vector<BlockCorners>& missing) {
  const std::int32_t block = grid.around[from][around];
  if (block != kNoBlock) corners &= ~grid.blocks[static_cast<std::size_t>(block)].known;
  if (corners == 0) return false;
  const auto n = static_cast<std::int32_t>(around);
  Place at = grid.blocks[from].at;
  at = {at[0] + n % 3 - 1, at[1] + n / 3 % 3 - 1, at[2] + n / 9 - 1};
  corners &= grid.within.mask_of(at);
  if (corners == 0) return false;
  if (block == kNoBlock) {
    missing.emplace_back(key_of(at), corners);
    return false;
  }
  std::atomic_ref<std::uint64_t>(grid.blocks[static_cast<std::size_t>(block)].wanted)
      .fetch_or(corners, std::memory_order_relaxed);
  return true;
}

// want_corners() of the cells around a block's crossed edges, but for edges that an earlier call
// has gone through. Returns whether it is true for any of them.
bool want_cells_around(SpaceGrid& grid, std::size_t block, std::vector<BlockCorners>& missing) {
  std::array<std::uint64_t, 3> added;  // edges
  for (std::size_t axis = 0; axis < 3; ++axis) {
    std::uint64_t& done = grid.blocks[block].closed[axis];
    const std::uint64_t crossed = crossed_from(grid, block, static_cast<int>(axis));
    added[axis] = crossed & ~done;
    done |= crossed;
  }
  if ((added[0] | added[1] | added[2]) == 0) return false;
  CornersAround corners{};
  for (std::size_t axis = 0; axis < 3; ++axis)
    each_bit(added[axis], [&](int bit) {
      const CornersAround& more = kCornersAround[axis][static_cast<std::size_t>(bit)];
      for (std::size_t n = 0; n < corners.size(); ++n) corners[n] |= more[n];
    });
  bool any = false;
  for (std::size_t n = 0; n < corners.size(); ++n)
    any |= want_corners(grid, block, n, corners[n], missing);
  return any;
}

}  // namespace

void refuse_cells(double cell, const std::string& what) {
  throw InvalidArgument(setting("cell") + " is " + printed("%g", cell) +
                        " particle radii: " + what + " (use a larger " + setting("cell") + ")");
}

std::uint64_t crossed_from(const SpaceGrid& grid, std::size_t block, int axis) {
  const CornerBlock& own = grid.blocks[block];
  const std::int32_t next = next_block(grid, block, axis);
  const CornerBlock none{};
  const CornerBlock& other = next == kNoBlock ? none : grid.blocks[static_cast<std::size_t>(next)];
  return own.known & of_next(own.known, other.known, axis) &
         (own.inside ^ of_next(own.inside, other.inside, axis));
}

Points near_air(const Cells& cells, const float* gradients) {
  constexpr double kLowDensity = 0.9, kSlope = 0.1;
  const std::size_t n = cells.item.size();
  Points points;
  for (std::size_t p = 0; p < n; ++p) {
    const Vec3d slope{gradients[p], gradients[n + p], gradients[2 * n + p]};
    if (gradients[3 * n + p] < kLowDensity || dot(slope, slope) > kSlope * kSlope)
      points.add({cells.x[p], cells.y[p], cells.z[p]});
  }
  return points;
}

std::uint64_t key_of(const Place& at) {
  const auto part = [](std::int32_t v) { return static_cast<std::uint64_t>(v + (1 << 20)); };
  return part(at[2]) << 42 | part(at[1]) << 21 | part(at[0]);
}

std::uint64_t CornerBox::mask_of(const Place& at) const {
  constexpr std::array<std::uint64_t, 3> kFirst{0x1111111111111111u, 0x000f000f000f000fu, 0xffffu};
  std::uint64_t mask = ~std::uint64_t{0};
  for (std::size_t axis = 0; axis < 3; ++axis) {
    std::uint64_t here = 0;  // of the four planes along the axis
    for (int plane = 0; plane < kBlockSide; ++plane) {
      const std::int64_t corner = std::int64_t{kBlockSide} * at[axis] + plane;
      if (corner >= low[axis] && corner < high[axis])
        here |= kFirst[axis] << (plane << 2 * static_cast<int>(axis));
    }
    mask &= here;
  }
  return mask;
}

double farthest_point(double reach, double cell) {
  return static_cast<double>(kFarthestBlock) * kBlockSide * cell - reach;
}

SpaceGrid grid_around(const Points& points, double reach, double cell, const CornerBox& within) {
  SpaceGrid grid;
  grid.cell = cell;
  grid.within = within;
  want_blocks(grid, near_corners(points, reach, cell));
  for (CornerBlock& block : grid.blocks) block.wanted &= within.mask_of(block.at);
  return grid;
}

void fill_corners(SpaceGrid& grid, std::size_t together,
                  const std::function<std::vector<float>(const Points& points)>& value_at) {
  constexpr std::size_t kAtATime = std::size_t{1} << 20;  // points: bounds the memory for them
  Points points;
  points.reserve(kAtATime + 64);
  for (std::size_t first = 0, end = 0; first < grid.blocks.size(); first = end) {
    points.clear();
    for (; end < grid.blocks.size() && points.size() < kAtATime; ++end) {
      points.pad(together);
      each_bit(grid.blocks[end].wanted & ~grid.blocks[end].known,
               [&](int bit) { points.add(grid.position(end, bit)); });
    }
    if (points.size() == 0) continue;
    const std::vector<float> values = value_at(points);
    std::size_t next = 0;
    for (std::size_t b = first; b < end; ++b) {
      CornerBlock& block = grid.blocks[b];
      next = rounded_up(next, together);
      each_bit(block.wanted & ~block.known, [&](int bit) {
        const float value = values[next++];
        block.value[static_cast<std::size_t>(bit)] = value;
        block.inside |= std::uint64_t{value < 0} << bit;
      });
      block.known |= block.wanted;
    }
  }
}

bool want_closed(SpaceGrid& grid) {
  std::mutex joining;
  std::vector<BlockCorners> missing;
  std::atomic<bool> any{false};
  parallel_for(grid.blocks.size(), kGrain, [&](std::size_t begin, std::size_t end) {
    std::vector<BlockCorners> own;
    bool wants = false;
    for (std::size_t b = begin; b < end; ++b) wants |= want_cells_around(grid, b, own);
    if (wants) any = true;
    if (own.empty()) return;
    const std::scoped_lock lock(joining);
    missing.insert(missing.end(), own.begin(), own.end());
  });
  if (missing.empty()) return any;
  want_blocks(grid, missing);
  return true;
}

void forget_outside(SpaceGrid& grid, const CornerBox& box) {
  for (CornerBlock& block : grid.blocks) block.known &= box.mask_of(block.at);
}

}  // namespace meniscus
