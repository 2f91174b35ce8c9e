// The blend of the fits that one ray meets, in double precision: docs/method.md, "blend".
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <vector>

#include "meniscus/parameters.hpp"
#include "stages/fit/particle_fit.hpp"
#include "stages/view.hpp"
#include "verify/reference/epsilon.hpp"
#include "verify/reference/fit.hpp"

namespace meniscus::reference {

/// Value and gradient of fit k's quadric at X, not scaled.
inline double value(const ParticleFits& fits, std::size_t k, const Vec3d& X, Vec3d* gradient) {
  const std::array<float, 10>& c = fits.quadric[k];
  const Vec3d d = X - fits.position[k];
  *gradient = gradient_at(c, d);
  return c[0] + c[1] * d.x + c[2] * d.y + c[3] * d.z + c[4] * d.x * d.x + c[5] * d.y * d.y +
         c[6] * d.z * d.z + c[7] * d.x * d.y + c[8] * d.y * d.z + c[9] * d.z * d.x;
}

/// Radius of a fit's weight.
inline double reach(const ParticleFits& fits, std::size_t k, const FitParams& fit,
                    const BlendParams& params) {
  return 0.84 * params.radius * std::max(0.7, fits.support[k] / fit.support);
}

/// The weight (1 - D²)³ with D the distance over the reach, and half its gradient in X.
inline double nearness(const Vec3d& from_foot, double reach) {
  const double d = std::min(length(from_foot) / reach, 1.0);
  return std::pow(1 - d * d, 3);
}
inline Vec3d half_gradient(const Vec3d& from_foot, double reach) {
  const double d = std::min(length(from_foot) / reach, 1.0);
  return from_foot * (-3 * std::pow(1 - d * d, 2) / (reach * reach));
}

/// A unit normal turned until its product with the ray's direction is -.01: what is seen faces the
/// eye.
inline Vec3d facing(const Vec3d& normal, const Vec3d& ray) {
  const Vec3d along = normalized(ray);
  const double back = dot(normal, along) + 0.01;
  return back > 0 ? normalized(normal - back * along) : normal;
}

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

/// Whether a fit counts at all: it has a residual, and is trusted by more than 0.01.
inline bool counts(const ParticleFits& fits, const std::vector<double>& trust, std::size_t k) {
  return fits.residual[k] >= 0 && trust[k] > 0.01;
}

/// A ray among fits.
struct FitsOnRay {
  const ParticleFits& fits;
  const std::vector<double>& trust;  // [fits]
  const FitParams& fit;
  const BlendParams& params;
  Vec3d direction, start;  // start: the point at the reference depth
  double t0;               // the reference depth

