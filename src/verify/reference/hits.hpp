// Where a ray meets a fit, and with what weight, in double precision: docs/method.md, "Blend"; the
// kernels' part is hits.cl. What tile_lists.cl finds is not needed: loops go through all fits.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <vector>

#include "meniscus/parameters.hpp"
#include "stages/fit/particle_fit.hpp"
#include "stages/view.hpp"
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

}  // namespace meniscus::reference
