#include "stages/closed/crossings.hpp"

#include <algorithm>
#include <bit>
#include <cmath>
#include <numeric>

#include "base/parallel.hpp"

namespace meniscus {
namespace {

constexpr std::size_t kGrain = 64, kEdgeGrain = 1024;  // blocks, edges that are worth a thread

// A way of one cell along each axis.
constexpr std::array<std::array<int, 3>, 3> kAlong{{{1, 0, 0}, {0, 1, 0}, {0, 0, 1}}};

// The corners at both ends of an edge.
std::array<Corner, 2> ends_of(const SpaceGrid& grid, const CrossedEdges& edges, std::size_t e) {
  const auto [i, j, k] = place_in_block(edges.bit[e]);
  const auto [x, y, z] = kAlong[edges.axis[e]];
  return {Corner{edges.block[e], edges.bit[e]},
          corner_at(grid, static_cast<std::size_t>(edges.block[e]), i + x, j + y, k + z)};
}

// Says that an edge crosses the surface at this share of its length.
void put_crossing(const SpaceGrid& grid, std::size_t e, double at, CrossedEdges& edges) {
  const auto [x, y, z] = kAlong[edges.axis[e]];
  edges.at[e] = static_cast<float>(at);
  edges.position[e] = grid.position(static_cast<std::size_t>(edges.block[e]), edges.bit[e]) +
                      Vec3d(x, y, z) * (at * grid.cell);
}

// Where the corners of the cells around an edge lie that are beside it: of each end those one cell
// before and behind along the axes across the edge. Of each axis and each bit at the lower end.
constexpr std::array<std::array<int, 2>, 4> kBeside{{{-1, 0}, {0, -1}, {0, 1}, {1, 0}}};
constexpr auto kBesideEdges = [] {
  std::array<std::array<std::array<std::array<CornerPlace, 4>, 2>, 64>, 3> all{};
  for (std::size_t along = 0; along < 3; ++along)
    for (int bit = 0; bit < 64; ++bit)
      for (int end = 0; end <= 1; ++end)
        for (std::size_t q = 0; q < kBeside.size(); ++q) {
          std::array<int, 3> at = place_in_block(bit);
          at[along] += end;
          at[(along + 1) % 3] += kBeside[q][0];
          at[(along + 2) % 3] += kBeside[q][1];
          all[along][bit][end][q] = corner_place(at[0], at[1], at[2]);
        }
  return all;
}();

// The slope of F at an edge, per cell: along it between its ends, across it the mean of the slopes
// at both ends. All corners around a crossed edge are known.
Vec3d slope_at(const SpaceGrid& grid, const CrossedEdges& edges, std::size_t e) {
  const std::size_t along = edges.axis[e], across = (along + 1) % 3, beyond = (along + 2) % 3;
  const auto& blocks = grid.around[static_cast<std::size_t>(edges.block[e])];
  std::array<double, 3> slope{};
  for (const auto& beside : kBesideEdges[along][edges.bit[e]])
    for (std::size_t q = 0; q < kBeside.size(); ++q) {
      const double value = value_at(grid, {blocks[beside[q].around], beside[q].bit});
      slope[across] += 0.25 * kBeside[q][0] * value;
      slope[beyond] += 0.25 * kBeside[q][1] * value;
    }
  const auto [low, high] = ends_of(grid, edges, e);
  slope[along] = double{value_at(grid, high)} - value_at(grid, low);
  return {slope[0], slope[1], slope[2]};
}

// Masks of corners, by block.
using CornerMasks = std::vector<std::uint64_t>;

// Adds to each corner what the one beside it along an axis has: the next one by next_block() and
// of_next(), or the one before it by block_before() and of_before().
void add_beside(const SpaceGrid& grid, int axis, decltype(next_block)& beside,
                decltype(of_next)& moved, CornerMasks& masks) {
  const CornerMasks own = masks;
  for (std::size_t b = 0; b < masks.size(); ++b) {
    const std::int32_t block = beside(grid, b, axis);
    masks[b] |= moved(own[b], block == kNoBlock ? 0 : own[static_cast<std::size_t>(block)], axis);
  }
}

// The part of an edge in which F changes its sign, narrowed from both ends by false position
// (Illinois).
struct Bracket {
  double low = 0, high = 1, at_low, at_high;  // shares of the edge, and F there
  int side = 0;                               // that moved last: -1 low, 1 high

