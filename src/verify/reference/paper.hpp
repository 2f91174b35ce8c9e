// The paper's Eqs. 2 to 7 in double precision, as paper.hpp and paper.cl say they are read.
#pragma once

#include <Eigen/Dense>
#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <vector>

#include "meniscus/parameters.hpp"
#include "stages/other_methods/merge_groups.hpp"
#include "stages/view.hpp"
#include "verify/reference/epsilon.hpp"
#include "verify/reference/fit.hpp"

namespace meniscus::reference {

/// SLIM's weight at the distance d in units of the support.
inline double slim_weight(double d) {
  return d <= 0.5 ? std::exp(-8 * d * d) : d < 1 ? 2.16536453 * std::pow(1 - d, 4) : 0;
}

/// What a height field h over a group's plane leaves of its normal equations (Eq. 2).
struct HeightResiduals {
  using Vector = Eigen::Matrix<double, 6, 1>;
  int terms = 6;  // 3: few points make a plane
  Vector solution, error, bound, size;
  double rms = 0, rms_bound = 0;  // of h - z at the points, particle radii
};

/// `coefficient` is that of the group's quadric, whose normal is the eye's z axis.
inline HeightResiduals height_residuals(const std::vector<Vec3d>& points, const Vec3d& centre,
                                        double radius, const std::array<float, 10>& c,
                                        const FitParams& params) {
  using Vector = HeightResiduals::Vector;
  const double R = 1.3 * radius, rows = static_cast<double>(points.size());
  HeightResiduals left;
  left.terms = points.size() < 8 ? 3 : 6;
  Vector& a = left.solution;
  a << -c[0] / R, -c[1], -c[2], -c[4] * R, -c[7] * R, -c[5] * R;
  Eigen::Matrix<double, 6, 6> A = A.Zero(), A_size = A.Zero();
  Vector b = b.Zero(), b_size = b.Zero();
  double total = 0, squares = 0;
  for (const Vec3d& p : points) {
    const Vec3d q = (p - centre) / R;
    const double w = slim_weight(length(q));
    Vector f;
    f << 1, q.x, q.y, q.x * q.x, q.x * q.y, q.y * q.y;
    A += w * f * f.transpose();
    A_size += w * f.cwiseAbs() * f.cwiseAbs().transpose();
    b += w * q.z * f;
    b_size += w * std::abs(q.z) * f.cwiseAbs();
    total += w;
    squares += w * std::pow(f.head(left.terms).dot(a.head(left.terms)) - q.z, 2);
  }
  for (int k = 1; k < 6; ++k) A(k, k) += total * (k < 3 ? 1e-6 : params.ridge);
  // As in residuals() of fit.hpp: sums of n rows of products of five factors, Cholesky's backward
  // error of 7 |L| |L'| for the factor and each substitution, and four roundings on the way back.
  const Vector pivots = A.diagonal().cwiseSqrt();
  left.error = A * a - b;
  left.size = A_size * a.cwiseAbs() + b_size;
  left.bound = kEpsilon * ((rows + 12) * left.size + 21 * pivots * pivots.dot(a.cwiseAbs()));
  left.rms = R * std::sqrt(squares / total);
  // h - z is off by some 12 epsilon of terms whose sizes add up to less than 6.
  left.rms_bound = R * 72 * kEpsilon;
  return left;
}

/// The paper's blend at a pixel.
struct PrintedBlend {
  double depth = 0;
  double error = 0;   // how far one in floats may be
  double margin = 1;  // by which the nearest of its choices was made: of a root's existence and of
                      // which of two it is, relative; of reaches and ranges, particle radii
};

/// Eqs. 6 and 7 at pixel (u, v): groups with quadrics `c` around their centres, of which `owner` is
/// that of the triangle there, whose depth is `reference`.
inline PrintedBlend blend_printed(const View& view, const Groups& groups,
                                  const std::vector<std::array<float, 10>>& c, int owner,
                                  double reference, double u, double v, double reach,
                                  double d_max) {
  PrintedBlend out;
  const auto decide = [&](double by) { out.margin = std::min(out.margin, std::abs(by)); };
  const Vec3d start = point_at(view, u, v, reference), ray = ray_direction(view, u, v);
  double sum = 0, weight = 0, root_error = 0;
  for (std::size_t k = 0; k < groups.size(); ++k) {
    const PixelPosition centre = project(view, groups.centre[k]);
    const double d = std::hypot((u - centre.u) * centre.w / view.u_scale,
                                (v - centre.v) * centre.w / view.v_scale);
    decide(d - groups.radius[k] - reach);
    if (d > groups.radius[k] + reach) continue;
    // f along the ray: C + B tau + A tau^2, from three of its values.
    const Vec3d x = start - groups.centre[k];
    const double C = value_at(c[k], x), B = dot(gradient_at(c[k], x), ray);
    const double A = value_at(c[k], x + ray) - B - C, D = B * B - 4 * A * C;
    decide(D / (B * B + std::abs(4 * A * C)));
    if (D < 0) continue;
    decide(B / std::sqrt(D));
    // The root nearest to the reference: the two have the product C / A.
    const double larger = -(B + std::copysign(std::sqrt(D), B)) / 2, tau = C / larger;
    decide(std::abs(tau) - d_max);
    if (!(std::abs(tau) <= d_max)) continue;
    const double like = std::max(0.0, dot(groups.normal[k], groups.normal[owner]));
    const double b = groups.radius[k] * (0.15 + 0.45 * std::pow(like, 4));
    const double beta =
        1 / (std::sqrt(2 * std::numbers::pi) * b * b) * std::exp(-d * d / (2 * b * b));
    sum += beta * tau;
    weight += beta;
    // A point's coordinate, below 64 radii, has six roundings; f's terms have eight of their own. B
    // errs as C does, times tau; the root's slope is sqrt(D). Both are good to first order where
    // the margin is wide.
    Basis size = basis(x).cwiseAbs();
    double terms = 0;
    for (int q = 0; q < 10; ++q) terms += std::abs(c[k][q]) * size[q];
    const Vec3d g = gradient_at(c[k], x);
    const double off =
        kEpsilon * (6 * 64 * (std::abs(g.x) + std::abs(g.y) + std::abs(g.z)) + 8 * terms);
    root_error = std::max(root_error, 2 * off * (1 + std::abs(tau)) / std::sqrt(D));
  }
  out.depth = weight > 0 ? reference + sum / weight : reference;
  // The weights' exponents, up to 87, carry 20 epsilon of themselves, but those that matter (within
  // 1e-7 of the largest) are at most 16: 320 epsilon of the roots' spread, at most 2 d_max; sums of
  // as many terms as groups; the reference is added.
  const double n = static_cast<double>(groups.size());
  out.error = root_error + kEpsilon * ((320 + n) * 2 * d_max + 2 * reference);
  return out;
}

}  // namespace meniscus::reference
