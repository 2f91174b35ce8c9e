// Pinholes and specks in double precision, sample by sample: docs/method.md, "Specks".
#pragma once

#include <algorithm>
#include <cmath>
#include <vector>

#include "stages/stage_data.hpp"
#include "verify/reference/epsilon.hpp"

namespace meniscus::reference {

/// A surface in double precision, and where rounding may have decided something.
struct Closing {
  int nx = 0, ny = 0;
  std::vector<double> depth;
  std::vector<Vec3d> normal;
  std::vector<int> group;
  std::vector<Kind> kind;
  std::vector<bool> in_doubt;
  bool has_surface(int s) const { return depth[s] < INFINITY; }
};

inline Closing closing_of(const SurfaceMap& map) {
  Closing all{map.grid.nx, map.grid.ny, {map.depth.begin(), map.depth.end()}, {},
              map.group,   map.kind,    std::vector<bool>(map.depth.size())};
  for (const Vec3& n : map.normal) all.normal.emplace_back(n);
  return all;
}

/// What decides in a round, particle radii.
struct ClosingLimits {
  double jump;         // depths that differ by more do not hang together
  double link;         // a sample farther than this from all four beside it is a speck
  double large_until;  // up to this depth particles are large
  double close_call;   // by how much rounding may move depths
};

/// Compares, and notes where rounding may have decided.
struct Doubts {
  bool any = false;
  bool at_most(double x, double limit, double close_call) {
    any = any || std::abs(x - limit) < close_call;
    return x <= limit;
  }
};

/// How many samples within two of (i, j), itself too, have surface.
inline int covered_within_two(const Closing& before, int i, int j, Doubts* doubts) {
  int count = 0;
  for (int y = std::max(j - 2, 0); y <= std::min(j + 2, before.ny - 1); ++y)
    for (int x = std::max(i - 2, 0); x <= std::min(i + 2, before.nx - 1); ++x) {
      doubts->any = doubts->any || before.in_doubt[y * before.nx + x];
      count += before.has_surface(y * before.nx + x);
    }
  return count;
}

/// The neighbours of sample s with surface, row by row, and how far the farthest is.
struct Neighbours {
  std::vector<int> sample;
  double farthest = 0;
  int count() const { return static_cast<int>(sample.size()); }
};

inline Neighbours neighbours_of(const Closing& before, int s) {
  Neighbours around;
  for (int y = -1; y <= 1; ++y)
    for (int x = -1; x <= 1; ++x) {
      const int k = s + y * before.nx + x;
      if (k == s || !before.has_surface(k)) continue;
      around.sample.push_back(k);
      around.farthest = std::max(around.farthest, before.depth[k]);
    }
  return around;
}

/// How a sample with surface hangs together with its neighbours.
struct Hold {
  int joined = 0;             // so many neighbours hang together with it
  bool linked = false;        // one of the four beside it is near
  double farthest_apart = 0;  // the farthest neighbour that does not hang together with it
  bool is_speck() const { return joined < 3 || !linked; }
};

inline Hold hold_of(const Closing& before, int s, const Neighbours& around,
                    const ClosingLimits& limits, Doubts* doubts) {
  Hold hold;
  for (const int k : around.sample) {
    const double apart = std::abs(before.depth[k] - before.depth[s]);
    if (doubts->at_most(apart, limits.jump, limits.close_call))
      ++hold.joined;
    else
      hold.farthest_apart = std::max(hold.farthest_apart, before.depth[k]);
    const bool beside = std::abs(k - s) == 1 || std::abs(k - s) == before.nx;
    if (beside && doubts->at_most(apart, limits.link, limits.close_call)) hold.linked = true;
  }
  return hold;
}

/// Whether a sample lies in a pit: behind both of two opposite neighbours.
inline bool is_in_pit(const Closing& before, int s, double jump) {
  const auto in_front = [&](int k) { return before.depth[s] - before.depth[k] > jump; };
  for (const int k : {1, before.nx - 1, before.nx, before.nx + 1})
    if (in_front(s - k) && in_front(s + k)) return true;
  return false;
}

/// The neighbours that hang together with one at depth `farthest` and are no farther.
struct FarLayer {
  std::vector<int> sample;
  double depths = 0;  // their sum
  Vec3d normals;      // their sum
  int count() const { return static_cast<int>(sample.size()); }
};

inline FarLayer far_layer(const Closing& before, const Neighbours& around, double farthest,
                          const ClosingLimits& limits, Doubts* doubts) {
  FarLayer layer;
  for (const int k : around.sample) {
    const double in_front = farthest - before.depth[k];
    if (!doubts->at_most(in_front, limits.jump, limits.close_call) || in_front < 0) continue;
    layer.sample.push_back(k);
    layer.depths += before.depth[k];
    layer.normals += before.normal[k];
  }
  return layer;
}

/// Whether the normals of all neighbours agree to 0.93, and the sample's own lies farther off than
/// their mean's length allows.
inline bool stands_alone(const Vec3d& normal, const Neighbours& around, const FarLayer& layer,
                         Doubts* doubts) {
  if (layer.count() < 6 || layer.count() != around.count()) return false;
  constexpr double kCloseCall = 64 * kEpsilon;
  const double agree = length(layer.normals) / layer.count();
  if (doubts->at_most(agree, 0.93, kCloseCall)) return false;
  return !doubts->at_most(agree - 0.03, dot(normal, normalized(layer.normals)), kCloseCall);
}

/// Sample (i, j), which is not at the border, in one round.
inline void close_sample(const Closing& before, int i, int j, const ClosingLimits& limits,
                         Closing* after) {
  const int s = j * before.nx + i;
  Doubts doubts{before.in_doubt[s]};
  const auto is_large = [&](double depth) {
    return doubts.at_most(depth, limits.large_until, limits.close_call);
  };
  const bool empty = !before.has_surface(s);
  if (!empty && !is_large(before.depth[s])) {
    after->in_doubt[s] = doubts.any;
    return;
  }
  const int within_two = covered_within_two(before, i, j, &doubts);
  const Neighbours around = neighbours_of(before, s);
  const Hold hold = empty ? Hold{} : hold_of(before, s, around, limits, &doubts);
  const bool speck = !empty && hold.is_speck();
  const double farthest =
      speck && is_in_pit(before, s, limits.jump) ? hold.farthest_apart : around.farthest;
  const FarLayer layer = far_layer(before, around, farthest, limits, &doubts);

  const auto is_hole = [&] {
    if (around.count() >= 7) return true;
    const bool inner = i > 1 && j > 1 && i + 2 < before.nx && j + 2 < before.ny;
    return is_large(around.farthest) && (around.count() >= 6 || (inner && within_two >= 17));
  };
  const bool goes = speck && around.count() < 5;
  const bool wants =
      empty ? is_hole() : speck || stands_alone(before.normal[s], around, layer, &doubts);
  const bool takes =
      !goes && wants && layer.count() >= (empty ? 1 : 3) && length(layer.normals) > 0;
  after->in_doubt[s] = doubts.any;
  if (!goes && !takes) return;
  after->depth[s] = takes ? layer.depths / layer.count() : INFINITY;
  after->normal[s] = takes ? normalized(layer.normals) : Vec3d{};
  after->group[s] = takes ? before.group[layer.sample.front()] : -1;
  after->kind[s] = takes ? before.kind[layer.sample.front()] : Kind::none;
}

/// One round; depths are below `farthest`. The other numbers are those of ClosingLimits.
inline Closing close_once(const Closing& before, double jump, double link, double large_until,
                          double farthest) {
  // Means of up to eight depths round as often, in this round and those before.
  const ClosingLimits limits{jump, link, large_until, 64 * kEpsilon * farthest};
  Closing after = before;
  for (int j = 1; j + 1 < before.ny; ++j)
    for (int i = 1; i + 1 < before.nx; ++i) close_sample(before, i, j, limits, &after);
  return after;
}

}  // namespace meniscus::reference