  double guess() const {
    return low + (high - low) * std::clamp(at_low / (at_low - at_high), 0.02, 0.98);
  }
  // An end that stays where it is while the other one moves twice counts half.
  void narrow(double at, double value) {
    if ((value < 0) == (at_low < 0)) {
      low = at;
      at_low = value;
      if (side == -1) at_high *= 0.5;
      side = -1;
    } else {
      high = at;
      at_high = value;
      if (side == 1) at_low *= 0.5;
      side = 1;
    }
  }
};

}  // namespace

CrossedEdges list_crossings(const SpaceGrid& grid) {
  CrossedEdges edges;
  const std::size_t blocks = grid.blocks.size();
  edges.mask.resize(blocks);
  edges.first.resize(blocks);
  parallel_for(blocks, kGrain, [&](std::size_t begin, std::size_t end) {
    for (std::size_t b = begin; b < end; ++b)
      for (int axis = 0; axis < 3; ++axis)
        edges.mask[b][static_cast<std::size_t>(axis)] = crossed_from(grid, b, axis);
  });
  std::uint64_t count = 0;
  for (std::size_t b = 0; b < blocks; ++b)
    for (std::size_t axis = 0; axis < 3; ++axis) {
      edges.first[b][axis] = static_cast<std::uint32_t>(count);
      count += static_cast<std::uint64_t>(std::popcount(edges.mask[b][axis]));
    }
  if (count > 0x7fffffffu) refuse_cells(grid.cell, "the mesh has more than 2^31 - 1 quadrangles");
  edges.block.reserve(count);
  edges.bit.reserve(count);
  edges.axis.reserve(count);
  for (std::size_t b = 0; b < blocks; ++b)
    for (std::size_t axis = 0; axis < 3; ++axis)
      each_bit(edges.mask[b][axis], [&](int bit) {
        edges.block.push_back(static_cast<std::int32_t>(b));
        edges.bit.push_back(static_cast<std::uint8_t>(bit));
        edges.axis.push_back(static_cast<std::uint8_t>(axis));
      });
  const std::size_t n = edges.size();
  edges.at.resize(n);
  edges.position.resize(n);
  edges.normal.resize(n);
  edges.value.resize(n);
  return edges;
}

void guess_crossings(const SpaceGrid& grid, CrossedEdges& edges) {
  parallel_for(edges.size(), kEdgeGrain, [&](std::size_t begin, std::size_t end) {
    for (std::size_t e = begin; e < end; ++e) {
      const auto [lower, upper] = ends_of(grid, edges, e);
      const double low = value_at(grid, lower), high = value_at(grid, upper);
      put_crossing(grid, e, low / (low - high), edges);
      edges.value[e] = 0;
    }
  });
}

Vec3d guess_normal(const SpaceGrid& grid, const CrossedEdges& edges, std::size_t e) {
  return normalized(slope_at(grid, edges, e));
}

// The cells around an edge begin at its lower end and up to one back along the other axes.
std::vector<std::uint64_t> cells_of(const SpaceGrid& grid, const CrossedEdges& edges,
                                    const std::vector<std::uint32_t>& some) {
  std::array<CornerMasks, 3> along;
  along.fill(CornerMasks(grid.blocks.size(), 0));
  for (const std::uint32_t e : some)
    along[edges.axis[e]][static_cast<std::size_t>(edges.block[e])] |= std::uint64_t{1}
                                                                      << edges.bit[e];
  CornerMasks cells(grid.blocks.size(), 0);
  for (int axis = 0; axis < 3; ++axis) {
    CornerMasks& masks = along[static_cast<std::size_t>(axis)];
    add_beside(grid, (axis + 1) % 3, next_block, of_next, masks);
    add_beside(grid, (axis + 2) % 3, next_block, of_next, masks);
    for (std::size_t b = 0; b < cells.size(); ++b) cells[b] |= masks[b];
  }
  return cells;
}

std::vector<std::uint32_t> of_same_cells(const SpaceGrid& grid, const CrossedEdges& edges,
                                         const std::vector<std::uint32_t>& some) {
  std::array<CornerMasks, 3> along;
  along.fill(cells_of(grid, edges, some));
  for (int axis = 0; axis < 3; ++axis) {
    add_beside(grid, (axis + 1) % 3, block_before, of_before,
               along[static_cast<std::size_t>(axis)]);
    add_beside(grid, (axis + 2) % 3, block_before, of_before,
               along[static_cast<std::size_t>(axis)]);
  }
  std::vector<std::uint32_t> all;
  all.reserve(edges.size());
  for (std::size_t e = 0; e < edges.size(); ++e)
    if ((along[edges.axis[e]][static_cast<std::size_t>(edges.block[e])] >> edges.bit[e] & 1) != 0)
      all.push_back(static_cast<std::uint32_t>(e));
  return all;
}

void measure_crossings(Device& device, const ImplicitFunction& function,
                       const std::vector<std::uint32_t>& some, CrossedEdges& edges) {
  // Those of one block corner by corner: points that lie near each other are evaluated together.
  const std::size_t together = points_together(device);
  Points points;
  points.reserve(2 * some.size());
  std::vector<std::size_t> place;  // [some, in this order] among the points
  place.reserve(some.size());
  std::vector<std::uint32_t> order = some;
  for (auto begin = order.begin(); begin != order.end();) {
    const std::int32_t block = edges.block[*begin];
    const auto end =
        std::find_if(begin, order.end(), [&](std::uint32_t e) { return edges.block[e] != block; });
    std::sort(begin, end, [&](std::uint32_t a, std::uint32_t b) {
      return edges.bit[a] != edges.bit[b] ? edges.bit[a] < edges.bit[b] : a < b;
    });
    points.pad(together);
    for (; begin != end; ++begin) {
      place.push_back(points.size());
      points.add(edges.position[*begin]);
    }
  }
  const Levels levels = measure_implicit(device, function, points);
  for (std::size_t k = 0; k < order.size(); ++k) {
    edges.value[order[k]] = levels.value[place[k]];
    edges.normal[order[k]] = Vec3d(levels.gradient[place[k]]);
  }
}

void find_crossings(Device& device, const ImplicitFunction& function, const SpaceGrid& grid,
                    CrossedEdges& edges) {
  constexpr int kRounds = 6;
  constexpr double kEnough = 0.004;
  const std::size_t n = edges.size();
  std::vector<Bracket> bracket(n);
  parallel_for(n, kEdgeGrain, [&](std::size_t begin, std::size_t end) {
    for (std::size_t e = begin; e < end; ++e) {
      const auto [low, high] = ends_of(grid, edges, e);
      bracket[e].at_low = value_at(grid, low);
      bracket[e].at_high = value_at(grid, high);
    }
  });
  std::vector<std::uint32_t> left(n);
  std::iota(left.begin(), left.end(), 0u);
  for (int round = 0; round < kRounds && !left.empty(); ++round) {
    for (const std::uint32_t e : left) put_crossing(grid, e, bracket[e].guess(), edges);
    measure_crossings(device, function, left, edges);
    std::erase_if(left, [&](std::uint32_t e) { return std::abs(edges.value[e]) < kEnough; });
    for (const std::uint32_t e : left) bracket[e].narrow(edges.at[e], edges.value[e]);
  }
}

}  // namespace meniscus
