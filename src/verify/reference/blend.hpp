// The blend of the fits that one ray meets, in double precision: docs/method.md, "Blend"; as in
// blend.cl. hits.hpp, creases.hpp and hidden.hpp are parts of it, as of the kernels.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <vector>

#include "verify/reference/epsilon.hpp"
#include "verify/reference/hidden.hpp"

namespace meniscus::reference {

/// A unit normal turned until its product with the ray's direction is -.01: what is seen faces the
/// eye.
inline Vec3d facing(const Vec3d& normal, const Vec3d& ray) {
  const Vec3d along = normalized(ray);
  const double back = dot(normal, along) + 0.01;
  return back > 0 ? normalized(normal - back * along) : normal;
}

/// All that a ray meets; no fits with v < 1/1000.
inline std::vector<Hit> hits_of(const FitsOnRay& ray) {
  std::vector<Hit> hits;
  for (std::size_t k = 0; k < ray.fits.size(); ++k) {
    if (!ray.counts(k) || ray.fits.visible[k] < 1e-3) continue;
    const Hit hit = meet(ray, k);
    if (hit.weight > 0) hits.push_back(hit);
  }
  return hits;
}

/// Means over all that a ray meets, times its weight.
struct Met {
  double weight = 0;
  double untrusted = 0;  // of 1 / T
  double firm = 0;       // phi: sum of beta F / e
  double height = 0;
};

inline Met met_of(const FitsOnRay& ray, const std::vector<Hit>& hits) {
  Met met;
  for (const Hit& hit : hits) {
    met.weight += hit.weight;
    met.untrusted += hit.weight / ray.trust[hit.fit];
    met.firm += hit.weight / hit.fade() * ray.fits.firmness[hit.fit] / ray.fits.edge[hit.fit];
    met.height += hit.weight * hit.height;
  }
  return met;
}

/// The gradient of the heaviest hit, and a round of mean shift; weight(hit) is what a hit weighs.
template <class Weight>
Vec3d heaviest(const std::vector<Hit>& hits, const Weight& weight) {
  return std::max_element(hits.begin(), hits.end(),
                          [&](const Hit& a, const Hit& b) { return weight(a) < weight(b); })
      ->gradient;
}
template <class Weight>
Vec3d mean_shift(const FitsOnRay& ray, const std::vector<Hit>& hits, const Weight& weight,
                 const Vec3d& gradient) {
  Vec3d sum;
  for (const Hit& hit : hits) sum += hit.gradient * (weight(hit) * of_sheet(ray, hit, gradient));
  return length(sum) > 1e-15 ? normalized(sum) : gradient;
}

/// Sheet A lies around the gradient that dominates. Where what is not of A faces two ways, as far
/// as it counts, it makes two sheets, B and C; else it is B.
struct Split {
  Vec3d a, b;        // gradients
  double third = 0;  // how far there is C
};

inline Split split_hits(const FitsOnRay& ray, const std::vector<Hit>& hits) {
  Split split;
  const auto weight = [](const Hit& hit) { return hit.weight; };
  split.a = heaviest(hits, weight);
  for (int round = 0; round < 2; ++round) split.a = mean_shift(ray, hits, weight, split.a);

  const auto rest = [&](const Hit& hit) { return hit.weight * (1 - of_sheet(ray, hit, split.a)); };
  split.b = mean_shift(ray, hits, rest, heaviest(hits, rest));
  double all = 0, not_a = 0;
  Vec3d gradients;  // of what is not of A
  for (const Hit& hit : hits) {
    all += hit.weight;
    not_a += rest(hit);
    gradients += rest(hit) * hit.gradient;
  }
  if (not_a > 0)
    split.third = (1 - smooth_step(0.95, 0.98, length(gradients) / not_a)) * counts_by(not_a / all);
  return split;
}

/// What of a hit's weight is of A, B and C.
inline std::array<double, 3> parts_of(const FitsOnRay& ray, const Hit& hit, const Split& split) {
  const double a = of_sheet(ray, hit, split.a);
  const double c = split.third * (1 - of_sheet(ray, hit, split.b));
  return {hit.weight * a, hit.weight * (1 - a) * (1 - c), hit.weight * (1 - a) * c};
}

inline ThreeSheets sheets_of(const FitsOnRay& ray, const std::vector<Hit>& hits) {
  const Split split = split_hits(ray, hits);
  ThreeSheets sheets;
  for (const Hit& hit : hits)
    for (std::size_t s = 0; s < 3; ++s) {
      const double part = parts_of(ray, hit, split)[s];
      sheets[s].weight += part;
      sheets[s].t += part * hit.t;
      sheets[s].centre += part * ray.fits.foot[hit.fit];
      sheets[s].gradients += part * hit.gradient;
    }
  for (std::size_t s = 0; s < 3; ++s) {
    Sheet& sheet = sheets[s];
    if (!(sheet.weight > 0)) continue;
    sheet.t /= sheet.weight;
    sheet.centre = sheet.centre / sheet.weight;
    sheet.blended = sheet.gradients;
    for (const Hit& hit : hits) pull_normal(ray, hit, parts_of(ray, hit, split)[s], &sheet);
  }
  return sheets;
}

/// A third face may hold the nearer of A and B, which the deeper would end.
inline void hold_nearer(const FitsOnRay& ray, const ThreeSheets& sheets, const Meeting& meeting,
                        double all, Shares* shares) {
  const auto& [a, b, c] = sheets;
  if (!meeting.ab || !near_each(a.t, b.t, ray.params) || !has_a(a, b) || !(meeting.some_b > 0) ||
      !(std::abs(a.t - b.t) > 0.1))
    return;
  const bool a_is_near = a.t < b.t;
  const double held = a_is_near ? held_by(ray, a, b, all) : held_by(ray, b, a, all);
  const double unheld = a_is_near ? 0 : meeting.some_b * (1 - shares->c);
  shares->b += held * (unheld - shares->b);
}

/// Depth and normal of the shown sheets. Returns the middle of their feet.
inline Vec3d show(const FitsOnRay& ray, const ThreeSheets& sheets, const Shares& shares,
                  Blended* out) {
  const std::array share{1 - shares.b - shares.c, shares.b, shares.c};
  Vec3d middle;
  out->depth = 0;
  for (std::size_t s = 0; s < 3; ++s) {
    if (!(share[s] > 0)) continue;
    out->depth += share[s] * sheets[s].t;
    out->normal += share[s] * normalized(sheets[s].blended);
    middle += share[s] * sheets[s].centre;
  }
  out->normal = facing(normalized(out->normal), ray.direction);
  for (const Sheet& sheet : sheets)
    if (sheet.weight > 0)
      out->cancelled = std::max(out->cancelled, sheet.cancelled / length(sheet.blended));
  return middle;
}

/// Whether a ray passes over what it grazes. Where that is not trusted nothing is met.
inline bool pass_by(const FitsOnRay& ray, const ThreeSheets& sheets, const Met& met, Blended* out) {
  const bool over =
      met.height > 0.06 * met.weight || height_over(ray, sheets, met.weight, *out) > 0.06;
  out->passed = over && out->trust > 0.8;
  if (over && !out->passed) out->trust = 0;
  return over;
}

/// Whether a sample lies on a convex edge between two sheets that the ray meets.
inline bool on_convex_edge(const ThreeSheets& sheets, const Meeting& meeting,
                           const BlendParams& params) {
  const auto& [a, b, c] = sheets;
  return (meeting.ab && near_each(a.t, b.t, params) && b.weight > 0.03 * a.weight) ||
         (meeting.ac && near_each(a.t, c.t, params) && c.weight > 0.03 * a.weight);
}

/// The blend on the ray of pixel (u, v), whose reference depth is t0: the paragraphs of
/// docs/method.md, "Blend", one by one.
inline Blended blend(const ParticleFits& fits, const std::vector<double>& trust, const View& view,
                     double u, double v, double t0, const FitParams& fit,
                     const BlendParams& params) {
  const FitsOnRay ray = fits_on_ray(fits, trust, view, u, v, t0, fit, params);
  const std::vector<Hit> hits = hits_of(ray);
  Blended out;
  out.hits = hits.size();
  if (hits.empty()) return out;

  const Met met = met_of(ray, hits);
  const ThreeSheets sheets = sheets_of(ray, hits);
  const Meeting meeting = meeting_of(sheets, met.weight);
  Shares shares = shares_of(sheets, meeting, params);
  hold_nearer(ray, sheets, meeting, met.weight, &shares);
  out.margin = margin_of(sheets, met.weight, params);

  const Vec3d middle = show(ray, sheets, shares, &out);
  // Hardly more than the rim of a weight, or than bevels, is not trusted.
  out.trust =
      std::min(1.001 * met.weight / met.untrusted, 1.0) * smooth_step(0.002, 0.015, met.firm);
  const bool over = pass_by(ray, sheets, met, &out);
  out.on_edge = on_convex_edge(sheets, meeting, params);
  end_at_hidden(ray, middle, &out);
  // Among many firm fits of one sheet the field, which has pits in gaps between particles, is asked
  // less.
  if (!over && !out.ended) {
    const double one_face = 1 - counts_by((sheets[1].weight + sheets[2].weight) / met.weight);
    out.trust = 1 - (1 - out.trust) * (1 - one_face * smooth_step(0.8, 1.4, met.firm));
  }
  return out;
}

/// The blend, and how far one in floats may be from it.
struct BoundedBlend {
  Blended expected;
  bool sure = true;  // rounding decides about nothing
  double depth_error = 0, normal_error = 0, trust_error = 0;
};

/// The blend's own roundings are those of its inputs over again: the answers with `others`, the
/// same fits rounded some other way, say how far they carry. Where these decide otherwise nothing
/// can be said.
inline BoundedBlend bounded_blend(const ParticleFits& fits, const std::vector<double>& trust,
                                  const std::vector<ParticleFits>& others, const View& view,
                                  double u, double v, double t0, const FitParams& fit,
                                  const BlendParams& params) {
  const Blended expected = blend(fits, trust, view, u, v, t0, fit, params);
  BoundedBlend bounded{expected};
  double depth_off = 0, normal_off = 0, trust_off = 0;
  for (const ParticleFits& other : others) {
    const Blended b = blend(other, trust, view, u, v, t0, fit, params);
    bounded.sure &= b.hits == expected.hits && b.on_edge == expected.on_edge &&
                    b.ended == expected.ended && b.passed == expected.passed &&
                    (b.trust > 0) == (expected.trust > 0);
    if (b.hits == 0 || expected.hits == 0) continue;
    depth_off = std::max(depth_off, std::abs(b.depth - expected.depth));
    normal_off = std::max(normal_off, length(b.normal - expected.normal));
    trust_off = std::max(trust_off, std::abs(b.trust - expected.trust));
  }
  // Sums round once a hit.
  const double sums = (static_cast<double>(expected.hits) + 16) * kEpsilon;
  bounded.depth_error = 4 * depth_off + sums * 20;
  bounded.normal_error = 4 * normal_off + 2 * sums * (1 + expected.cancelled);
  bounded.trust_error = 4 * trust_off + 2 * sums;
  bounded.sure &= expected.margin >= bounded.depth_error;
  return bounded;
}

}  // namespace meniscus::reference
