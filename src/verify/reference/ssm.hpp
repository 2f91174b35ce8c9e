// Screen Space Meshes' smoothing and normals in double precision, from the equations.
#pragma once

#include <algorithm>
#include <cmath>
#include <functional>
#include <vector>

#include "stages/stage_data.hpp"
#include "verify/reference/epsilon.hpp"

namespace meniscus::reference {

struct Smoothed {
  std::vector<double> depth;
  double layer_margin = 1e9;   // how near a difference came to z_max, relative
  double weight_margin = 1e9;  // how near a weight came to the least, relative
  int widest = 0;              // the largest window, samples on one side
};

/// One pass of the binomial filter along an axis (0: rows, 1: columns): row 2n of Pascal's
/// triangle, n = half_width(depth), over the largest symmetric window in which both ends of every
/// smaller one lie within z_max of the centre and have at least 1/1024 of its weight.
inline Smoothed smooth_axis(const std::vector<double>& depth, int nx, int ny, int axis,
                            double z_max, const std::function<double(double)>& half_width) {
  Smoothed result;
  result.depth = depth;
  const int step = axis == 0 ? 1 : nx;
  for (int j = 0; j < ny; ++j)
    for (int i = 0; i < nx; ++i) {
      const int here = j * nx + i;
      const double centre = depth[here];
      if (!std::isfinite(centre)) continue;
      const double n = half_width(centre);
      const int before = axis == 0 ? i : j;
      const int after = axis == 0 ? nx - 1 - i : ny - 1 - j;
      double sum = centre, total = 1;
      for (int k = 1; k <= std::min(before, after) && k < n + 1; ++k) {
        // C(2n, n + k) / C(2n, n)
        const double weight =
            std::exp(2 * std::lgamma(n + 1) - std::lgamma(n + k + 1) - std::lgamma(n - k + 1));
        result.weight_margin = std::min(result.weight_margin, std::abs(1024 * weight - 1));
        if (weight < 1.0 / 1024) break;
        const double a = depth[here - k * step], b = depth[here + k * step];
        for (const double end : {a, b})
          if (std::isfinite(end))
            result.layer_margin =
                std::min(result.layer_margin, std::abs(std::abs(end - centre) / z_max - 1));
        if (!(std::abs(a - centre) <= z_max && std::abs(b - centre) <= z_max)) break;
        sum += weight * (a + b);
        total += 2 * weight;
        result.widest = std::max(result.widest, k);
      }
      result.depth[here] = sum / total;
    }
  return result;
}

/// Largest error of one pass in floats: centre + S / T, S = sum of w (a + b), T = 1 + 2 sum of w,
/// where a and b are differences of at most z_max (exact: both ends lie within a factor of two).
/// n has the relative error `width_error`. A weight's recurrence multiplies by a factor below 1
/// whose numerator and denominator have that error once each, and rounds four times, so that w(k)
/// is off by at most k (2 width_error + 4 epsilon). A term of S rounds three times, and K of them
/// are added. S / T is at most z_max, so T's error counts as much as S's. Where a weight is so near
/// the least that rounding decides whether the tap counts, the result differs by at most that
/// weight times the two differences.
inline double pass_error(const Smoothed& pass, double z_max, double width_error) {
  const double k = pass.widest;
  const double weights = 0.5 * k * (k + 1) * (2 * width_error + 4 * kEpsilon);
  const double undecided = pass.weight_margin < 1024 * weights ? 2 * z_max / 1024 : 0;
  return 4 * z_max * (weights + (3 * k + k * k) * kEpsilon) + 40 * kEpsilon + undecided;
}

/// The normals of a depth map by differences that do not cross z_max, eye axes.
inline std::vector<Vec3d> depth_normals(const View& view, const std::vector<double>& depth,
                                        const SampleGrid& grid, double z_max) {
  std::vector<Vec3d> normals(grid.size());
  const auto at = [&](int i, int j) {
    return i < 0 || j < 0 || i >= grid.nx || j >= grid.ny
               ? double{kNoSurface}
               : depth[static_cast<std::size_t>(j) * grid.nx + i];
  };
  for (int j = 0; j < grid.ny; ++j)
    for (int i = 0; i < grid.nx; ++i) {
      const double t = at(i, j);
      if (!std::isfinite(t)) continue;
      const auto point = [&](int di, int dj, double d) {
        return point_at(view, grid.first + grid.step * (i + di), grid.first + grid.step * (j + dj),
                        d);
      };
      const auto difference = [&](int di, int dj) {
        const double ahead = at(i + di, j + dj), behind = at(i - di, j - dj);
        const bool use_ahead = std::abs(ahead - t) <= z_max;
        const bool use_behind = std::abs(behind - t) <= z_max;
        if (!use_ahead && !use_behind) return point(di, dj, t) - point(0, 0, t);
        return (use_ahead ? point(di, dj, ahead) : point(0, 0, t)) -
               (use_behind ? point(-di, -dj, behind) : point(0, 0, t));
      };
      const Vec3d n = normalized(cross(difference(0, 1), difference(1, 0)));
      const Vec3d ray = ray_direction(view, grid.first + grid.step * i, grid.first + grid.step * j);
      normals[static_cast<std::size_t>(j) * grid.nx + i] = dot(n, ray) > 0 ? -n : n;
    }
  return normals;
}

}  // namespace meniscus::reference
