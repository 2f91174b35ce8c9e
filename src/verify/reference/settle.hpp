// What a sample shows, in double precision: docs/method.md, "density".
#pragma once

#include <algorithm>
#include <limits>
#include <vector>

#include "verify/reference/density.hpp"

namespace meniscus::reference {

inline constexpr double kNowhere = std::numeric_limits<double>::infinity();

inline double smooth_step(double low, double high, double x) {
  const double t = std::clamp((x - low) / (high - low), 0.0, 1.0);
  return t * t * (3 - 2 * t);
}

/// A particle's share is divided by a level that runs from `level` where the density is that of a
/// lone particle to 0.45 inside the fluid; the weight is 1 for a lone particle.
inline double level_weight(double density, double level) {
  return level / (level + (0.45 - level) * smooth_step(0.35, 0.85, density));
}

/// Shares times weights.
struct Field {
  Projected particles;
  std::vector<double> weight;

  double operator()(const Vec3d& x) const {
    double sum = 0;
    for (std::size_t i = 0; i < particles.size(); ++i)
      sum += weight[i] * share(length(x - particles.eye(i)) / 2);
    return sum;
  }

  Vec3d gradient(const Vec3d& x) const {
    Vec3d sum;
    for (std::size_t i = 0; i < particles.size(); ++i) {
      const Vec3d apart = x - particles.eye(i);
      const double distance = length(apart), q = distance / 2;
      if (q >= 2 || distance == 0) continue;
      const double slope = share_slope(q);
      sum += apart * (weight[i] * slope / (2 * distance));
    }
    return sum;
  }
};

/// A stretch of a ray in which the field reaches the level.
struct Chord {
  double enter = kNowhere, leave = kNowhere;  // depths
};

/// The chords of a ray between the depths `from` and `to`, found by steps of 1/64 radius and
/// bisected; shorter ones may be missed. One that is entered before `from` starts there.
inline std::vector<Chord> chords(const Field& field, const View& view, double u, double v,
                                 double from, double to, double level) {
  const auto inside = [&](double t) { return field(point_at(view, u, v, t)) >= level; };
  const double step = 1 / (64 * length(ray_direction(view, u, v)));
  std::vector<Chord> found;
  bool was = inside(from);
  if (was) found.push_back({from, to});
  for (double before = from; before < to; before += step) {
    const double after = std::min(before + step, to);
    const bool is = inside(after);
    if (is != was) {
      double low = before, high = after;
      for (int k = 0; k < 50; ++k) {
        const double middle = (low + high) / 2;
        (inside(middle) == was ? low : high) = middle;
      }
      if (is)
        found.push_back({high, to});
      else
        found.back().leave = low;
    }
    was = is;
  }
  return found;
}

/// A blended sample's share against the field: its trust on a kept triangle. Elsewhere the contour
/// ends it where the density falls below `contour`, 0.1 (1 - trust) more with less trust, in one
/// step where it is trusted and over 1/20 where it is not. On a convex edge 0.3 of the contour's
/// density are enough.
inline double blend_share(double trust, bool vouched, bool on_edge, double density,
                          double contour) {
  const double inside = density - (on_edge ? 0.3 : 1) * contour - 0.1 * (1 - trust);
  if (trust >= 1) return vouched || inside >= 0 ? 1 : 0;
  return trust * std::clamp(20 * inside, 0.0, 1.0);
}

/// How far blend and field agree that lie `apart` radii from each other along the blend's normal
/// and whose normals' product is `alike`: the factor on the blend's share but at convex creases.
inline double agreement(double apart, double alike) {
  return (1 - smooth_step(0.5, 1, apart)) * smooth_step(0.6, 0.92, alike);
}

}  // namespace meniscus::reference
