// Faces that a ray does not meet, or far away, in double precision: docs/method.md, "Hidden faces";
// the kernels' part is hidden.cl.
#pragma once

#include <algorithm>
#include <cmath>
#include <vector>

#include "verify/reference/creases.hpp"

namespace meniscus::reference {

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
    // Of several faces the one that it lies outside of; of round ones by more.
    level += w * (std::max(f, -0.05) - 0.2 * 0.9 * ray.fits.roundness[k]);
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

}  // namespace meniscus::reference
