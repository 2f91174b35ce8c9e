// What a sample shows, in double precision: docs/method.md, "Settle".
#pragma once

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <optional>
#include <vector>

#include "verify/reference/density.hpp"

namespace meniscus::reference {

inline constexpr double kNowhere = std::numeric_limits<double>::infinity();

/// A particle's share is divided by a level that runs from `level` where the density is that of a
/// lone particle to 0.45 inside the fluid; it is multiplied by `lone` for a lone particle, and for
/// others by .3 and the rest as their own share `own` is of the density, but not by less than 1.
inline double level_weight(double density, double own, double level, double lone) {
  const double raised = std::max(0.3 + (lone - 0.3) * std::min(own / density, 1.0), 1.0);
  return raised * level / (level + (0.45 - level) * smooth_step(0.45, 0.45 + 1 / 2.25, density));
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

/// The field on one ray, of the particles that reach it, and how far floats may be off there.
struct FieldOnRay {
  FieldOnRay(const Field& all, const View& seen, double at_u, double at_v)
      : view(seen), u(at_u), v(at_v), direction(ray_direction(seen, at_u, at_v)) {
    speed = length(direction);
    const Vec3d origin = at(0);
    for (std::size_t i = 0; i < all.particles.size(); ++i) {
      const Vec3d apart = all.particles.eye(i) - origin;
      const double along = dot(apart, direction) / (speed * speed);
      if (length(apart - direction * along) >= 4.001) continue;
      add_position(field.particles, {all.particles.x[i], all.particles.y[i], all.particles.z[i]});
      field.weight.push_back(all.weight[i]);
    }
  }

  Vec3d at(double t) const { return point_at(view, u, v, t); }
  double levelled(double t) const { return field(at(t)); }
  double density(double t) const { return reference::density(field.particles, at(t)); }
  double near(double t) const { return near_count(field.particles, at(t)); }

  /// How far the point at depth t may be off. Across the ray: coefficients, two products and two
  /// sums each for origin and direction, then a product and a sum. Along it: its length, the
  /// particle's depth in lengths, and their sum.
  double moved(double t) const {
    double sum = 0;
    for (int axis = 0; axis < 2; ++axis) {
      const double* o = &view.ray[3 * axis];
      const double* d = &view.ray[6 + 3 * axis];
      sum += std::abs(o[0]) + std::abs(o[1] * u) + std::abs(o[2] * v) +
             t * (std::abs(d[0]) + std::abs(d[1] * u) + std::abs(d[2] * v));
    }
    return kEpsilon * (7 * sum + 6 * t * speed);
  }

  /// Of a density or, whose weights round once more, of the levelled field. What the point is off
  /// each share passes on by its slope, .52 / pi a radius at most.
  double error(double t) const {
    const double there = near(t);
    return density_error(field.particles, at(t), density(t)) +
           (kEpsilon + 0.52 * moved(t)) * there / std::numbers::pi;
  }

  /// The most that the slope can change by over a radius: 3 / (4 pi) a particle.
  double bend(double t) const { return 0.75 / std::numbers::pi * near(t); }

  View view;
  double u, v, speed;
  Vec3d direction;
  Field field;
};

/// A stretch of a ray in which the field reaches the level.
struct Chord {
  double enter = kNowhere, leave = kNowhere;  // depths
};

/// The chords of a ray between the depths `from` and `to`, found by steps of 1/64 radius and
/// bisected; shorter ones may be missed. One that is entered before `from` starts there.
inline std::vector<Chord> chords(const FieldOnRay& ray, double from, double to, double level) {
  const auto inside = [&](double t) { return ray.levelled(t) >= level; };
  const double step = 1 / (64 * ray.speed);
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

/// Where a ray first crosses the level, and how far floats may be from it.
struct Crossing {
  bool sure = true;
  double depth = kNowhere, error = 0;
  Vec3d normal;  // outward
  double normal_error = 0;
};

/// The outward normal of the field at depth t, and its error where floats take it there: the
/// gradient's, and how the field bends across its normal over the `off` that t may be off. Third
/// derivatives are below .6 a particle.
inline Crossing normal_at(const FieldOnRay& ray, double t, double off = 0) {
  const Vec3d x = ray.at(t), g = ray.field.gradient(x);
  Crossing c;
  c.depth = t;
  c.normal = normalized(-g);
  constexpr double kStep = 1e-4;
  Vec3d bent =
      (ray.field.gradient(ray.at(t + kStep)) - ray.field.gradient(ray.at(t - kStep))) / (2 * kStep);
  bent += c.normal * -dot(bent, c.normal);
  const double along = off * ray.speed;
  const double gradient_off = 1.75 * gradient_error(ray.field.particles, x) +
                              ray.bend(t) * ray.moved(t) + off * length(bent) +
                              0.6 * ray.near(t) * along * (along + kStep);
  c.normal_error = 2 * gradient_off / length(g) + 4 * kEpsilon;
  return c;
}

/// The first crossing between the depths `from` and `to` (docs/method.md, "Settle"): steps of
/// 1.5 (1 - C / level), .3 to 1, until one ends inside; the crossing before its end is found to
/// 1/1024 radii. A field that is reached at `from` is not crossed. Not sure where rounding or a
/// step decides:
///   - the field at `from`, or a top of it before the crossing, is within rounding of the level;
///   - a step may pass over the whole chord, or end beyond `to`;
///   - the ray meets the level at so small an angle that 1/2048 radii by the slope may be more.
inline Crossing first_crossing(const FieldOnRay& ray, double from, double to, double level) {
  Crossing none, unsure;
  unsure.sure = false;
  if (!(from <= to) || ray.field.particles.size() == 0) return none;
  // Between samples 1/64 apart a top rises by half of bend / 128^2 at most: below a thousandth for
  // thirty particles in reach.
  const auto blunt = [&](double t) {
    return std::max(1e-3, 4e-5 * ray.near(t)) + 4 * ray.error(t);
  };
  const double start_off = ray.levelled(from) - level;
  if (std::abs(start_off) <= blunt(from)) return unsure;
  if (start_off > 0) return none;
  double slack = 0;
  const double step = 1 / (8 * ray.speed);
  for (double t = from; t < to + step; t += step) slack = std::max(slack, blunt(std::min(t, to)));
  // Whatever comes near the level may be a chord.
  const std::vector<Chord> likely = chords(ray, from, to, level - slack);
  if (likely.empty()) return none;
  const std::vector<Chord> all = chords(ray, from, to, level);
  if (all.empty()) return unsure;
  const double enter = all[0].enter;
  // From there on the field has to rise.
  double before = level - slack;
  for (double t = likely[0].enter; t < enter; t += step / 8) {
    if (ray.levelled(t) < before) return unsure;
    before = ray.levelled(t);
  }
  // The longest step that may end before the chord begins and after it ends.
  const double width = (all[0].leave - enter) * ray.speed;
  for (double back = 0; back <= 1; back += 1.0 / 256) {
    const double below = 1 - (ray.levelled(enter - back / ray.speed) - slack) / level;
    // One sample of this search more, which the march may start between.
    if (std::clamp(1.5 * below, 0.3, 1.0) - back + 1.0 / 256 > width) return unsure;
  }
  const double slope = dot(ray.field.gradient(ray.at(enter)), ray.direction) / ray.speed;
  if (slope < ray.bend(enter) / 256) return unsure;
  const double off =
      1.0 / 1024 / ray.speed + 2 * ray.error(enter) / (slope * ray.speed) + 2 * kEpsilon * enter;
  Crossing c = normal_at(ray, enter, off);
  c.error = off;
  return c;
}

/// The largest value, up to the level, that the steps of first_crossing find where nothing is
/// crossed.
inline double most_on_steps(const FieldOnRay& ray, double from, double to, double level) {
  double most = 0;
  for (double t = from; t <= to && most < level;) {
    const double c = ray.levelled(t);
    most = std::max(most, std::min(c, level));
    t += std::clamp(1.5 * (1 - c / level), 0.3, 1.0) / ray.speed;
  }
  return most;
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
inline double agreement(double apart, double alike, double disorder) {
  return (1 - smooth_step(0.5 + 0.5 * disorder, 1 + disorder, apart)) *
         smooth_step(0.6 - 0.6 * disorder, 0.92 - 0.32 * disorder, alike);
}

/// How far a blend with this trust is compared with the field: wholly from a mark of .01 on.
inline double compared_at(double trust) {
  const double mark = std::clamp(100 * (1 - trust), 0.0, 1.0);
  return mark * mark;
}

/// A sample of a layer before it is settled.
struct LayerSample {
  double triangle = kNowhere;   // depth of the kept triangles
  double reference = kNowhere;  // of the visible particles' footprints
  double last = kNowhere;       // the reference of the look before, which found nothing
  double depth = kNowhere;      // of the blend
  double trust = 0;             // 0 .. 1
  bool on_edge = false;         // a convex one
  bool ended = false;           // beyond an edge to a face that is turned away, or passed
  bool passed = false;          // over the surface
  Vec3d normal;                 // of the blend
};

/// What it shows.
struct Shown {
  enum What { as_before, nothing, field, mixture };
  bool sure = true;
  What what = as_before;  // nothing: what lies behind its reference is asked for
  bool passed = false;    // the reference is 4 radii behind the blend now
  double depth = 0, depth_error = 0;
  Vec3d normal;
  double normal_error = 0;
  bool kind_sure = true, splash = false;  // splash: the field has more than half of the say
};

/// A unit normal that does not face the ray, n.d > -.01 |d|, is turned until it just does; errors
/// grow by twice what is left of its length.
inline void face_eye(const Vec3d& direction, Vec3d* normal, double* error) {
  const double size = length(direction);
  const double along = dot(*normal, direction), most = -0.01 * size;
  if (along <= most - size * *error) return;
  const Vec3d turned = *normal - direction * ((along - most) / (size * size));
  *error *= 1 + 2 / length(turned);
  if (along > most) *normal = normalized(turned);
}

/// Where rounding decides, and where a sample shows nothing.
inline Shown unsure() {
  Shown shown;
  shown.sure = false;
  return shown;
}
inline Shown shows_nothing(bool passed = false) {
  Shown shown;
  shown.what = Shown::nothing;
  shown.passed = passed;
  return shown;
}

/// What decides, besides the sample and the field.
struct SettleLimits {
  double contour, level;  // of the density, of the levelled field
  double disorder;        // of the particles
  double beyond;          // how far behind blend and reference the field is followed
};

/// A blend that is trusted stays on a triangle that is at most 3 radii away or where the density
/// reaches the contour; beyond an edge it stays on a triangle alone. Nothing: the field is asked.
inline std::optional<Shown> shown_without_field(const FieldOnRay& ray, const LayerSample& s,
                                                double contour) {
  if (!(s.depth < kNowhere) || !(s.ended || s.trust >= 1)) return std::nullopt;
  // A difference and the constant round.
  const double away = std::abs(s.depth - s.triangle) - 3;
  if (std::abs(away) <= 4 * kEpsilon * s.depth) return unsure();
  const bool vouched = away < 0;
  const Shown nothing = shows_nothing(s.passed && !vouched);
  if (s.ended && !vouched) return nothing;
  if (s.trust < 1) return std::nullopt;
  if (vouched) return Shown{};
  const double needed = (s.on_edge ? 0.3 : 1) * contour, density = ray.density(s.depth);
  if (std::abs(density - needed) <= ray.error(s.depth)) return unsure();
  return density < needed ? nothing : Shown{};
}

/// A number's bounds.
struct Bounds {
  double low = 0, high = 0;
};

/// Of the blend's share by the density there.
inline Bounds share_by_density(const FieldOnRay& ray, const LayerSample& s, double contour) {
  if (!(s.depth < kNowhere)) return {};
  const double density = ray.density(s.depth), off = ray.error(s.depth);
  const auto share_at = [&](double c) {
    return blend_share(s.trust, false, s.on_edge, c, contour);
  };
  return {share_at(density - off) * (1 - 8 * kEpsilon),
          share_at(density + off) * (1 + 8 * kEpsilon)};
}

/// Where the field is not crossed the blend stays as far as the field comes near its level, up to
/// `most`; on convex edges the larger share decides.
inline Shown shown_near_field(const LayerSample& s, const Bounds& share, double most,
                              double level) {
  // Steps that begin a little elsewhere find another value, by less than a hundredth of the level.
  const double missing = 1 - most / level;
  const auto stays = [&](double share, double lacks) {
    return s.on_edge ? share > 0.5 : (1 - share) * lacks < 0.1 * share;
  };
  if (stays(share.low, missing + 0.01) != stays(share.high, std::max(missing - 0.01, 0.0)))
    return unsure();
  return stays(share.low, missing) ? Shown{} : shows_nothing();
}

inline Shown shown_of_field(const Crossing& c) {
  Shown shown;
  shown.what = Shown::field;
  shown.depth = c.depth;
  shown.depth_error = c.error;
  shown.normal = c.normal;
  shown.normal_error = c.normal_error;
  shown.splash = true;
  return shown;
}

/// The share times how far blend and field agree, but on convex edges.
inline Bounds share_by_agreement(const FieldOnRay& ray, const LayerSample& s, const Crossing& c,
                                 const Bounds& share, double disorder) {
  if (s.on_edge) return share;
  const double facing = std::abs(dot(s.normal, ray.direction));
  const double apart = std::abs(c.depth - s.depth) * facing, alike = dot(s.normal, c.normal);
  const double moved = (c.error + 4 * kEpsilon * s.depth) * facing;
  const double turned = c.normal_error + 4 * kEpsilon;
  const auto keeps = [&](double apart, double alike) {
    return 1 - compared_at(s.trust) * (1 - agreement(apart, alike, disorder));
  };
  // Its four factors' roundings, of numbers up to 3.
  return {share.low * std::max(0.0, keeps(apart + moved, alike - turned) - 32 * kEpsilon),
          share.high * (keeps(apart - moved, alike + turned) + 32 * kEpsilon)};
}

/// The mixture of a blend with this share and the field.
inline Shown mixture_of(const LayerSample& s, const Crossing& c, const Bounds& bounds) {
  const double share = (bounds.low + bounds.high) / 2, off = (bounds.high - bounds.low) / 2;
  const Vec3d mixed = s.normal * share + c.normal * (1 - share);
  Shown shown;
  shown.what = Shown::mixture;
  shown.depth = share * s.depth + (1 - share) * c.depth;
  // The crossing's error counts by the rest; the share's by the difference of what is mixed.
  shown.depth_error =
      (1 - share) * c.error + off * std::abs(c.depth - s.depth) + 4 * kEpsilon * s.depth;
  shown.normal = normalized(mixed);
  shown.normal_error =
      2 * ((1 - share) * c.normal_error + off * length(s.normal - c.normal)) / length(mixed) +
      8 * kEpsilon;
  shown.kind_sure = bounds.low > 0.5 || bounds.high <= 0.5;
  shown.splash = share <= 0.5;
  return shown;
}

/// docs/method.md, "Settle", and 2.4.1. Where fits are not trusted, or there is no blend, the field
/// is followed from 2 radii before the blend or the reference, whichever is nearer, to `beyond`
/// behind the farther of both, and both are mixed. A sample that looks again follows it from
/// `beyond` behind its last reference. With `only_gaps` nothing but samples without a blend change.
inline Shown settled(const FieldOnRay& ray, const LayerSample& s, const SettleLimits& limits,
                     bool only_gaps) {
  const bool met = s.depth < kNowhere;
  if (!(s.reference < kNowhere) || (only_gaps && met)) return {};
  if (const auto shown = shown_without_field(ray, s, limits.contour)) return *shown;

  const double from =
      std::max(std::min(std::min(s.depth, s.reference) - 2, s.last + limits.beyond), 1e-3);
  const double to = (met ? std::max(s.depth, s.reference) : s.reference) + limits.beyond;
  const Crossing c = first_crossing(ray, from, to, limits.level);
  if (!c.sure) return unsure();
  const Bounds share = share_by_density(ray, s, limits.contour);
  if (!(c.depth < kNowhere))
    return shown_near_field(s, share, most_on_steps(ray, from, to, limits.level), limits.level);
  Shown shown = share.high > 0
                    ? mixture_of(s, c, share_by_agreement(ray, s, c, share, limits.disorder))
                    : shown_of_field(c);
  face_eye(ray.direction, &shown.normal, &shown.normal_error);
  return shown;
}

}  // namespace meniscus::reference
