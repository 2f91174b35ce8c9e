// The blend of the fits that one ray meets, in double precision: docs/method.md, "blend".
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <vector>

#include "meniscus/parameters.hpp"
#include "stages/particle_fit.hpp"
#include "stages/view.hpp"
#include "verify/reference/epsilon.hpp"
#include "verify/reference/fit.hpp"

namespace meniscus::reference {

inline double smooth_passage(double low, double high, double x) {
  const double t = std::clamp((x - low) / (high - low), 0.0, 1.0);
  return t * t * (3 - 2 * t);
}

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

/// Where a ray meets a fit. Its height is f where that is least along the ray, within `kGraze`.
inline constexpr double kGraze = 0.3;
struct Hit {
  std::size_t fit;
  double t, weight, height;
  double fade() const { return std::pow(1 - std::max(height, 0.0) / kGraze, 2); }
  Vec3d at, gradient;
};

/// Whether a fit counts at all: it has a residual, and is trusted by more than 0.01.
inline bool counts(const ParticleFits& fits, const std::vector<double>& trust, std::size_t k) {
  return fits.residual[k] >= 0 && trust[k] > 0.01;
}

/// Where the ray of pixel (u, v) enters fit k, t0 being its reference depth, or where it passes by
/// within kGraze; with a weight of 0 when that is nowhere, or too far from the reference, or from
/// the fit.
inline Hit meet(const ParticleFits& fits, const std::vector<double>& trust, std::size_t k,
                const View& view, double u, double v, double t0, const FitParams& fit,
                const BlendParams& params) {
  const Vec3d ray = ray_direction(view, u, v), start = point_at(view, u, v, t0);
  Hit hit{k, t0, 0, -kGraze, start, {}};
  // Roots of A tau^2 + B tau + C along the ray: from values at three points.
  Vec3d g;
  const double C = value(fits, k, start, &g), B = dot(g, ray);
  const double A = value(fits, k, start + ray, &g) - B - C;
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
  hit.t = t0 + tau;
  hit.at = start + ray * tau;
  value(fits, k, hit.at, &g);
  hit.gradient = g / length(g);
  const double facing = std::abs(dot(hit.gradient, ray));
  if (std::abs(tau) > (grazes ? 1 : 4) * params.d_max ||
      std::abs(tau) * std::min(2 * facing, 1.0) > params.d_max)
    return hit;
  hit.weight = nearness(hit.at - fits.foot[k], reach(fits, k, fit, params)) * fits.edge[k] *
               fits.visible[k] * trust[k] * hit.fade();
  return hit;
}

/// Whether normals are of one sheet, 0 .. 1.
inline double same_sheet(const Vec3d& a, const Vec3d& b, const BlendParams& params) {
  return smooth_passage(params.same_low, params.same_high, dot(a, b));
}

/// A fit at a point: f and its unit gradient, its own weight e u T, and what that is worth there.
struct FaceValue {
  std::size_t fit;
  double f;
  Vec3d gradient;
  double own, weight;
};

/// The fits that are steep to the ray or face away, at a point.
inline std::vector<FaceValue> steep_faces(const ParticleFits& fits,
                                          const std::vector<double>& trust, const Vec3d& ray,
                                          const Vec3d& at, const FitParams& fit,
                                          const BlendParams& params) {
  std::vector<FaceValue> faces;
  for (std::size_t k = 0; k < fits.size(); ++k) {
    if (!counts(fits, trust, k)) continue;
    Vec3d g;
    const double unscaled = value(fits, k, at, &g), f = unscaled / length(g);
    g = g / length(g);
    if (dot(g, ray) <= -0.5 * length(ray)) continue;
    const double own = fits.edge[k] * fits.surface[k] * trust[k];
    const double near = nearness(at - fits.foot[k], reach(fits, k, fit, params));
    faces.push_back({k, f, g, own, near * own * std::max(1 - f * f / 4, 0.0)});
  }
  return faces;
}

/// How high above the mean of the round fits of the shown sheet that are steep to the ray, or turn
/// away, and of those that the ray meets it passes; below 0 where it enters.
///
///   at       where the ray touches those that it meets
///   normal   of what is shown there
///   met      what they weigh
///   falling  their weights times how their values change along the ray
inline double height_over(const ParticleFits& fits, const std::vector<double>& trust,
                          const Vec3d& ray, const Vec3d& at, const Vec3d& normal, double met,
                          double falling, const FitParams& fit, const BlendParams& params) {
  double weight = met, level = 0, along = falling, bend = 0;
  for (const auto& [k, f, g, own, counted] : steep_faces(fits, trust, ray, at, fit, params)) {
    const double round = 0.9 * fits.roundness[k];
    const double w = counted * smooth_passage(0.45, 0.9, round) *
                     smooth_passage(params.same_low, params.same_high, dot(g, normal) + round);
    Vec3d unscaled, beyond;
    const double here = value(fits, k, at, &unscaled);
    const double square = value(fits, k, at + ray, &beyond) - here - dot(unscaled, ray);
    weight += w;
    level += w * f;
    along += w * dot(g, ray);
    bend += w * square / length(unscaled);
  }
  return (level - along * along / (4 * std::max(bend, 0.02 * weight))) / weight;
}

/// Sheet R: what faces away near a point of the surface, with another normal, may end it. R and
/// steep faces that meet the surface in a convex edge vouch for a point within them.
///
///   at     the point
///   shown  the middle of what is shown there
inline void end_at_hidden(const ParticleFits& fits, const std::vector<double>& trust,
                          const Vec3d& ray, const Vec3d& at, const Vec3d& shown,
                          const FitParams& fit, const BlendParams& params, Blended* out) {
  double weight = 0, level = 0, within = 0, beyond = 0;
  double strong = 0, outside = 0, strong_outside = 0;
  Vec3d centre, normal;
  for (const auto& [k, f, g, own, counted] : steep_faces(fits, trust, ray, at, fit, params)) {
    const double w = counted * (1 - same_sheet(g, out->normal, params));
    const Vec3d to = fits.foot[k] - shown;
    if (dot(to, out->normal) < 0 && dot(to, g) > 0) (f > 0 ? beyond : within) += w;
    if (dot(g, ray) <= 0) continue;
    weight += w;
    strong += w * own;
    if (f >= 0) outside += w;
    if (f >= 0) strong_outside += w * own;
    level += w * std::max(f, -0.05);  // of several faces the one that it lies outside of
    centre += w * fits.foot[k];
    normal += w * g;
  }
  // Bevels between hidden faces end nothing that these hold.
  if (weight > 1e-3 && level > 0 && strong_outside * weight > 0.05 * strong * outside) {
    const Vec3d to = centre / weight - shown;
    out->ended = dot(to, out->normal) < 0 && dot(to, normal) > 0;
  }
  out->on_edge |= within > (out->trust < 1 ? 1e-3 : 3e-4) && within > beyond;
}

/// A sheet's depth, the middle of its feet, and its normal.
struct Plane {
  double t;
  Vec3d centre, normal;
};

/// How far the nearer of two sheets that meet in a convex edge stays, because third faces hold it:
/// steep or hidden ones that meet the nearer sheet in a convex edge and the deeper in a concave
/// one.
///
///   at   where the ray meets the nearer sheet
///   all  what the fits weigh that it meets
inline double held_by(const ParticleFits& fits, const std::vector<double>& trust, const Vec3d& ray,
                      const Vec3d& at, const Plane& near, const Plane& deep, double all,
                      const FitParams& fit, const BlendParams& params) {
  double within = 0, beyond = 0;
  for (const auto& [k, f, g, own, counted] : steep_faces(fits, trust, ray, at, fit, params)) {
    const Vec3d to_near = fits.foot[k] - near.centre, to_deep = fits.foot[k] - deep.centre;
    const bool convex = dot(to_near, near.normal) < 0 && dot(to_near, g) > 0;
    const bool concave = dot(to_deep, deep.normal) > 0 && dot(to_deep, g) < 0;
    if (!convex || !concave) continue;
    const double same =
        std::max(same_sheet(g, near.normal, params), same_sheet(g, deep.normal, params));
    (f > 0 ? beyond : within) += counted * (1 - same);
  }
  return within > beyond ? smooth_passage(0.0003, 0.002, within / all) : 0;
}

/// The blend on the ray of pixel (u, v), whose reference depth is t0. Fits without residual or with
/// trust up to 0.01 do not count; those with v < 1/1000 are not met by the ray.
inline Blended blend(const ParticleFits& fits, const std::vector<double>& trust, const View& view,
                     double u, double v, double t0, const FitParams& fit,
                     const BlendParams& params) {
  const Vec3d ray = ray_direction(view, u, v), start = point_at(view, u, v, t0);
  std::vector<Hit> hits;
  for (std::size_t k = 0; k < fits.size(); ++k) {
    if (!counts(fits, trust, k) || fits.visible[k] < 1e-3) continue;
    const Hit hit = meet(fits, trust, k, view, u, v, t0, fit, params);
    if (hit.weight > 0) hits.push_back(hit);
  }
  Blended out;
  out.hits = hits.size();
  if (hits.empty()) return out;

  // Sheet A around the gradient that dominates. Round fits go on around bends.
  const auto belongs = [&](const Hit& hit, const Vec3d& to) {
    return smooth_passage(params.same_low, params.same_high,
                          dot(hit.gradient, to) + 0.9 * fits.roundness[hit.fit]);
  };
  Vec3d axis = std::max_element(hits.begin(), hits.end(), [](const Hit& a, const Hit& b) {
                 return a.weight < b.weight;
               })->gradient;
  for (int round = 0; round < 2; ++round) {
    Vec3d sum;
    for (const Hit& hit : hits) sum += hit.gradient * (hit.weight * belongs(hit, axis));
    if (length(sum) > 1e-15) axis = normalized(sum);
  }
  // Where what is not of A faces two ways, as far as it counts, it makes two sheets, B and C.
  const auto rest_of = [&](const Hit& hit) { return hit.weight * (1 - belongs(hit, axis)); };
  double weight_a = 0, weight_b = 0;
  Vec3d sum_b;
  for (const Hit& hit : hits) {
    weight_a += hit.weight * belongs(hit, axis);
    weight_b += rest_of(hit);
    sum_b += rest_of(hit) * hit.gradient;
  }
  const double third = weight_b > 0
                           ? (1 - smooth_passage(0.95, 0.98, length(sum_b) / weight_b)) *
                                 smooth_passage(0.003, 0.02, weight_b / (weight_a + weight_b))
                           : 0;
  Vec3d other = std::max_element(hits.begin(), hits.end(), [&](const Hit& a, const Hit& b) {
                  return rest_of(a) < rest_of(b);
                })->gradient;
  Vec3d sum;
  for (const Hit& hit : hits) sum += hit.gradient * (rest_of(hit) * belongs(hit, other));
  if (length(sum) > 1e-15) other = normalized(sum);
  struct Sheet {
    double weight = 0, t = 0;
    Vec3d centre, normal;  // normal: sum of the gradients
    Vec3d blended;         // ... with a share of the weights' gradients
    double cancelled = 0;
  } sheets[3];
  double untrusted = 0, firm = 0, all = 0, height = 0;
  for (int s = 0; s < 3; ++s) {
    Sheet& sheet = sheets[s];
    const auto part = [&](const Hit& hit) {
      if (s == 0) return hit.weight * belongs(hit, axis);
      const double c = third * (1 - belongs(hit, other));
      return rest_of(hit) * (s == 1 ? 1 - c : c);
    };
    for (const Hit& hit : hits) {
      sheet.weight += part(hit);
      sheet.t += part(hit) * hit.t;
      sheet.centre += part(hit) * fits.foot[hit.fit];
      sheet.normal += part(hit) * hit.gradient;
      untrusted += part(hit) / trust[hit.fit];
      firm += part(hit) / hit.fade() * fits.firmness[hit.fit] / fits.edge[hit.fit];
      all += part(hit);
      height += part(hit) * hit.height;
    }
    if (!(sheet.weight > 0)) continue;
    sheet.t /= sheet.weight;
    sheet.centre = sheet.centre / sheet.weight;
    sheet.blended = sheet.normal;
    for (const Hit& hit : hits) {
      const Vec3d from_foot = hit.at - fits.foot[hit.fit];
      const double r = reach(fits, hit.fit, fit, params), w = nearness(from_foot, r);
      if (!(w > 0)) continue;
      // Three quarters of it where the fit is not round, less than none of it where it is.
      const double counts = 2 * (0.75 + fits.roundness[hit.fit] * (-0.2 - 0.75));
      const Vec3d pull =
          half_gradient(from_foot, r) * (counts * part(hit) / w * dot(hit.gradient, ray));
      sheet.blended += pull * (sheet.t - hit.t);
      sheet.cancelled += length(pull) * (std::abs(sheet.t - t0) + std::abs(hit.t - t0));
    }
  }
  const Sheet &a = sheets[0], &b = sheets[1], &c = sheets[2];
  // How far each sheet's centre lies over the other's plane: convex where both lie behind.
  const auto side = [](const Sheet& p, const Sheet& q) {
    return dot(q.centre - p.centre, normalized(p.normal) - normalized(q.normal));
  };
  const auto near = [&](double p, double q) { return std::abs(p - q) <= params.crease; };
  // How far depth q takes the place of p.
  const auto takes = [&](double p, double q, bool convex, double some) {
    return near(p, q) && (convex ? q >= p : q <= p) ? some : 0;
  };
  const bool has_b = b.weight > 0, has_c = c.weight > 0;
  const double some_b = smooth_passage(0.003, 0.02, b.weight / all),
               some_c = smooth_passage(0.003, 0.02, c.weight / all);
  const bool ab = has_b && side(a, b) < 0, ac = has_c && side(a, c) < 0,
             bc = has_c && side(b, c) < 0;
  const auto of_b = [&](double depth, double beside) {
    return a.weight > 1e-9 * b.weight ? takes(depth, beside, ab, some_b) : 1;
  };
  double share_b = 0, share_c = 0;
  if (!has_c) {
    if (has_b) share_b = of_b(a.t, b.t);
  } else if (ab == bc && ab != ac) {  // A meets C, then B
    const double first = takes(a.t, c.t, ac, some_c);
    share_b = of_b(a.t + first * (c.t - a.t), b.t);
    share_c = first * (1 - share_b);
  } else if (ab == ac && ab != bc) {  // B meets C, then A
    const double first = takes(b.t, c.t, bc, some_c);
    const double both = of_b(a.t, b.t + first * (c.t - b.t));
    share_b = both * (1 - first);
    share_c = both * first;
  } else {  // A meets B, then C
    const double first = of_b(a.t, b.t);
    share_c = takes(a.t + first * (b.t - a.t), c.t, ac, some_c);
    share_b = first * (1 - share_c);
  }
  // A third face may hold the nearer of A and B, which the deeper would end.
  if (ab && near(a.t, b.t) && a.weight > 1e-9 * b.weight && some_b > 0 &&
      std::abs(a.t - b.t) > 0.1) {
    const auto plane_of = [](const Sheet& s) { return Plane{s.t, s.centre, normalized(s.normal)}; };
    const bool a_is_near = a.t < b.t;
    const Plane first = plane_of(a_is_near ? a : b), second = plane_of(a_is_near ? b : a);
    const double held =
        held_by(fits, trust, ray, start + ray * (first.t - t0), first, second, all, fit, params);
    const double unheld = a_is_near ? 0 : some_b * (1 - share_c);
    share_b += held * (unheld - share_b);
  }
  const std::array shares{1 - share_b - share_c, share_b, share_c};
  const auto tell_apart = [&](const Sheet& p, const Sheet& q) {
    if (!(std::min(p.weight, q.weight) > 0.003 * all)) return;
    out.margin = std::min({out.margin, std::abs(side(p, q)), std::abs(p.t - q.t),
                           std::abs(std::abs(p.t - q.t) - params.crease)});
  };
  if (has_b) tell_apart(a, b);
  if (has_c) {
    tell_apart(a, c);
    tell_apart(b, c);
  }
  out.depth = 0;
  Vec3d shown;  // the middle of what is shown
  for (int s = 0; s < 3; ++s) {
    if (!(shares[s] > 0)) continue;
    out.depth += shares[s] * sheets[s].t;
    out.normal += shares[s] * normalized(sheets[s].blended);
    shown += shares[s] * sheets[s].centre;
  }
  out.normal = normalized(out.normal);
  out.normal = facing(out.normal, ray);
  for (const Sheet& sheet : sheets)
    if (sheet.weight > 0)
      out.cancelled = std::max(out.cancelled, sheet.cancelled / length(sheet.blended));
  // Hardly more than the rim of a weight, or than bevels, is not trusted.
  out.trust = std::min(1.001 * all / untrusted, 1.0) * smooth_passage(0.002, 0.015, firm);
  Vec3d gradients;
  for (const Sheet& sheet : sheets) gradients += sheet.normal;
  const double mean_height =
      height_over(fits, trust, ray, start + ray * (out.depth - t0), out.normal, all,
                  dot(gradients, ray), fit, params);
  const bool over = height > 0.06 * all || mean_height > 0.06;
  out.passed = over && out.trust > 0.8;
  if (over && !out.passed) out.trust = 0;  // nothing is met
  out.on_edge = (ab && near(a.t, b.t) && b.weight > 0.03 * a.weight) ||
                (ac && near(a.t, c.t) && c.weight > 0.03 * a.weight);

  end_at_hidden(fits, trust, ray, start + ray * (out.depth - t0), shown, fit, params, &out);
  // Among many firm fits of one sheet the field, which has pits in gaps between particles, is asked
  // less.
  if (!over && !out.ended) {
    const double one_face = 1 - smooth_passage(0.003, 0.02, (b.weight + c.weight) / all);
    out.trust = 1 - (1 - out.trust) * (1 - one_face * smooth_passage(0.8, 1.4, firm));
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
