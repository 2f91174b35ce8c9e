// Pinholes and specks in double precision, sample by sample, as specks.cl says (docs/method.md,
// "density": holes of a few samples take their neighbours' mean, and samples that hang together
// with fewer than three neighbours go).
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
};

inline Closing closing_of(const SurfaceMap& map) {
  Closing all{map.grid.nx, map.grid.ny, {map.depth.begin(), map.depth.end()}, {},
              map.group,   map.kind,    std::vector<bool>(map.depth.size())};
  for (const Vec3& n : map.normal) all.normal.emplace_back(n);
  return all;
}

/// One round. `jump`: depths that differ by more do not hang together; depths are below `farthest`.
/// Up to depth `large_until` particles are large: a sample farther than `link` from all four beside
/// it is a speck. Farther away samples without surface alone change.
inline Closing close_once(const Closing& before, double jump, double link, double large_until,
                          double farthest) {
  Closing after = before;
  const int nx = before.nx;
  const auto there = [&](int s) { return before.depth[s] < INFINITY; };
  // Means of up to eight depths round as often, in this round and those before.
  const double close_call = 64 * kEpsilon * farthest;
  for (int j = 1; j + 1 < before.ny; ++j)
    for (int i = 1; i + 1 < nx; ++i) {
      const int s = j * nx + i;
      const bool empty = !there(s);
      std::vector<int> around;  // row by row
      for (int y = -1; y <= 1; ++y)
        for (int x = -1; x <= 1; ++x)
          if ((x != 0 || y != 0) && there(s + y * nx + x)) around.push_back(s + y * nx + x);
      bool doubt = before.in_doubt[s];
      const auto is_large = [&](double depth) {
        doubt = doubt || std::abs(depth - large_until) < close_call;
        return depth <= large_until;
      };
      if (!empty && !is_large(before.depth[s])) {
        after.in_doubt[s] = doubt;
        continue;
      }
      int within_two = 0;
      for (int y = -2; y <= 2; ++y)
        for (int x = -2; x <= 2; ++x) {
          if (i + x < 0 || i + x >= nx || j + y < 0 || j + y >= before.ny) continue;
          const int k = s + y * nx + x;
          doubt = doubt || before.in_doubt[k];
          within_two += there(k);
        }
      const auto covered = static_cast<int>(around.size());
      double farthest_around = 0, farthest_apart = 0;  // the latter of those it does not hang on
      int joined = 0;
      bool linked = false;
      for (const int k : around) {
        farthest_around = std::max(farthest_around, before.depth[k]);
        if (empty) continue;
        const double apart = std::abs(before.depth[k] - before.depth[s]);
        joined += apart <= jump;
        if (apart > jump) farthest_apart = std::max(farthest_apart, before.depth[k]);
        doubt = doubt || std::abs(apart - jump) < close_call;
        if (std::abs(k - s) != 1 && std::abs(k - s) != nx) continue;
        linked = linked || apart <= link;
        doubt = doubt || std::abs(apart - link) < close_call;
      }
      const bool speck = !empty && (joined < 3 || !linked);
      // In a pit: behind both of two samples that it lies between.
      const auto in_front = [&](int k) { return before.depth[s] - before.depth[k] > jump; };
      bool between = false;
      for (const int k : {1, nx - 1, nx, nx + 1})
        between = between || (!empty && in_front(s - k) && in_front(s + k));
      const double layer = speck && between ? farthest_apart : farthest_around;
      std::vector<int> deep;  // the farthest layer, in a pit of what it does not hang on
      double depth = 0;
      Vec3d sum;
      for (const int k : around) {
        const double before_layer = layer - before.depth[k];
        doubt = doubt || std::abs(before_layer - jump) < close_call;
        if (before_layer > jump || before_layer < 0) continue;
        deep.push_back(k);
        depth += before.depth[k];
        sum += before.normal[k];
      }
      const auto count = static_cast<int>(deep.size());
      // The normals of all neighbours agree to 0.93, and the sample's own lies farther off than
      // their mean's length allows.
      bool alone = false;
      if (!empty && count >= 6 && count == covered) {
        const double agree = length(sum) / count, along = dot(before.normal[s], normalized(sum));
        alone = agree > 0.93 && along < agree - 0.03;
        doubt = doubt || std::abs(agree - 0.93) < 64 * kEpsilon ||
                (agree > 0.93 && std::abs(along - agree + 0.03) < 64 * kEpsilon);
      }
      // 17 of the 24 around, where all of these are samples.
      const bool corner =
          empty && i > 1 && j > 1 && i + 2 < nx && j + 2 < before.ny && within_two >= 17;
      const bool goes = speck && covered < 5;
      const bool hole = covered >= 7 || (is_large(farthest_around) && (covered >= 6 || corner));
      const bool wants = empty ? hole : speck || alone;
      const bool takes = !goes && wants && count >= (empty ? 1 : 3) && length(sum) > 0;
      after.in_doubt[s] = doubt;
      if (!goes && !takes) continue;
      after.depth[s] = takes ? depth / count : INFINITY;
      after.normal[s] = takes ? normalized(sum) : Vec3d{};
      after.group[s] = takes ? before.group[deep.front()] : -1;
      after.kind[s] = takes ? before.kind[deep.front()] : Kind::none;
    }
  return after;
}

}  // namespace meniscus::reference
