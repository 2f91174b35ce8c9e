// The screen-space filters in double precision, from the equations.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <vector>

#include "stages/stage_data.hpp"
#include "verify/reference/bounded.hpp"
#include "verify/reference/epsilon.hpp"

namespace meniscus::reference {

/// What a filter made of a map, and how near its decisions were.
struct Filtered {
  std::vector<double> depth;
  double margin = 1e9;       // of comparisons between depths, particle radii
  double disc_margin = 1e9;  // of a sample to the disc's edge, relative
  int most = 0;              // samples in the largest window
};

/// The window of a sample of depth t: a Gaussian of `sigma(t)` samples (along u, along v), cut to a
/// disc of 2.5 sigma, along the axes that are set.
struct FilterWindow {
  std::function<std::array<double, 2>(double)> sigma;
  bool along_u = true, along_v = true;
};

/// The window whose sigma is a length, particle radii.
inline FilterWindow window_of(const View& view, const SampleGrid& grid, double sigma,
                              bool along_u = true, bool along_v = true) {
  return {[=](double t) {
            const double scale = sigma / (view.w_row[3] - view.w_row[2] * t) / grid.step;
            return std::array<double, 2>{scale * view.u_scale, scale * view.v_scale};
          },
          along_u, along_v};
}

/// Calls visit(di, dj, weight) for the window's samples but the centre.
template <class Visit>
void visit_window(const FilterWindow& window, double t, Filtered& result, Visit&& visit) {
  const auto [su, sv] = window.sigma(t);
  const int ru = window.along_u ? static_cast<int>(2.5 * su) + 1 : 0;
  const int rv = window.along_v ? static_cast<int>(2.5 * sv) + 1 : 0;
  int count = 1;
  for (int dj = -rv; dj <= rv; ++dj)
    for (int di = -ru; di <= ru; ++di) {
      if (di == 0 && dj == 0) continue;
      const double squared = di * di / (su * su) + dj * dj / (sv * sv);
      result.disc_margin = std::min(result.disc_margin, std::abs(squared / 6.25 - 1));
      if (squared > 6.25) continue;
      ++count;
      visit(di, dj, std::exp(-squared / 2));
    }
  result.most = std::max(result.most, count);
}

/// How far a float quotient of sums over a window can be from the exact one. The centre weighs 1.
/// A weight is exp(-x): x has eight roundings and is at most `exponent` where the weight counts,
/// and the exponential is good to 2e-7. The quotient of sum w s / sum w, |s| <= span, moves by at
/// most 2 span times the weights' relative error, and by as much for each of the sums' roundings.
inline double quotient_error(const Filtered& filtered, double exponent, double span) {
  const double weight = 8 * kEpsilon * exponent + 2e-7;
  return 2 * span * (weight + (filtered.most + 4) * kEpsilon) + 40 * kEpsilon;
}

inline Filtered filter_bilateral(const std::vector<double>& depth, const SampleGrid& grid,
                                 const FilterWindow& window, double range) {
  Filtered result;
  result.depth = depth;
  for (int j = 0; j < grid.ny; ++j)
    for (int i = 0; i < grid.nx; ++i) {
      const double t = depth[j * grid.nx + i];
      if (!std::isfinite(t)) continue;
      double sum = t, total = 1;
      visit_window(window, t, result, [&](int di, int dj, double weight) {
        if (i + di < 0 || i + di >= grid.nx || j + dj < 0 || j + dj >= grid.ny) return;
        const double there = depth[(j + dj) * grid.nx + i + di];
        if (!std::isfinite(there)) return;
        const double w = weight * std::exp(-std::pow((there - t) / range, 2) / 2);
        sum += w * there;
        total += w;
      });
      result.depth[j * grid.nx + i] = sum / total;
    }
  return result;
}

/// Truong and Yuksel 2018: for each sample the range that holds on the way to it, along the column
/// and then along the row; then the sum over pairs.
inline Filtered filter_narrow_range(const std::vector<double>& depth, const SampleGrid& grid,
                                    const FilterWindow& window, double delta, double mu) {
  Filtered result;
  result.depth = depth;
  const auto at = [&](int i, int j) { return depth[j * grid.nx + i]; };
  const auto inside = [&](int i, int j) { return i >= 0 && i < grid.nx && j >= 0 && j < grid.ny; };
  for (int j = 0; j < grid.ny; ++j)
    for (int i = 0; i < grid.nx; ++i) {
      const double t = at(i, j);
      if (!std::isfinite(t)) continue;
      // What the sample (di, dj) counts as: NaN when it is too near or outside the image.
      const auto counted = [&](int di, int dj) -> double {
        double low = t - delta, high = t + delta;
        double value = t;
        const auto visit = [&](int a, int b) {
          value = std::nan("");
          if (!inside(i + a, j + b)) return;
          const double there = at(i + a, j + b);
          if (std::isfinite(there))
            result.margin =
                std::min({result.margin, std::abs(there - low), std::abs(there - high)});
          if (there < low) return;
          if (there > high) {
            value = t + mu;
            return;
          }
          value = there;
          low = std::min(low, there - delta);
          high = std::max(high, there + delta);
        };
        for (int b = 1; b <= std::abs(dj); ++b) visit(0, dj < 0 ? -b : b);
        for (int a = 1; a <= std::abs(di); ++a) visit(di < 0 ? -a : a, dj);
        return value;
      };
      double sum = t, total = 1;
      visit_window(window, t, result, [&](int di, int dj, double weight) {
        const double here = counted(di, dj), opposite = counted(-di, -dj);
        if (std::isnan(here) || std::isnan(opposite)) return;
        sum += weight * here;
        total += weight;
      });
      result.depth[j * grid.nx + i] = sum / total;
    }
  return result;
}

/// One step of mean curvature flow of the eye points X(i, j) at the samples' depths: the plane
/// through X moves by dtau H along its normal, and the ray meets it there. With the error that
/// floats may make of it.
inline std::vector<Bounded> flow_step(const View& view, const std::vector<Bounded>& depth,
                                      const SampleGrid& grid, double z_max, double dtau,
                                      double& margin) {
  using Point = std::array<Bounded, 3>;
  const auto combined = [](double a, const Point& p, double b, const Point& q) {
    Point r;
    for (int k = 0; k < 3; ++k) r[k] = a * p[k] + b * q[k];
    return r;
  };
  const auto product = [](const Point& p, const Point& q) {
    return p[0] * q[0] + p[1] * q[1] + p[2] * q[2];
  };
  std::vector<Bounded> result = depth;
  for (int j = 0; j < grid.ny; ++j)
    for (int i = 0; i < grid.nx; ++i) {
      const Bounded t = depth[j * grid.nx + i];
      if (!std::isfinite(t.value)) continue;
      const auto point = [&](int di, int dj, const Bounded& d) -> Point {
        const double u = grid.first + grid.step * (i + di), v = grid.first + grid.step * (j + dj);
        const Vec3d on_ray = point_at(view, u, v, 0), along = ray_direction(view, u, v);
        return {on_ray.x + d * along.x, on_ray.y + d * along.y, 0.0 - d};
      };
      const auto has = [&](int di, int dj) {
        if (i + di < 0 || i + di >= grid.nx || j + dj < 0 || j + dj >= grid.ny) return false;
        const double apart = std::abs(depth[(j + dj) * grid.nx + i + di].value - t.value);
        if (std::isfinite(apart)) margin = std::min(margin, std::abs(apart - z_max));
        return apart <= z_max;
      };
      const auto neighbour = [&](int di, int dj) {
        return point(di, dj, has(di, dj) ? depth[(j + dj) * grid.nx + i + di] : t);
      };
      const Point centre = point(0, 0, t);
      // First and second difference along an axis.
      const auto first = [&](int di, int dj) {
        const bool ahead = has(di, dj), behind = has(-di, -dj);
        if (ahead && behind) return combined(0.5, neighbour(di, dj), -0.5, neighbour(-di, -dj));
        return behind ? combined(1, centre, -1, neighbour(-di, -dj))
                      : combined(1, neighbour(di, dj), -1, centre);
      };
      const auto second = [&](int di, int dj) -> Point {
        if (!has(di, dj) || !has(-di, -dj)) return {};
        return combined(1, combined(1, neighbour(di, dj), 1, neighbour(-di, -dj)), -2, centre);
      };
      const Point xu = first(1, 0), xv = first(0, 1), xuu = second(1, 0), xvv = second(0, 1);
      Point xuv{};
      bool all = true;
      for (int b = -1; b <= 1; ++b)
        for (int a = -1; a <= 1; ++a) all = all && ((a == 0 && b == 0) || has(a, b));
      if (all)
        xuv = combined(0.25, combined(1, neighbour(1, 1), -1, neighbour(1, -1)), -0.25,
                       combined(1, neighbour(-1, 1), -1, neighbour(-1, -1)));
      const Point n{xu[1] * xv[2] - xu[2] * xv[1], xu[2] * xv[0] - xu[0] * xv[2],
                    xu[0] * xv[1] - xu[1] * xv[0]};
      const Vec3d ray = ray_direction(view, grid.first + grid.step * i, grid.first + grid.step * j);
      const Bounded curvature =
          (product(xu, xu) * product(xvv, n) - 2 * product(xu, xv) * product(xuv, n) +
           product(xv, xv) * product(xuu, n)) /
          (2 * product(n, n) * product(n, Point{ray.x, ray.y, ray.z}));
      Bounded move = dtau * curvature;
      move.value = std::clamp(move.value, -0.1, 0.1);
      result[j * grid.nx + i] = t + move;
    }
  return result;
}

}  // namespace meniscus::reference
