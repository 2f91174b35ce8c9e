// Normals evened out along a sheet, in double precision, sample by sample, as docs/method.md says
// ("Fairing"): a parabola through weighted normals along a row or a column, by least squares.
#pragma once

#include <algorithm>
#include <cmath>
#include <vector>

#include "stages/stage_data.hpp"
#include "stages/view.hpp"

namespace meniscus::reference {

/// A surface's normals in double precision, and where rounding decides which neighbours are asked.
struct Normals {
  int nx = 0, ny = 0;
  std::vector<Vec3d> at;      // eye space
  std::vector<Vec3d> normal;  // zero: no surface
  std::vector<bool> in_doubt;
};

inline Normals normals_of(const View& view, const SurfaceMap& map) {
  Normals all{map.grid.nx, map.grid.ny, {}, {}, std::vector<bool>(map.depth.size())};
  for (int j = 0; j < all.ny; ++j)
    for (int i = 0; i < all.nx; ++i) {
      const std::size_t s = map.depth.size() / static_cast<std::size_t>(all.ny) * j + i;
      const bool there = map.depth[s] < kNoSurface;
      all.at.push_back(there ? point_at(view, map.grid.first + map.grid.step * i,
                                        map.grid.first + map.grid.step * j, map.depth[s])
                             : Vec3d{});
      all.normal.push_back(there ? Vec3d(map.normal[s]) : Vec3d{});
    }
  return all;
}

/// One direction: along rows (di = 1, dj = 0) or columns. `sigma` in particle radii.
inline Normals fair(const View& view, const SampleGrid& grid, const Normals& before, int di, int dj,
                    double sigma) {
  Normals after = before;
  const auto index = [&](int i, int j) { return static_cast<std::size_t>(j) * before.nx + i; };
  for (int j = 0; j < before.ny; ++j)
    for (int i = 0; i < before.nx; ++i) {
      const std::size_t s = index(i, j);
      const Vec3d own = before.normal[s];
      if (own == Vec3d{}) continue;
      const double u = grid.first + grid.step * i, v = grid.first + grid.step * j;
      const Vec3d beside = point_at(view, u + grid.step * di, v + grid.step * dj, -before.at[s].z);
      const double apart = length(beside - before.at[s]) / sigma;
      const double exact = std::clamp(std::log2(1.4 / apart), 0.0, 10.0);
      const int step = 1 << static_cast<int>(exact);
      bool doubt = before.in_doubt[s] ||
                   (std::abs(exact - std::round(exact)) < 1e-5 && exact > 1e-5 && exact < 10);
      // Weighted sums of 1, k .. k^4, and of the normals' differences times 1, k, k^2.
      double m[5] = {1, 0, 0, 0, 0};
      Vec3d d[3];
      for (int k = -3; k <= 3; ++k) {
        const double off = std::abs(k) * step * apart;
        if (k == 0 || !(off < 2.65)) continue;
        const int x = i + k * step * di, y = j + k * step * dj;
        if (x < 0 || y < 0 || x >= before.nx || y >= before.ny) continue;
        const std::size_t other = index(x, y);
        if (before.normal[other] == Vec3d{}) continue;
        doubt = doubt || before.in_doubt[other];
        const Vec3d to = before.at[other] - before.at[s], n = before.normal[other];
        const double h = dot(to, own + n) / 2;
        const double near = std::max(1 - dot(to, to) / (2.65 * sigma * 2.65 * sigma), 0.0);
        const double beside_it = std::max(1 - h * h / 1.44, 0.0);
        const Vec3d turn = n - own;
        const double same = smooth_step(0.7, 0.9, 1 - dot(turn, turn) / 2);
        const double w = near * near * beside_it * beside_it * same;
        for (int e = 0; e < 5; ++e) m[e] += w * std::pow(k, e);
        for (int e = 0; e < 3; ++e) d[e] += turn * (w * std::pow(k, e));
      }
      // The first row of the inverse of the normal matrix.
      const double scale = step * apart;
      const double m2 = m[2] + 0.2 / (scale * scale) * m[0];
      const double m4 = m[4] + 0.6 / std::pow(scale, 4) * m[0];
      const double a = m2 * m4 - m[3] * m[3], b = m[2] * m[3] - m[1] * m4,
                   c = m[1] * m[3] - m[2] * m2;
      const Vec3d fitted =
          own + (d[0] * a + d[1] * b + d[2] * c) * (1 / (m[0] * a + m[1] * b + m[2] * c));
      after.normal[s] = length(fitted) > 0.5 ? normalized(fitted) : own;
      after.in_doubt[s] = doubt;
    }
  return after;
}

}  // namespace meniscus::reference
