// The fits around particles in double precision, from their equations (particle_fit.hpp,
// particle_fit.cl): the weights, the supports and what is measured of a fit.
#pragma once

#include <algorithm>
#include <cmath>
#include <vector>

#include "stages/particle_fit.hpp"
#include "verify/reference/fit.hpp"

namespace meniscus::reference {

/// Wendland's function on [0, 1).
inline double wendland(double d) { return d < 1 ? std::pow(1 - d, 4) * (4 * d + 1) : 0; }

/// The quadratic B-spline on [0, 1).
inline double spline(double d) {
  const double y = 1.5 * d;
  return y < 0.5 ? 0.75 - y * y : y < 1.5 ? 0.5 * (1.5 - y) * (1.5 - y) : 0;
}

/// u_j B(l / rho) exp(-2 (1 - n_i.n_j) / sigma^2): what all passes weigh a neighbour at `x` from
/// the particle with; nothing where u B is below 1e-6 or n_i.n_j below -1/2.
inline double common_weight(const Vec3d& x, const Vec3d& n_i, const Vec3d& n_j, double u,
                            double rho, double sigma) {
  const double near = u * spline(length(x) / rho), same = dot(n_i, n_j);
  return near < 1e-6 || same < -0.5 ? 0 : near * std::exp(-2 * (1 - same) / (sigma * sigma));
}

/// The parameters of a fit of that roundness: sigma and tau go from FitParams' to 1.2 and .6, the
/// off-surface distance and the ridge to 1.25 and 5e-5.
inline FitParams round_params(FitParams params, double roundness) {
  params.normal_sigma += roundness * (1.2 - params.normal_sigma);
  params.tau += roundness * (std::max(0.6, params.tau) - params.tau);
  params.off_surface += roundness * (std::min(1.25, params.off_surface) - params.off_surface);
  params.ridge += roundness * (std::min(5e-5, params.ridge) - params.ridge);
  return params;
}

/// exp(-h^2 / (.6 + .075 l^2)^2), at least 1e-5: the first pass's share for a neighbour at height
/// h.
inline double flatness(const Vec3d& x, const Vec3d& n_i) {
  return std::max(std::exp(-std::pow(dot(x, n_i) / (0.6 + 0.075 * dot(x, x)), 2)), 1e-5);
}

/// The surface as a pass finds it: the fits' normals where there are fits already.
struct Surroundings {
  std::vector<Vec3d> position, normal;  // [surface particles]
  std::vector<double> weight;           // [surface particles] u
  std::vector<double> residual;         // [surface particles] of the fits; negative: none
  std::vector<double> tells;            // [surface particles] Visible::tells of the fits
};

/// `place` is each fit's place among the surface particles.
inline Surroundings surroundings(const Projected& projected, const Visible& seen,
                                 const SurfaceParticles& around, const ParticleFits& fits,
                                 const std::vector<std::int32_t>& place) {
  const std::size_t n = around.index.size();
  Surroundings all{
      {}, around.normal, around.weight, std::vector<double>(n, -1), std::vector<double>(n)};
  for (const std::int32_t i : around.index)
    all.position.push_back(projected.eye(static_cast<std::size_t>(i)));
  for (std::size_t k = 0; k < fits.size(); ++k) {
    all.normal[place[k]] = fits.normal[k];
    all.residual[place[k]] = fits.residual[k];
    all.tells[place[k]] = seen.telling(k);
  }
  return all;
}

/// rho = support min(1, max(least_support, (max(.14, 1.5 r_05) / r)^2)) of the fit around surface
/// particle i, with r the mean of the residuals within 6 radii with weights (1 - l / 6)
/// smoothstep(.8, .95, n_i.n_j) c_j, c what the fit tells, and r_05 the 5th percentile of all; the
/// full support where there is nothing to average.
struct Narrowed {
  double support = 0;
  double error = 0;  // how far floats may be from it
};
inline Narrowed narrowed_support(const Surroundings& all, std::size_t i, const FitParams& params) {
  std::vector<double> sorted, near;
  double sum = 0, weight = 0;
  for (std::size_t j = 0; j < all.position.size(); ++j) {
    if (!(all.residual[j] > 0)) continue;
    sorted.push_back(all.residual[j]);
    const double w = std::max(0.0, 1 - length(all.position[j] - all.position[i]) / 6) *
                     smooth_step(0.8, 0.95, dot(all.normal[i], all.normal[j])) * all.tells[j];
    sum += w * all.residual[j];
    weight += w;
    if (length(all.position[j] - all.position[i]) < 6.001) near.push_back(all.residual[j]);
  }
  if (!(weight > 0)) return {params.support, 0};
  std::sort(sorted.begin(), sorted.end());
  const double noise = std::max(0.14, 1.5 * sorted[sorted.size() / 20]);
  const double share = std::pow(noise / (sum / weight), 2);
  const double support = params.support * std::min(1.0, std::max(params.least_support, share));
  // n.n' is good to four epsilon, which smoothstep's slope of 10 passes on to a weight, and l to as
  // many; the sums round once a fit. The support goes with the mean's square.
  double off = 0;
  for (const double r : near) off += 50 * std::abs(r - sum / weight);
  // The residuals are those that the passes go by, which measure_edges takes once more: f is good
  // to 20 epsilon of its terms, which add up to 1.5 rho, and so are both means and r_05.
  const double doubt = 20 * 1.5 * params.support * (1 / (sum / weight) + 1.5 / noise);
  const double error = kEpsilon * (off / sum + static_cast<double>(near.size()) + 4 + doubt);
  return {support, 2 * error * support};
}

/// What measure_edges finds of a fit.
struct Measured {
  double edge = 0, firmness = 0, spread = 0, supporters = 0;
  double agreement = 0;  // e before bevels and faces, as trial fits have it
  double steepness = 0;  // how fast e and the firmness change with the spread there, at most
  int neighbours = 0;    // within the support
  double margin = 1e9;   // how near one is to its end, particle radii
};

/// e = max(.005, smoothstep(.3, .9, share)) with the share of the particles elsewhere, u_j W(l / 4)
/// each, that agree, smoothstep(.72, .95, n_i.n_j), and .01 u_i that agrees; the firmness F,
/// max(.005, smoothstep(.7, 1, share)) with those that agree by smoothstep(.85, .95, n_i.n_j), and
/// u_i that agrees; the spread, the RMS of f, at most 2, under the common weights; the sum of u_j.
/// For n_i.n_j stands, by the roundness, the product of n_j and the quadric's unit gradient at j. A
/// bevel, (1 - F) (1 - roundness) smoothstep(.4, .55, spread - 2 residual), leaves of e and F what
/// it is not; a face has at least .2 (1 - roundness) (1 - smoothstep(.1, .3, spread)) of both; all
/// have at least .0005. `quadric` is that of the fit with its offset, `residual` the
/// kernel's own, which residual_of checks; `params` is that of round_params.
inline Measured measure(const Surroundings& all, std::size_t i, double rho,
                        const std::array<float, 10>& quadric, double residual,
                        const FitParams& params, double roundness = 0) {
  Measured found;
  double near = 0, agree = 0, firm = 0, weight = 0, squares = 0;
  for (std::size_t j = 0; j < all.position.size(); ++j) {
    const Vec3d x = all.position[j] - all.position[i];
    const double l = length(x), u = all.weight[j], same = dot(all.normal[i], all.normal[j]);
    found.margin = std::min(found.margin, std::abs(l - params.support));
    if (l >= params.support) continue;
    ++found.neighbours;
    const double f = std::clamp(value_at(quadric, x) + params.offset, -2.0, 2.0);
    const double w = u * spline(l / rho) *
                     std::exp(-2 * (1 - same) / (params.normal_sigma * params.normal_sigma));
    weight += w;
    squares += w * f * f;
    found.supporters += u;
    if (l == 0) continue;
    const double q = u * wendland(l / 4);
    const Vec3d gradient = normalized(gradient_at(quadric, x));
    const double agrees = same + roundness * (dot(gradient, all.normal[j]) - same);
    near += q;
    agree += q * smooth_step(0.72, 0.95, agrees);
    firm += q * smooth_step(0.85, 0.95, agrees);
  }
  const double own = all.weight[i];
  found.agreement =
      std::max(0.005, smooth_step(0.3, 0.9, (0.01 * own + agree) / (0.01 * own + near)));
  const double firmness = std::max(0.005, smooth_step(0.7, 1.0, (own + firm) / (own + near)));
  found.spread = std::sqrt(squares / weight);
  const double bevel =
      (1 - firmness) * (1 - roundness) * smooth_step(0.4, 0.55, found.spread - 2 * residual);
  const double face = 0.2 * (1 - roundness) * (1 - smooth_step(0.1, 0.3, found.spread));
  const double least = std::max(0.0005, face);
  // A little beyond the ends, too, where floats may already be between them.
  const auto is_between = [](double x, double low, double high) {
    return x > low - 1e-3 && x < high + 1e-3;
  };
  if (is_between(found.spread - 2 * residual, 0.4, 0.55)) found.steepness += 1.5 / 0.15;
  if (is_between(found.spread, 0.1, 0.3)) found.steepness += 0.2 * 1.5 / 0.2;
  found.edge = std::max(least, found.agreement * (1 - bevel));
  found.firmness = std::max(least, firmness * (1 - bevel));
  return found;
}

/// How far floats may be from the mean of squares that makes the spread: f is good to 20 epsilon of
/// its terms, which add up to 1.5 rho; the weights, as in weight_error without its last factor,
/// move a mean of squares below 4.
inline double spread_error(const Measured& found, const FitParams& params) {
  const double f = 20 * kEpsilon * 1.5 * params.support;
  return 4 * kEpsilon * (2 * found.neighbours + 12 / 0.25 + 20) + 2 * 2 * f;
}

/// How far they may be from e and the firmness. The shares are quotients of sums of n terms of some
/// 10 roundings; agreement is steep, 1.5 / 0.1 at most times n.n', good to 4 epsilon. smoothstep's
/// slope is 1.5 / 0.3 at most. Where bevels and faces depend on it the spread is .1 at least.
inline double edge_error(const Measured& found, const FitParams& params) {
  return kEpsilon * (2 * found.neighbours + 20 + 60) * 1.5 / 0.3 +
         found.steepness * spread_error(found, params) / (2 * std::max(found.spread, 0.1));
}

/// Weights have factors of at most 1 each. Their errors: n.n' by 6 epsilon times 2 / sigma^2; and
/// 20 epsilon for all but the last factor. That is exp(-x^2), whose slope is 0.86 at most, with x =
/// h / 0.6 in the first pass, h good to 6 epsilon of a distance of rho; and later f / tau, f good
/// to 10 epsilon of its terms, which add up to 1.5 rho.
inline double weight_error(const FitParams& params, int pass) {
  const double x = pass == 1 ? 6 * params.support / 0.6 : 15 * params.support / params.tau;
  return kEpsilon * (12 / (params.normal_sigma * params.normal_sigma) + 0.86 * x + 20);
}

/// The problem that pass `pass` solves for fit k of surface particle i, with the weights that the
/// pass before gives; `before` is empty in the first.
struct PassProblem {
  FitProblem problem;
  std::vector<double> weights;
};
inline PassProblem pass_problem(const Surroundings& all, const ParticleFits& before, std::size_t k,
                                std::size_t i, double rho, const FitParams& params, int pass) {
  PassProblem one{{all.position[i], rho, {}}, {}};
  for (std::size_t j = 0; j < all.position.size(); ++j) {
    const Vec3d x = all.position[j] - one.problem.centre;
    if (length(x) >= rho) continue;
    // A full weight of 1, so that weight_error is in units of it.
    one.problem.points.push_back({all.position[j], all.normal[j], 1});
    const double w =
        common_weight(x, all.normal[i], all.normal[j], all.weight[j], rho, params.normal_sigma);
    one.weights.push_back(
        w * (pass == 1 ? flatness(x, all.normal[i])
                       : robustness(-value_at(before.quadric[k], x) - params.offset, params.tau)));
  }
  return one;
}

/// The RMS of a fit's f at its neighbours under the weights of its last pass, and one-sided ones.
/// `quadric` is that of the fit with its offset.
inline double residual_of(const PassProblem& one, const std::array<float, 10>& quadric,
                          const FitParams& params) {
  double squares = 0, weight = 0;
  for (std::size_t j = 0; j < one.weights.size(); ++j) {
    const double f =
        value_at(quadric, one.problem.points[j].position - one.problem.centre) + params.offset;
    const double w = one.weights[j] * robustness(-f, params.tau);
    squares += w * f * f;
    weight += w;
  }
  return std::sqrt(squares / weight);
}

/// How far floats may be from residual_of: f is off by some 20 epsilon of terms that add up to 2
/// rho at most; so is a root mean square of it, and the weights' slope, at most 0.86 / tau, moves
/// it by no more than that times |f| near tau; and weights that are off move the mean of squares by
/// their share times the largest.
inline double residual_error(const PassProblem& one, const std::array<float, 10>& quadric,
                             const FitParams& params, int pass) {
  double weight = 0, largest = 0;
  for (std::size_t j = 0; j < one.weights.size(); ++j) {
    if (!(one.weights[j] > 0)) continue;
    const double f =
        value_at(quadric, one.problem.points[j].position - one.problem.centre) + params.offset;
    weight += one.weights[j] * robustness(-f, params.tau);
    largest = std::max(largest, f * f);
  }
  const double square =
      static_cast<double>(one.weights.size()) * weight_error(params, pass) / weight * largest;
  const double root = residual_of(one, quadric, params);
  return 4 * 20 * kEpsilon * 2 * one.problem.scale + std::min(std::sqrt(square), square / root);
}

}  // namespace meniscus::reference
