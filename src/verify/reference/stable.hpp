// Method stable in double precision, from its equations: the region and the blend.
#pragma once

#include <algorithm>
#include <cmath>
#include <optional>
#include <vector>

#include "stages/other_methods/stable.hpp"
#include "verify/reference/particle_fit.hpp"

namespace meniscus::reference {

/// A sample's nearest triangle and its owner.
struct Owned {
  double depth = kNoSurface;
  std::int32_t owner = -1;
  double margin = 1e9;  // how near a decision was, in barycentric coordinates
};

/// The kept triangle over a screen position, the depth linear in 1/t (perspective) or t; its owner
/// is the corner with the largest barycentric coordinate times edge factor.
inline Owned owned_at(const View& view, const Triangulation& mesh, const ParticleFits& fits,
                      double u, double v) {
  Owned found;
  for (std::size_t t = 0; t < mesh.triangle.size(); ++t) {
    if (mesh.kind[t] != TriangleKind::kept) continue;
    const auto& corner = mesh.triangle[t];
    const ScreenPoint &a = mesh.screen[corner[0]], &b = mesh.screen[corner[1]],
                      &c = mesh.screen[corner[2]];
    const double area = (b.u - a.u) * (c.v - a.v) - (c.u - a.u) * (b.v - a.v);
    double l[3];
    l[1] = ((u - a.u) * (c.v - a.v) - (c.u - a.u) * (v - a.v)) / area;
    l[2] = ((b.u - a.u) * (v - a.v) - (u - a.u) * (b.v - a.v)) / area;
    l[0] = 1 - l[1] - l[2];
    const double least = std::min({l[0], l[1], l[2]});
    found.margin = std::min(found.margin, std::abs(least));
    if (least < 0) continue;
    double depth = 0, q[3];
    for (int k = 0; k < 3; ++k) {
      const double at = -mesh.position[corner[k]].z;
      depth += l[k] * (view.orthographic ? at : 1 / at);
      q[k] = l[k] * fits.edge[corner[k]];
    }
    found.depth = view.orthographic ? depth : 1 / depth;
    const int best = static_cast<int>(std::max_element(q, q + 3) - q);
    found.owner = corner[best];
    for (int k = 0; k < 3; ++k)
      if (k != best) found.margin = std::min(found.margin, q[best] - q[k]);
  }
  return found;
}

/// The blend at one sample.
struct Blend {
  double depth = kNoSurface;
  Vec3d normal;
  double margin = 1e9;  // how near a decision was: weights, depths and heights
};

/// Where a ray enters a fit, tau behind the reference.
struct StableHit {
  double tau, w;
  Vec3d gradient, foot, from_foot;
};

/// The ray of direction d through `start`, the point at the reference depth, meets fit k where
/// |tau| <= 4 d_max and |tau| min(1, 2 |grad f . d|) <= d_max.
inline std::optional<StableHit> stable_hit(const ParticleFits& fits, std::size_t k,
                                           const Vec3d& start, const Vec3d& d,
                                           const BlendParams& params) {
  const auto& c = fits.quadric[k];
  const auto slope = [&](const Vec3d& x) {
    return Vec3d{c[1] + 2 * c[4] * x.x + c[7] * x.y + c[9] * x.z,
                 c[2] + 2 * c[5] * x.y + c[7] * x.x + c[8] * x.z,
                 c[3] + 2 * c[6] * x.z + c[8] * x.y + c[9] * x.x};
  };
  const Vec3d x = start - fits.position[k], linear{c[1], c[2], c[3]};
  const double C = c[0] + 0.5 * dot(slope(x) + linear, x);
  const double B = dot(slope(x), d), A = 0.5 * dot(slope(d) - linear, d);
  const double D = B * B - 4 * A * C;
  if (D < 0) return std::nullopt;
  // The smaller root where A > 0, the larger where A < 0: there f falls.
  const double tau = B < 0 ? 2 * C / (std::sqrt(D) - B) : -(B + std::sqrt(D)) / (2 * A);
  const Vec3d gradient = normalized(slope(x + d * tau));
  if (!(std::abs(tau) <= 4 * params.d_max)) return std::nullopt;
  if (!(std::abs(tau) * std::min(1.0, 2 * std::abs(dot(gradient, d))) <= params.d_max))
    return std::nullopt;
  const Vec3d q = start + d * tau - fits.foot[k];
  const double w = wendland(length(q) / params.radius) * fits.edge[k] * fits.visible[k];
  if (!(w > 0)) return std::nullopt;
  return StableHit{tau, w, gradient, fits.foot[k], q};
}

/// Sums over the hits of one sheet.
struct StableSheet {
  double w = 0, tau = 0;
  Vec3d foot, gradient, pull, pull_tau;
  void add(const StableHit& hit, double share, const Vec3d& ray, double radius) {
    const double a = hit.w * share, D = length(hit.from_foot) / radius;
    // dW/dD = -20 D (1 - D)^3; half of grad w times grad f . d
    const Vec3d half = hit.from_foot * (-10 / (radius * radius) / ((1 - D) * (4 * D + 1)) * a *
                                        dot(hit.gradient, ray));
    w += a;
    tau += a * hit.tau;
    foot += hit.foot * a;
    gradient += hit.gradient * a;
    pull += half;
    pull_tau += half * hit.tau;
  }
  Vec3d normal() const { return normalized(gradient + pull * (tau / w) - pull_tau); }
};

/// Blends the fits that the ray of (u, v) meets: n_A is the gradient of the heaviest hit after two
/// rounds of mean shift; sheet A has the weights w sigma, sheet B the rest.
inline Blend blend_at(const View& view, const ParticleFits& fits, double u, double v,
                      double reference, const BlendParams& params) {
  const Vec3d d = ray_direction(view, u, v), start = point_at(view, u, v, reference);
  std::vector<StableHit> hits;
  for (std::size_t k = 0; k < fits.size(); ++k)
    if (!(fits.residual[k] < 0))
      if (const auto hit = stable_hit(fits, k, start, d, params)) hits.push_back(*hit);
  Blend out;
  if (hits.empty()) return out;
  std::sort(hits.begin(), hits.end(),
            [](const StableHit& a, const StableHit& b) { return a.w > b.w; });
  if (hits.size() > 1) out.margin = hits[0].w / hits[1].w - 1;
  Vec3d n = hits[0].gradient;
  const auto sigma = [&](const StableHit& hit) {
    return smooth_step(params.same_low, params.same_high, dot(hit.gradient, n));
  };
  for (int round = 0; round < 2; ++round) {
    Vec3d mean;
    for (const StableHit& hit : hits) mean += hit.gradient * (hit.w * sigma(hit));
    n = normalized(mean, n);
  }
  StableSheet a, b;
  for (const StableHit& hit : hits) {
    const double same = sigma(hit);
    a.add(hit, same, d, params.radius);
    if (same < 1) b.add(hit, 1 - same, d, params.radius);
  }
  out.depth = reference + a.tau / a.w;
  out.normal = a.normal();
  if (!(b.w > 0)) return out;
  const double za = a.tau / a.w, zb = b.tau / b.w;
  const Vec3d apart = b.foot / b.w - a.foot / a.w;
  const double h = dot(apart, n) - dot(apart, normalized(b.gradient));
  const double share = smooth_step(0.03, 0.15, b.w / (a.w + b.w));
  if (share > 0)
    out.margin = std::min(
        {out.margin, std::abs(h), std::abs(za - zb), std::abs(std::abs(za - zb) - params.crease)});
  const bool takes_b = std::abs(za - zb) <= params.crease && (h < 0 ? zb > za : zb < za);
  if (takes_b) {
    out.depth += share * (zb - za);
    out.normal = normalized(a.normal() * (1 - share) + b.normal() * share);
  }
  return out;
}

}  // namespace meniscus::reference
