#include "stages/closed/share_space.hpp"

#include <algorithm>
#include <cmath>

namespace meniscus {
namespace {

constexpr double kCube = 32;             // side of a cube, about; particle radii
constexpr double kSaved = 0.85;          // a cut leaves at most so much of a box's memory
constexpr std::int32_t kLast = 1 << 19;  // cubes farther away count as this one

using Cubes = std::vector<CubeCounts::Cube>;

// A box, and what it takes.
struct Box {
  BlockBox blocks;
  double bytes = 0;
};

// How many points lie in a box, and up to `halo` cubes around it.
double points_around(const BlockBox& box, const CubeCounts& counts, double halo) {
  double points = 0;
  for (const CubeCounts::Cube& cube : counts.cubes) {
    double share = static_cast<double>(cube.count);
    for (std::size_t axis = 0; axis < 3; ++axis) {
      const double at = cube.at[axis], side = counts.blocks;
      const double low = box.low[axis] / side - halo, high = box.high[axis] / side + halo;
      share *= std::clamp(std::min(at + 1, high) - std::max(at, low), 0.0, 1.0);
    }
    points += share;
  }
  return points;
}

// The cubes that begin in a box.
Cubes cubes_in(const BlockBox& box, const CubeCounts& counts) {
  Cubes own;
  for (const CubeCounts::Cube& cube : counts.cubes) {
    std::array<std::int32_t, 3> at = cube.at;
    for (std::int32_t& along : at) along *= counts.blocks;
    if (box.holds(at)) own.push_back(cube);
  }
  return own;
}

// Cuts a box between cubes, across its longest side, so that both parts hold about as many points
// and are at least `thinnest` cubes thick. False: it cannot be.
bool cut(const BlockBox& box, const CubeCounts& counts, std::int32_t thinnest, BlockBox& low,
         BlockBox& high) {
  const Cubes own = cubes_in(box, counts);
  if (own.empty()) return false;
  std::size_t axis = 3;
  std::int32_t longest = 2 * thinnest - 1, first = 0;
  for (std::size_t k = 0; k < 3; ++k) {
    const auto [least, most] =
        std::ranges::minmax(own, {}, [k](const CubeCounts::Cube& cube) { return cube.at[k]; });
    if (most.at[k] + 1 - least.at[k] <= longest) continue;
    axis = k;
    first = least.at[k];
    longest = most.at[k] + 1 - first;
  }
  if (axis == 3) return false;
  std::vector<std::int64_t> before(static_cast<std::size_t>(longest) + 1, 0);
  for (const CubeCounts::Cube& cube : own)
    before[static_cast<std::size_t>(cube.at[axis] - first) + 1] += cube.count;
  for (std::size_t k = 1; k < before.size(); ++k) before[k] += before[k - 1];
  const auto half = std::lower_bound(before.begin(), before.end(), before.back() / 2);
  const std::int32_t at = first + std::clamp(static_cast<std::int32_t>(half - before.begin()),
                                             thinnest, longest - thinnest);
  low = high = box;
  low.high[axis] = high.low[axis] = at * counts.blocks;
  return true;
}

}  // namespace

std::int32_t blocks_of_cubes(double block) {
  return std::max(1, static_cast<std::int32_t>(std::lround(kCube / block)));
}

void CubeCounter::add(const Vec3d& at) {
  const auto part = [&](double x) {
    return static_cast<std::uint64_t>(
        static_cast<std::int64_t>(std::clamp<double>(std::floor(x / side_), -kLast, kLast)) +
        kLast);
  };
  const std::uint64_t key = part(at.z) << 42 | part(at.y) << 21 | part(at.x);
  if (key != last_) here_ = &counts_[last_ = key];  // elements of such a map stay in place
  ++*here_;
}

std::vector<CubeCounts::Cube> CubeCounter::cubes() const {
  Cubes all;
  for (const auto& [key, count] : counts_) {
    const auto part = [key = key](int shift) {
      return static_cast<std::int32_t>(key >> shift & 0x1fffff) - kLast;
    };
    all.push_back({{part(0), part(21), part(42)}, count});
  }
  return all;
}

std::vector<BlockBox> share_space(const CubeCounts& counts, const Sharing& sharing,
                                  const BlockBox& all) {
  const double side = counts.blocks * sharing.block, halo = sharing.halo / side;
  const auto thinnest = std::max(1, static_cast<std::int32_t>(std::ceil(sharing.thinnest / side)));
  const auto measured = [&](const BlockBox& blocks) {
    return Box{blocks, sharing.bytes * points_around(blocks, counts, halo)};
  };
  std::vector<Box> left{measured(all)};
  std::vector<BlockBox> whole;
  const auto takes_less = [](const Box& a, const Box& b) { return a.bytes < b.bytes; };
  while (!left.empty()) {
    const auto most = std::max_element(left.begin(), left.end(), takes_less);
    const Box box = *most;
    left.erase(most);
    std::array<BlockBox, 2> halves;
    const bool few = left.size() + whole.size() + 1 < static_cast<std::size_t>(sharing.least);
    if ((few || box.bytes > static_cast<double>(sharing.memory)) &&
        cut(box.blocks, counts, thinnest, halves[0], halves[1])) {
      const Box low = measured(halves[0]), high = measured(halves[1]);
      // What lies around thin boxes is more than what is in them.
      if (few || std::max(low.bytes, high.bytes) <= kSaved * box.bytes) {
        left.insert(left.end(), {low, high});
        continue;
      }
    }
    whole.push_back(box.blocks);
  }
  return whole;
}

}  // namespace meniscus
