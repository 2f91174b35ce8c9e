// The sheets of what a ray meets, and the creases in which they meet, in double precision:
// docs/method.md, "Blend"; the kernels' part is creases.cl.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "verify/reference/hits.hpp"

namespace meniscus::reference {

/// What a ray shows.
struct Blended {
  double depth = std::numeric_limits<double>::infinity();
  Vec3d normal;
  double trust = 0;
  bool on_edge = false, ended = false, passed = false;
  std::size_t hits = 0;
  double cancelled = 0;  // size of the terms that cancel in the normal, over its own
  double margin = std::numeric_limits<double>::infinity();  // radii by which the sheets that meet
                                                            // were told apart
};

/// How far a second or third sheet counts that weighs this share of all that a ray meets.
inline double counts_by(double share) { return smooth_step(0.003, 0.02, share); }

/// How far a hit is of the sheet around a gradient. Round fits go on around bends.
inline double of_sheet(const FitsOnRay& ray, const Hit& hit, const Vec3d& gradient) {
  return ray.same_sheet(dot(hit.gradient, gradient) + 0.9 * ray.fits.roundness[hit.fit]);
}

/// A sheet that a ray meets: means over its hits.
struct Sheet {
  double weight = 0, t = 0;
  Vec3d centre;          // of the feet
  Vec3d gradients;       // their sum
  Vec3d blended;         // ... with a share of the weights' gradients
  double cancelled = 0;  // size of the terms that cancel in this
  Vec3d normal() const { return normalized(gradients); }
};
using ThreeSheets = std::array<Sheet, 3>;

/// Adds a share of Sum f grad beta to the sum of gradients: three quarters of it where a fit is not
/// round, less than none of it where it is.
inline void pull_normal(const FitsOnRay& ray, const Hit& hit, double part, Sheet* sheet) {
  const Vec3d from_foot = hit.at - ray.fits.foot[hit.fit];
  const double reach = ray.reach_of(hit.fit), w = nearness(from_foot, reach);
  if (!(w > 0)) return;
  const double counts = 2 * (0.75 + ray.fits.roundness[hit.fit] * (-0.2 - 0.75));
  const Vec3d pull =
      half_gradient(from_foot, reach) * (counts * part / w * dot(hit.gradient, ray.direction));
  sheet->blended += pull * (sheet->t - hit.t);
  sheet->cancelled += length(pull) * (std::abs(sheet->t - ray.t0) + std::abs(hit.t - ray.t0));
}

/// How far each sheet's centre lies over the other's plane: below 0 they meet in a convex edge.
inline double over_each(const Sheet& p, const Sheet& q) {
  return dot(q.centre - p.centre, p.normal() - q.normal());
}

/// How the sheets of a ray meet.
struct Meeting {
  bool has_b, has_c;
  double some_b, some_c;  // how far they count
  bool ab, ac, bc;        // in a convex edge
};

inline Meeting meeting_of(const ThreeSheets& sheets, double all) {
  const auto& [a, b, c] = sheets;
  const bool has_b = b.weight > 0, has_c = c.weight > 0;
  return {.has_b = has_b,
          .has_c = has_c,
          .some_b = counts_by(b.weight / all),
          .some_c = counts_by(c.weight / all),
          .ab = has_b && over_each(a, b) < 0,
          .ac = has_c && over_each(a, c) < 0,
          .bc = has_c && over_each(b, c) < 0};
}

/// Whether two sheets lie so near each other that they meet.
inline bool near_each(double p, double q, const BlendParams& params) {
  return std::abs(p - q) <= params.crease;
}

/// Whether A is more than a rounding of B.
inline bool has_a(const Sheet& a, const Sheet& b) { return a.weight > 1e-9 * b.weight; }

/// How much of what is shown is of B and of C. On a convex edge the deeper of two sheets takes the
/// place of the other, on a concave one the nearer. Of three edges between three sheets two are of
/// one kind: the sheets of the other edge meet first, then the third.
struct Shares {
  double b = 0, c = 0;
};

inline Shares shares_of(const ThreeSheets& sheets, const Meeting& meeting,
                        const BlendParams& params) {
  const Sheet &a = sheets[0], &b = sheets[1], &c = sheets[2];
  const bool ab = meeting.ab, ac = meeting.ac, bc = meeting.bc;
  // How far depth q takes the place of p, by how far its sheet counts.
  const auto takes = [&](double p, double q, bool convex, double some) {
    return near_each(p, q, params) && (convex ? q >= p : q <= p) ? some : 0;
  };
  const auto b_takes = [&](double p, double q) {
    return has_a(a, b) ? takes(p, q, ab, meeting.some_b) : 1;
  };
  if (!meeting.has_b) return {};
  if (!meeting.has_c) return {b_takes(a.t, b.t), 0};
  if (ab == bc && ab != ac) {  // A meets C, then B
    const double first = takes(a.t, c.t, ac, meeting.some_c);
    const double of_b = b_takes(a.t + first * (c.t - a.t), b.t);
    return {of_b, first * (1 - of_b)};
  }
  if (ab == ac && ab != bc) {  // B meets C, then A
    const double first = takes(b.t, c.t, bc, meeting.some_c);
    const double both = b_takes(a.t, b.t + first * (c.t - b.t));
    return {both * (1 - first), both * first};
  }
  const double first = b_takes(a.t, b.t);  // A meets B, then C
  const double of_c = takes(a.t + first * (b.t - a.t), c.t, ac, meeting.some_c);
  return {first * (1 - of_c), of_c};
}

/// By how much two sheets that count were told apart, particle radii.
inline double margin_of(const ThreeSheets& sheets, double all, const BlendParams& params) {
  double margin = std::numeric_limits<double>::infinity();
  const auto see = [&](const Sheet& p, const Sheet& q) {
    if (!(std::min(p.weight, q.weight) > 0.003 * all)) return;
    const double apart = std::abs(p.t - q.t);
    margin = std::min({margin, std::abs(over_each(p, q)), apart, std::abs(apart - params.crease)});
  };
  const auto& [a, b, c] = sheets;
  see(a, b);
  see(a, c);
  see(b, c);
  return margin;
}

}  // namespace meniscus::reference