  Vec3d at(double t) const { return start + direction * (t - t0); }
  bool counts(std::size_t k) const { return reference::counts(fits, trust, k); }
  double reach_of(std::size_t k) const { return reach(fits, k, fit, params); }
  /// Whether gradients with this product are of one sheet, 0 .. 1.
  double same_sheet(double product) const {
    return smooth_step(params.same_low, params.same_high, product);
  }
};

/// The ray of pixel (u, v), whose reference depth is t0.
inline FitsOnRay fits_on_ray(const ParticleFits& fits, const std::vector<double>& trust,
                             const View& view, double u, double v, double t0, const FitParams& fit,
                             const BlendParams& params) {
  return {fits, trust, fit, params, ray_direction(view, u, v), point_at(view, u, v, t0), t0};
}

/// Where a ray meets a fit. Its height is f where that is least along the ray, within `kGraze`.
inline constexpr double kGraze = 0.3;
struct Hit {
  std::size_t fit;
  double t, weight, height;
  double fade() const { return std::pow(1 - std::max(height, 0.0) / kGraze, 2); }
  Vec3d at, gradient;
};

/// Where the ray enters fit k, or where it passes by within kGraze; with a weight of 0 when that is
/// nowhere, or too far from the reference, or from the fit.
inline Hit meet(const FitsOnRay& ray, std::size_t k) {
  const ParticleFits& fits = ray.fits;
  Hit hit{k, ray.t0, 0, -kGraze, ray.start, {}};
  // Roots of A tau^2 + B tau + C along the ray: from values at three points.
  Vec3d g;
  const double C = value(fits, k, ray.start, &g), B = dot(g, ray.direction);
  const double A = value(fits, k, ray.start + ray.direction, &g) - B - C;
  const double D = B * B - 4 * A * C;
  if (A > 0) hit.height = std::max(-D / (4 * A), -kGraze);
  const bool grazes = hit.height > 0 && hit.height < kGraze;
  if (D < 0 && !grazes) return hit;
  // f falls where the ray enters: B + 2 A tau = -sqrt(D).
  double tau;
  if (grazes)
    tau = -B / (2 * A);
  else if (B < 0)
    tau = 2 * C / (std::sqrt(D) - B);
  else if (std::abs(A) > 1e-12)
    tau = -(B + std::sqrt(D)) / (2 * A);
  else
    return hit;
  hit.t = ray.t0 + tau;
  hit.at = ray.start + ray.direction * tau;
  value(fits, k, hit.at, &g);
  hit.gradient = g / length(g);
  const double facing = std::abs(dot(hit.gradient, ray.direction)), d_max = ray.params.d_max;
  if (std::abs(tau) > (grazes ? 1 : 4) * d_max || std::abs(tau) * std::min(2 * facing, 1.0) > d_max)
    return hit;
  hit.weight = nearness(hit.at - fits.foot[k], ray.reach_of(k)) * fits.edge[k] * fits.visible[k] *
               ray.trust[k] * hit.fade();
  return hit;
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

/// How far a second or third sheet counts that weighs this share of all that a ray meets.
inline double counts_by(double share) { return smooth_step(0.003, 0.02, share); }

/// How far a hit is of the sheet around a gradient. Round fits go on around bends.
inline double belongs(const FitsOnRay& ray, const Hit& hit, const Vec3d& gradient) {
  return ray.same_sheet(dot(hit.gradient, gradient) + 0.9 * ray.fits.roundness[hit.fit]);
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
  for (const Hit& hit : hits) sum += hit.gradient * (weight(hit) * belongs(ray, hit, gradient));
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

  const auto rest = [&](const Hit& hit) { return hit.weight * (1 - belongs(ray, hit, split.a)); };
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
  const double a = belongs(ray, hit, split.a);
  const double c = split.third * (1 - belongs(ray, hit, split.b));
  return {hit.weight * a, hit.weight * (1 - a) * (1 - c), hit.weight * (1 - a) * c};
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
inline bool is_near(double p, double q, const BlendParams& params) {
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
    return is_near(p, q, params) && (convex ? q >= p : q <= p) ? some : 0;
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

/// A fit at a point: f and its unit gradient, its own weight e u T, and what that is worth there.
struct FaceValue {
  std::size_t fit;
  double f;
  Vec3d gradient;
  double own, weight;
};

/// The fits that are steep to the ray or face away, at a point.
inline std::vector<FaceValue> steep_faces(const FitsOnRay& ray, const Vec3d& at) {
  const ParticleFits& fits = ray.fits;
  std::vector<FaceValue> faces;
  for (std::size_t k = 0; k < fits.size(); ++k) {
    if (!ray.counts(k)) continue;
    Vec3d g;
    const double unscaled = value(fits, k, at, &g), f = unscaled / length(g);
    g = g / length(g);
    if (dot(g, ray.direction) <= -0.5 * length(ray.direction)) continue;
    const double own = fits.edge[k] * fits.surface[k] * ray.trust[k];
    const double near = nearness(at - fits.foot[k], ray.reach_of(k));
    faces.push_back({k, f, g, own, near * own * std::max(1 - f * f / 4, 0.0)});
  }
  return faces;
}

/// How far the nearer of two sheets that meet in a convex edge stays, because third faces hold it:
/// steep or hidden ones that meet the nearer sheet in a convex edge and the deeper in a concave
/// one. `all` is what the fits weigh that the ray meets.
inline double held_by(const FitsOnRay& ray, const Sheet& near, const Sheet& deep, double all) {
  double within = 0, beyond = 0;
  for (const auto& [k, f, g, own, counted] : steep_faces(ray, ray.at(near.t))) {
    const Vec3d to_near = ray.fits.foot[k] - near.centre, to_deep = ray.fits.foot[k] - deep.centre;
    const bool convex = dot(to_near, near.normal()) < 0 && dot(to_near, g) > 0;
    const bool concave = dot(to_deep, deep.normal()) > 0 && dot(to_deep, g) < 0;
    if (!convex || !concave) continue;
    const double same =
        std::max(ray.same_sheet(dot(g, near.normal())), ray.same_sheet(dot(g, deep.normal())));
    (f > 0 ? beyond : within) += counted * (1 - same);
  }
  return within > beyond ? smooth_step(0.0003, 0.002, within / all) : 0;
}

/// A third face may hold the nearer of A and B, which the deeper would end.
inline void hold_nearer(const FitsOnRay& ray, const ThreeSheets& sheets, const Meeting& meeting,
                        double all, Shares* shares) {
  const auto& [a, b, c] = sheets;
  if (!meeting.ab || !is_near(a.t, b.t, ray.params) || !has_a(a, b) || !(meeting.some_b > 0) ||
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

/// How high above the mean of the round fits of the shown sheet that are steep to the ray, or turn
/// away, and of those that the ray meets (whose values are 0), it passes; below 0 where it enters.
inline double height_over(const FitsOnRay& ray, const ThreeSheets& sheets, double all,
                          const Blended& shown) {
  const Vec3d at = ray.at(shown.depth);
  double weight = all, level = 0, along = 0, bend = 0;
  for (const Sheet& sheet : sheets) along += dot(sheet.gradients, ray.direction);
  for (const auto& [k, f, g, own, counted] : steep_faces(ray, at)) {
    const double round = 0.9 * ray.fits.roundness[k];
    const double w =
        counted * smooth_step(0.45, 0.9, round) * ray.same_sheet(dot(g, shown.normal) + round);
    Vec3d unscaled, beyond;
    const double here = value(ray.fits, k, at, &unscaled);
    const double square =
        value(ray.fits, k, at + ray.direction, &beyond) - here - dot(unscaled, ray.direction);
    weight += w;
    level += w * f;
    along += w * dot(g, ray.direction);
    bend += w * square / length(unscaled);
  }
  return (level - along * along / (4 * std::max(bend, 0.02 * weight))) / weight;
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
  return (meeting.ab && is_near(a.t, b.t, params) && b.weight > 0.03 * a.weight) ||
         (meeting.ac && is_near(a.t, c.t, params) && c.weight > 0.03 * a.weight);
}

/// Sheet R: what faces away near the point that is shown, with another normal, may end it. R and
/// steep faces that meet the surface in a convex edge vouch for a point within them. `middle` is
/// that of what is shown.
inline void end_at_hidden(const FitsOnRay& ray, const Vec3d& middle, Blended* out) {
  double weight = 0, level = 0, within = 0, beyond = 0;
  double strong = 0, outside = 0, strong_outside = 0;
  Vec3d centre, normal;
  for (const auto& [k, f, g, own, counted] : steep_faces(ray, ray.at(out->depth))) {
    const double w = counted * (1 - ray.same_sheet(dot(g, out->normal)));
    const Vec3d to = ray.fits.foot[k] - middle;
    if (dot(to, out->normal) < 0 && dot(to, g) > 0) (f > 0 ? beyond : within) += w;
    if (dot(g, ray.direction) <= 0) continue;
    weight += w;
    strong += w * own;
    if (f >= 0) outside += w;
    if (f >= 0) strong_outside += w * own;
    level += w * std::max(f, -0.05);  // of several faces the one that it lies outside of
    centre += w * ray.fits.foot[k];
    normal += w * g;
  }
  // Bevels between hidden faces end nothing that these hold.
  if (weight > 1e-3 && level > 0 && strong_outside * weight > 0.05 * strong * outside) {
    const Vec3d to = centre / weight - middle;
    out->ended = dot(to, out->normal) < 0 && dot(to, normal) > 0;
  }
  out->on_edge |= within > (out->trust < 1 ? 1e-3 : 3e-4) && within > beyond;
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
