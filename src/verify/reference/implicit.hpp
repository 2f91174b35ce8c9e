// The implicit function at a point in space, in double precision: docs/mesh.md, "The function".
#pragma once

#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

#include "verify/reference/hits.hpp"
#include "verify/reference/settle.hpp"

namespace meniscus::reference {

/// F, its unit gradient, and what was decided on the way.
struct Implicit {
  double value = 0;
  Vec3d gradient;
  std::vector<char> decisions;
  double margin = std::numeric_limits<double>::infinity();  // by which, at least
};

/// The levelled field, and the particles' density; a particle's mass, and how irregularly they lie
/// (0 .. 1).
struct Fluid {
  Field levelled;
  double mass = 1, disorder = 0;
  double density(const Vec3d& x) const { return mass * reference::density(levelled.particles, x); }
};

namespace detail {

struct Level {
  double f = 0;
  Vec3d g;
};

inline Level mixed(const Level& a, const Level& b, double share) {
  return {a.f * (1 - share) + b.f * share, a.g * (1 - share) + b.g * share};
}

/// A fit at X: its weight, how that pulls at the gradient, its value and its unit gradient; where X
/// lies from its foot.
struct FitValue {
  std::size_t fit;
  double weight, pull, f;
  Vec3d g, from;
};

struct FitSheet {
  double weight = 0;
  Level level;
  Vec3d centre, normal;
};

/// Notes a decision.
inline bool decide(Implicit& out, double by) {
  out.decisions.push_back(by > 0);
  out.margin = std::min(out.margin, std::abs(by));
  return by > 0;
}

inline std::vector<FitValue> values_of(const ParticleFits& fits, const std::vector<double>& trust,
                                       const Vec3d& X, const Parameters& params, Implicit& out) {
  std::vector<FitValue> values;
  for (std::size_t k = 0; k < fits.size(); ++k) {
    if (!counts(fits, trust, k) || fits.visible[k] < 1e-3) continue;
    const double r = reach(fits, k, params.fit, params.blend);
    const Vec3d from = X - fits.foot[k];
    const double w = fits.edge[k] * trust[k] * fits.visible[k] * nearness(from, r);
    if (!(w > 0)) continue;
    Vec3d g, at_foot;
    const double steep = value(fits, k, X, &g);
    value(fits, k, fits.foot[k], &at_foot);
    double f = std::clamp(steep / length(g), -4.0, 4.0);
    Vec3d n = g / length(g);
    if (decide(out, -dot(g, at_foot))) {
      f = -std::abs(f);
      n = -n;
    }
    const double near = 1 - dot(from, from) / (r * r);
    const double counted = 0.5 + fits.roundness[k] * (-0.4 - 0.5);
    values.push_back({k, w, -6 / (r * r) * counted * w / near, f, n, from});
  }
  return values;
}

/// Fits of several sheets at one place.
struct Sheets {
  const ParticleFits& fits;
  const std::vector<FitValue>& values;
  const BlendParams& blend;
  Implicit& out;

  double same(const Vec3d& a, const Vec3d& b) const {
    return smooth_step(blend.same_low, blend.same_high, dot(a, b));
  }

  /// The direction that dominates under weights, by `rounds` of mean shift.
  template <class Weight>
  Vec3d leading(const Weight& weight, int rounds) const {
    double best = 0;
    Vec3d axis;
    for (const FitValue& s : values)
      if (weight(s) > best) {
        best = weight(s);
        axis = s.g;
      }
    for (int round = 0; round < rounds; ++round) {
      Vec3d sum;
      for (const FitValue& s : values) sum += s.g * (weight(s) * same(s.g, axis));
      axis = normalized(sum, {0, 0, 0});
    }
    return axis;
  }

  template <class Weight>
  FitSheet sheet_of(const Weight& weight) const {
    FitSheet sheet;
    Vec3d v, u;
    for (const FitValue& s : values) {
      const double w = weight(s), share = s.weight > 0 ? w / s.weight : 0;
      sheet.weight += w;
      sheet.level.f += w * s.f;
      sheet.centre += fits.foot[s.fit] * w;
      sheet.normal += s.g * w;
      u += s.from * (share * s.pull);
      v += s.from * (share * s.pull * s.f);
    }
    if (!(sheet.weight > 0)) return sheet;
    sheet.level.f /= sheet.weight;
    sheet.centre = sheet.centre / sheet.weight;
    sheet.level.g = normalized(sheet.normal + v - u * sheet.level.f, {0, 0, 0});
    sheet.normal = normalized(sheet.normal, {0, 0, 0});
    return sheet;
  }

  /// How far two sheets meet in a concave crease.
  static double concave(const FitSheet& p, const FitSheet& q) {
    return smooth_step(-0.25, 0.25, dot(q.centre - p.centre, p.normal - q.normal));
  }

