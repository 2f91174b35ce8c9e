// The implicit function at a point in space, in double precision: docs/mesh.md, "The function".
#pragma once

#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

#include "verify/reference/blend.hpp"
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

struct FitSheet {
  double weight = 0;
  Level level;
  Vec3d centre, normal;
};

}  // namespace detail

/// F at X of fits and of the field of their particles.
inline Implicit implicit(const ParticleFits& fits, const std::vector<double>& trust,
                         const Fluid& fluid, const Vec3d& X, const Parameters& params) {
  using detail::FitSheet;
  using detail::Level;
  Implicit out;
  const auto decide = [&](double by) {
    out.decisions.push_back(by > 0);
    out.margin = std::min(out.margin, std::abs(by));
    return by > 0;
  };
  const double c = fluid.density(X), level = params.region.blob_density,
               l = fluid.levelled(X) / level;
  const Vec3d down = fluid.levelled.gradient(X) * (-1 / level);
  const double slope = std::clamp(length(down), 0.35, 1.3);
  Level field{(1 - l) / slope, normalized(down, {0, 0, 0})}, result = field;
  const double contour = params.region.contour_density;
  const bool open = decide(c - 0.3 * contour) && decide(0.97 - c);

  // The value of each fit at X.
  struct FitValue {
    std::size_t fit;
    double weight, pull, f;
    Vec3d g, from;
  };
  std::vector<FitValue> values;
  for (std::size_t k = 0; open && k < fits.size(); ++k) {
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
    if (decide(-dot(g, at_foot))) {
      f = -std::abs(f);
      n = -n;
    }
    const double near = 1 - dot(from, from) / (r * r);
    const double counted = 0.5 + fits.roundness[k] * (-0.4 - 0.5);
    values.push_back({k, w, -6 / (r * r) * counted * w / near, f, n, from});
  }
  if (!values.empty()) {
    const auto same = [&](const Vec3d& a, const Vec3d& b) {
      return smooth_passage(params.blend.same_low, params.blend.same_high, dot(a, b));
    };
    // The direction that dominates under weights, by `rounds` of mean shift.
    const auto leading = [&](const auto& weight, int rounds) {
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
    };
    const auto sheet_of = [&](const auto& weight) {
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
    };
    const Vec3d axis_a = leading([](const FitValue& s) { return s.weight; }, 2);
    const auto weight_a = [&](const FitValue& s) { return s.weight * same(s.g, axis_a); };
    const auto rest = [&](const FitValue& s) { return s.weight * (1 - same(s.g, axis_a)); };
    const FitSheet a = sheet_of(weight_a);
    double all = 0, untrusted = 0, firm = 0, others = 0;
    for (const FitValue& s : values) {
      all += s.weight;
      untrusted += s.weight / trust[s.fit];
      firm += s.weight * fits.firmness[s.fit] / fits.edge[s.fit];
      others += rest(s);
    }
    Level fitted = a.level;
    double edge = 0;
    if (others / all > 0.03) {
      const Vec3d axis_b = leading(rest, 1);
      const FitSheet b = sheet_of([&](const FitValue& s) { return rest(s) * same(s.g, axis_b); });
      const FitSheet d =
          sheet_of([&](const FitValue& s) { return rest(s) * (1 - same(s.g, axis_b)); });
      const auto concave = [&](const FitSheet& p, const FitSheet& q) {
        return smooth_passage(-0.25, 0.25, dot(q.centre - p.centre, p.normal - q.normal));
      };
      const auto meeting = [&](const Level& p, const Level& q, double k) {
        return decide(p.f - q.f) ? detail::mixed(p, q, k) : detail::mixed(q, p, k);
      };
      const double ab = concave(a, b), share_b = smooth_passage(0.03, 0.1, b.weight / all),
                   share_d = smooth_passage(0.03, 0.1, d.weight / all);
      const Level pair = share_b > 0 || share_d > 0 ? meeting(a.level, b.level, ab) : a.level;
      fitted = detail::mixed(a.level, pair, share_b);
      if (share_d > 0) {
        const double ad = concave(a, d), bd = concave(b, d);
        const bool is_ab = decide(ab - 0.5), is_ad = decide(ad - 0.5), is_bd = decide(bd - 0.5);
        Level three;
        if (is_ab == is_bd && is_ab != is_ad)
          three = meeting(meeting(a.level, d.level, ad), b.level, ab);
        else if (is_ab == is_ad && is_ab != is_bd)
          three = meeting(a.level, meeting(b.level, d.level, bd), ab);
        else
          three = meeting(pair, d.level, ad);
        fitted = detail::mixed(fitted, three, share_d);
      }
      edge = share_b * (1 - ab);
    }
    const double trusted =
        std::min(1.001 * all / untrusted, 1.0) * smooth_passage(0.002, 0.015, firm);
    double share =
        trusted * std::clamp(4 * (c - contour * (1 - 0.7 * edge) + 0.1 * trusted), 0.0, 1.0);
    const double agreement =
        reference::agreement(std::abs(fitted.f - field.f), dot(fitted.g, field.g), fluid.disorder);
    const double compared = reference::compared_at(trusted) * (1 - edge);
    share *= (1 - compared * (1 - agreement)) * (1 - smooth_passage(0.9, 0.97, c));
    result = detail::mixed(field, fitted, share);
  }
  out.value = result.f;
  out.gradient = normalized(result.g, {0, 0, 0});
  return out;
}

}  // namespace meniscus::reference
