// The spheres' depth map in double precision (paper 2.1).
#pragma once

#include <algorithm>
#include <cmath>
#include <vector>

#include "stages/frame/project.hpp"
#include "stages/stage_data.hpp"

namespace meniscus::reference {

/// Bounds of one sphere's front at one node: t - bulge sqrt(1 - d^2), d the distance from the
/// centre in units of the half axes footprint * ku and footprint * kv.
struct Front {
  bool possible = false, sure = false;  // the node may lie, surely lies in the ellipse
  double low = 0, high = 0;             // bounds of the front where it is possible
};

/// In single precision d^2 is off by some 12 epsilon (differences, reciprocals, products, a sum),
/// and a node at the very edge may be missed, because the ellipse's box is rounded: its corner is
/// off by 3 epsilon of the coordinates, in units of the half axis.
inline Front front(const Projected& p, std::size_t i, double x, double y, double footprint,
                   double bulge, double epsilon) {
  const double ru = footprint * p.ku[i], rv = footprint * p.kv[i];
  const double du = (x - p.u[i]) / ru, dv = (y - p.v[i]) / rv;
  const double q = 1 - du * du - dv * dv;
  const double delta = 12 * epsilon;
  const double box = 6 * epsilon *
                     std::max((std::abs(p.u[i]) + std::abs(x) + ru) / ru,
                              (std::abs(p.v[i]) + std::abs(y) + rv) / rv);
  const double t = -p.z[i], depth = footprint * bulge * p.scale[i];
  Front result;
  result.possible = q > -delta;
  result.sure = q > delta + box;
  // Three products, a root and a difference round.
  const double rounding = 6 * epsilon * (std::abs(t) + depth);
  result.low = t - depth * std::sqrt(std::max(0.0, q + delta)) - rounding;
  result.high = t - depth * std::sqrt(std::max(0.0, q - delta)) + rounding;
  return result;
}

/// Bounds of the nearest front at every node, +infinity where there is none.
struct DepthBounds {
  std::vector<double> low, high;
};

inline DepthBounds splat_depth(const Projected& p, const std::vector<std::int32_t>& indices,
                               const SampleGrid& grid, double footprint, double bulge,
                               double epsilon) {
  DepthBounds bounds{std::vector<double>(grid.size(), INFINITY),
                     std::vector<double>(grid.size(), INFINITY)};
  for (int j = 0; j < grid.ny; ++j)
    for (int i = 0; i < grid.nx; ++i)
      for (const std::int32_t k : indices) {
        const Front f = front(p, static_cast<std::size_t>(k), grid.first + grid.step * i,
                              grid.first + grid.step * j, footprint, bulge, epsilon);
        const std::size_t node = static_cast<std::size_t>(j) * grid.nx + i;
        if (f.possible) bounds.low[node] = std::min(bounds.low[node], f.low);
        if (f.sure) bounds.high[node] = std::min(bounds.high[node], f.high);
      }
  return bounds;
}

/// Bounds of the nearest front at every node that is deeper than `behind` + gap there; behind
/// [nodes] is not asked where it is infinite. The sum rounds once.
inline DepthBounds splat_behind(const Projected& p, const SampleGrid& grid, double footprint,
                                const std::vector<float>& behind, double gap, double epsilon) {
  DepthBounds bounds{std::vector<double>(grid.size(), INFINITY),
                     std::vector<double>(grid.size(), INFINITY)};
  for (int j = 0; j < grid.ny; ++j)
    for (int i = 0; i < grid.nx; ++i) {
      const std::size_t node = static_cast<std::size_t>(j) * grid.nx + i;
      const double least = behind[node] + gap, doubt = epsilon * least;
      if (!std::isfinite(least)) continue;
      for (std::size_t k = 0; k < p.size(); ++k) {
        const Front f = front(p, k, grid.first + grid.step * i, grid.first + grid.step * j,
                              footprint, 1, epsilon);
        if (f.possible && f.high > least - doubt)
          bounds.low[node] = std::min(bounds.low[node], std::max(f.low, least - doubt));
        if (f.sure && f.low > least + doubt)
          bounds.high[node] = std::min(bounds.high[node], f.high);
      }
    }
  return bounds;
}

}  // namespace meniscus::reference