  /// The lesser of two levels, or the greater one as far as k says.
  Level meeting(const Level& p, const Level& q, double k) const {
    return decide(out, p.f - q.f) ? mixed(p, q, k) : mixed(q, p, k);
  }

  /// Three sheets, of which `pair` are the first two, in the order in which they meet.
  Level three(const FitSheet& a, const FitSheet& b, const FitSheet& d, const Level& pair) const {
    const double ab = concave(a, b), ad = concave(a, d), bd = concave(b, d);
    const bool is_ab = decide(out, ab - 0.5), is_ad = decide(out, ad - 0.5),
               is_bd = decide(out, bd - 0.5);
    if (is_ab == is_bd && is_ab != is_ad)
      return meeting(meeting(a.level, d.level, ad), b.level, ab);
    if (is_ab == is_ad && is_ab != is_bd)
      return meeting(a.level, meeting(b.level, d.level, bd), ab);
    return meeting(pair, d.level, ad);
  }
};

/// What the fits say at X: their level, and how far they are to be believed.
struct Fitted {
  Level level;
  double edge = 0;     // how far X lies by a convex edge
  double trusted = 0;  // 0 .. 1
};

inline Fitted fitted_level(const ParticleFits& fits, const std::vector<double>& trust,
                           const std::vector<FitValue>& values, const BlendParams& blend,
                           Implicit& out) {
  const Sheets sheets{fits, values, blend, out};
  const Vec3d axis_a = sheets.leading([](const FitValue& s) { return s.weight; }, 2);
  const auto rest = [&](const FitValue& s) { return s.weight * (1 - sheets.same(s.g, axis_a)); };
  const FitSheet a =
      sheets.sheet_of([&](const FitValue& s) { return s.weight * sheets.same(s.g, axis_a); });
  double all = 0, untrusted = 0, firm = 0, others = 0;
  for (const FitValue& s : values) {
    all += s.weight;
    untrusted += s.weight / trust[s.fit];
    firm += s.weight * fits.firmness[s.fit] / fits.edge[s.fit];
    others += rest(s);
  }
  Fitted fitted{a.level, 0,
                std::min(1.001 * all / untrusted, 1.0) * smooth_step(0.002, 0.015, firm)};
  if (!(others / all > 0.03)) return fitted;
  const Vec3d axis_b = sheets.leading(rest, 1);
  const FitSheet b =
      sheets.sheet_of([&](const FitValue& s) { return rest(s) * sheets.same(s.g, axis_b); });
  const FitSheet d =
      sheets.sheet_of([&](const FitValue& s) { return rest(s) * (1 - sheets.same(s.g, axis_b)); });
  const double ab = Sheets::concave(a, b), share_b = smooth_step(0.03, 0.1, b.weight / all),
               share_d = smooth_step(0.03, 0.1, d.weight / all);
  const Level pair = share_b > 0 || share_d > 0 ? sheets.meeting(a.level, b.level, ab) : a.level;
  fitted.level = mixed(a.level, pair, share_b);
  if (share_d > 0) fitted.level = mixed(fitted.level, sheets.three(a, b, d, pair), share_d);
  fitted.edge = share_b * (1 - ab);
  return fitted;
}

}  // namespace detail

/// F at X of fits and of the field of their particles.
inline Implicit implicit(const ParticleFits& fits, const std::vector<double>& trust,
                         const Fluid& fluid, const Vec3d& X, const Parameters& params) {
  Implicit out;
  const double c = fluid.density(X), level = params.region.blob_density,
               l = fluid.levelled(X) / level;
  const Vec3d down = fluid.levelled.gradient(X) * (-1 / level);
  const double slope = std::clamp(length(down), 0.35, 1.3);
  const detail::Level field{(1 - l) / slope, normalized(down, {0, 0, 0})};
  detail::Level result = field;
  const double contour = params.region.contour_density;
  const bool open = detail::decide(out, c - 0.3 * contour) && detail::decide(out, 0.97 - c);
  std::vector<detail::FitValue> values;
  if (open) values = detail::values_of(fits, trust, X, params, out);
  if (!values.empty()) {
    const auto [fitted, edge, trusted] =
        detail::fitted_level(fits, trust, values, params.blend, out);
    double share =
        trusted * std::clamp(4 * (c - contour * (1 - 0.7 * edge) + 0.1 * trusted), 0.0, 1.0);
    const double agreement =
        reference::agreement(std::abs(fitted.f - field.f), dot(fitted.g, field.g), fluid.disorder);
    const double compared = reference::compared_at(trusted) * (1 - edge);
    share *= (1 - compared * (1 - agreement)) * (1 - smooth_step(0.9, 0.97, c));
    result = detail::mixed(field, fitted, share);
  }
  out.value = result.f;
  out.gradient = normalized(result.g, {0, 0, 0});
  return out;
}

}  // namespace meniscus::reference
