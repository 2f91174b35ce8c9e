// The paper's Eqs. 2 to 7 in double precision, as paper.hpp and paper.cl say they are read.
#pragma once

#include <algorithm>
#include <cmath>
#include <numbers>
#include <vector>

#include "stages/group.hpp"
#include "stages/view.hpp"

namespace meniscus::reference {

/// SLIM's weight at the distance d in units of the support.
inline double slim_weight(double d) {
  return d <= 0.5 ? std::exp(-8 * d * d) : d < 1 ? 2.16536453 * std::pow(1 - d, 4) : 0;
}

struct Filtered {
  bool inside;
  double doubt;  // distance of the filter's value from 1/2
};

/// Eqs. 3 to 5 on the region at sample (i, j); the window ends at three sigma_s (samples).
inline Filtered filter_contour(const std::vector<int>& group, int nx, int ny, int i, int j,
                               const std::vector<Vec3d>& normal, double sigma_s, double sigma_n) {
  const int reach = static_cast<int>(std::ceil(3 * sigma_s));
  const int here = group[static_cast<std::size_t>(j) * nx + i];
  double sum = 0, weight = 0;
  for (int n = -reach; n <= reach; ++n)
    for (int m = -reach; m <= reach; ++m) {
      const int x = i + m, y = j + n;
      if (x < 0 || y < 0 || x >= nx || y >= ny) continue;
      const int there = group[static_cast<std::size_t>(y) * nx + x];
      double w = std::exp(-(m * m + n * n) / (2 * sigma_s * sigma_s));
      if (here >= 0 && there >= 0) {
        const Vec3d d = normal[here] - normal[there];
        w *= std::exp(-dot(d, d) / (2 * sigma_n * sigma_n));
      }
      weight += w;
      if (there >= 0) sum += w;
    }
  return {sum > weight / 2, std::abs(sum / weight - 0.5)};
}

/// Eqs. 6 and 7 at pixel (u, v) for groups whose surfaces are planes through their centres.
inline double blend_planes(const View& view, const Groups& groups, int owner, double reference,
                           double u, double v, double reach, double d_max) {
  double sum = 0, weight = 0;
  for (std::size_t k = 0; k < groups.size(); ++k) {
    const PixelPosition centre = project(view, groups.centre[k]);
    const double d = std::hypot((u - centre.u) * centre.w / view.u_scale,
                                (v - centre.v) * centre.w / view.v_scale);
    if (d > groups.radius[k] + reach) continue;
    const Vec3d from = point_at(view, u, v, 0), along = ray_direction(view, u, v);
    const double t = dot(groups.centre[k] - from, groups.normal[k]) / dot(along, groups.normal[k]);
    if (!(std::abs(t - reference) <= d_max)) continue;
    const double like = std::max(0.0, dot(groups.normal[k], groups.normal[owner]));
    const double b = groups.radius[k] * (0.15 + 0.45 * std::pow(like, 4));
    const double beta =
        1 / (std::sqrt(2 * std::numbers::pi) * b * b) * std::exp(-d * d / (2 * b * b));
    sum += beta * t;
    weight += beta;
  }
  return weight > 0 ? sum / weight : reference;
}

}  // namespace meniscus::reference
