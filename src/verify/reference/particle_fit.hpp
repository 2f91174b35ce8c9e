// The fits around particles in double precision, from their equations (particle_fit.hpp,
// particle_fit.cl): the weights, the supports and what is measured of a fit.
#pragma once

#include <algorithm>
#include <cmath>
#include <vector>

#include "stages/fit/particle_fit.hpp"
#include "verify/reference/fit.hpp"

namespace meniscus::reference {

/// Wendland's function on [0, 1).
inline double wendland(double d) { return d < 1 ? std::pow(1 - d, 4) * (4 * d + 1) : 0; }

/// Neighbours weigh in a fit within this share of its support.
inline constexpr double kFitReach = 0.85;

/// What a neighbour weighs by its distance over the support: Epanechnikov's function.
inline double parabola(double d) { return std::max(0.0, 1 - d * d / (kFitReach * kFitReach)); }

/// The quadratic B-spline on [0, 1), which is in its place in trial fits.
inline double spline(double d) {
  const double y = 1.5 * d;
  return y < 0.5 ? 0.75 - y * y : y < 1.5 ? 0.5 * (1.5 - y) * (1.5 - y) : 0;
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

/// The surface as a pass finds it: the fits' normals where there are fits already.
struct Surroundings {
  std::vector<Vec3d> position, normal;  // [surface particles]
  std::vector<double> weight;           // [surface particles] u
  std::vector<double> residual;         // [surface particles] of the fits; negative: none
  std::vector<double> influence;        // [surface particles] Visible::influence of the fits
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
    all.influence[place[k]] = seen.influence_of(k);
  }
  return all;
}

/// rho = support min(1, max(least_support, (max(.14, 1.5 r_05) / r)^2)) of the fit around surface
/// particle i, with r the mean of the residuals within 6 radii with weights (1 - l / 6)
/// smoothstep(.8, .95, n_i.n_j) c_j, c the fit's influence, and r_05 the 5th percentile of all; the
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
                     smooth_step(0.8, 0.95, dot(all.normal[i], all.normal[j])) * all.influence[j];
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
  double agreement = 0;      // e before bevels and faces, as trial fits have it
  double slope = 1.5 / 0.3;  // how fast e and the firmness change with their shares there, at most
  double steepness = 0;      // and with the spread
  int neighbours = 0;        // within the support
  double margin = 1e9;       // how near one is to its end, particle radii
};

/// e = max(.005, smoothstep(.3, .9, share)) with the share of the particles elsewhere, u_j W(l / 4)
/// each, that agree, smoothstep(.72, .95, n_i.n_j), and .01 u_i that agrees; the firmness F,
/// max(.005, smoothstep(.7, 1, share)) with those that agree by smoothstep(.85, .95, n_i.n_j), and
/// u_i that agrees; the spread, the RMS of f, at most 2, under the common weights; the sum of u_j.
/// For n_i.n_j stands, by the roundness, the product of n_j and the quadric's unit gradient at j. A
/// bevel, (1 - smoothstep(.8, 1, share of F)) (1 - roundness) smoothstep(.4, .55, spread - 2
/// residual), leaves of e and F what it is not; a face has at least .2 (1 - roundness) (1 -
/// smoothstep(.1, .3, spread)) (1 - across) of both; all have at least .0005. A fit that lies
/// across an edge, across = (1 - roundness) smoothstep(.38, .55, residual / tau), keeps 1 - .9
/// across of e. `quadric` is that of the fit with its offset, `residual` the kernel's own, which
/// residual_of checks; `params` is that of round_params.
inline Measured measure(const Surroundings& all, std::size_t i, double rho,
                        const std::array<float, 10>& quadric, double residual,
                        const FitParams& params, double roundness = 0) {
  Measured found;
  double near = 0, agree = 0, firm = 0, weight = 0, squares = 0;
  for (std::size_t j = 0; j < all.position.size(); ++j) {
    const Vec3d x = all.position[j] - all.position[i];
    const double l = length(x), u = all.weight[j], same = dot(all.normal[i], all.normal[j]);
    found.margin = std::min(found.margin, std::abs(l - kFitReach * params.support));
    if (l >= kFitReach * params.support) continue;
    ++found.neighbours;
    const double f = std::clamp(value_at(quadric, x) + params.offset, -2.0, 2.0);
    const double w = u * parabola(l / rho) *
                     std::exp(-2 * (1 - same) / (params.normal_sigma * params.normal_sigma));
    weight += w;
    squares += w * f * f;
    found.supporters += u / (kFitReach * kFitReach);
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
  const double share = (own + firm) / (own + near);
  const double firmness = std::max(0.005, smooth_step(0.7, 1.0, share));
  found.spread = std::sqrt(squares / weight);
  const double bevel = (1 - smooth_step(0.8, 1.0, share)) * (1 - roundness) *
                       smooth_step(0.4, 0.55, found.spread - 2 * residual);
  const double across = (1 - roundness) * smooth_step(0.38, 0.55, residual / params.tau);
  const double face =
      0.2 * (1 - roundness) * (1 - smooth_step(0.1, 0.3, found.spread)) * (1 - across);
  const double least = std::max(0.0005, face);
  // A little beyond the ends, too, where floats may already be between them.
  const auto is_between = [](double x, double low, double high) {
    return x > low - 1e-3 && x < high + 1e-3;
  };
  if (is_between(found.spread - 2 * residual, 0.4, 0.55)) found.steepness += 1.5 / 0.15;
  if (found.spread - 2 * residual > 0.4 - 1e-3) found.slope += 1.5 / 0.2;
  if (is_between(found.spread, 0.1, 0.3)) found.steepness += 0.2 * 1.5 / 0.2;
  found.edge = std::max(least, found.agreement * (1 - bevel) * (1 - 0.9 * across));
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
/// 10 roundings; agreement is steep, 1.5 / 0.1 at most times n.n', good to 4 epsilon. Where bevels
/// and faces depend on it the spread is .1 at least.
inline double edge_error(const Measured& found, const FitParams& params) {
  return kEpsilon * (2 * found.neighbours + 20 + 60) * found.slope +
         found.steepness * spread_error(found, params) / (2 * std::max(found.spread, 0.1));
}

/// How firm a pass is with the normal of a fit.
struct Firm {
  double firmness = 0;   // F
  double error = 0;      // how far floats may be from it
  double sharp = 0;      // how many times more of 2 / sigma^2 a firm fit has
  double roundness = 0;  // of the fit
};

/// F = smoothstep(.7, 1, share) of surface particle i's surroundings within four radii, u_j W(l /
/// 4) (1 - (1 - roundness) smoothstep(0, 1, height of j over i's tangent plane)) each, that agrees,
/// smoothstep(.85, .95, n_i.n_j), and u_i that agrees; sigma is .29 narrower where F is 1.
/// `earlier` is the surface as the pass before the one that this is for found it.
inline Firm firm_of(const Surroundings& earlier, std::size_t i, const FitParams& of_sheets,
                    double roundness) {
  double near = 0, agree = 0;
  int neighbours = 0;
  for (std::size_t j = 0; j < earlier.position.size(); ++j) {
    const double l = length(earlier.position[j] - earlier.position[i]);
    if (j == i || l >= 4) continue;
    const double rise = dot(earlier.position[j] - earlier.position[i], earlier.normal[i]);
    const double q =
        earlier.weight[j] * wendland(l / 4) * (1 - (1 - roundness) * smooth_step(0, 1, rise));
    near += q;
    agree += q * smooth_step(0.85, 0.95, dot(earlier.normal[i], earlier.normal[j]));
    ++neighbours;
  }
  const double own = earlier.weight[i], share = (own + agree) / (own + near);
  // As edge_error says, and heights are good to 6 epsilon of a distance of 4, on which the weights'
  // slope is 1.5 at most; where smoothstep begins and ends its slope goes up by no more than 6 /
  // .3^2.
  const double error = kEpsilon * (2 * neighbours + 20 + 60 + 36);
  const double t = std::clamp((share - 0.7) / 0.3, 0.0, 1.0);
  const double slope = 6 * t * (1 - t) / 0.3 + 70 * error;
  const double narrower = of_sheets.normal_sigma / (of_sheets.normal_sigma - 0.29);
  return {smooth_step(0.7, 1.0, share), slope * error, narrower * narrower - 1, roundness};
}

/// What a neighbour weighs, and how far floats may be from it.
struct Weight {
  double value = 0, error = 0;
};

/// u B(l / rho) exp(-E), B the parabola or `near_by`, for the neighbour at `x` from a particle with
/// normal n_i; nothing where u B is below 1e-6 or n_i.n_j below -1/2. In the first pass E = 2 (1 -
/// n_i.n_j) / sigma^2 + h^2 / (.6 + .075 l^2)^2, the latter log(1e5) at most, h the neighbour's
/// height over the particle's tangent plane.
inline Weight first_weight(const Vec3d& x, const Vec3d& n_i, const Vec3d& n_j, double u, double rho,
                           const FitParams& params, double (*near_by)(double) = parabola) {
  const double near = u * near_by(length(x) / rho), same = dot(n_i, n_j);
  if (near < 1e-6 || same < -0.5) return {};
  const double falloff = 2 / (params.normal_sigma * params.normal_sigma);
  const double height = 0.6 + 0.075 * dot(x, x), h = dot(x, n_i) / height;
  const double value = near * std::exp(-falloff * (1 - same) - std::min(h * h, std::log(1e5)));
  // n.n' is good to 6 epsilon, h to as many of a distance of rho, the rest to 20.
  return {value, kEpsilon * value * (6 * falloff + 2 * std::abs(h) * 6 * rho / height + 20)};
}

/// The same in a later pass, where `quadric`, the fit of the pass before with its offset, lies r
/// behind the neighbour and has the unit gradient g there: with w = F (1 - roundness)
///   E = min(25, 2 / sigma^2 (1 + sharp w) (1 + 3 w p)
///               ((1 - w) (1 - n_i.n_j) + w max(0, .99 - g.n_j)) + r^2 / tau^2),
/// r^2 / tau^2 log(1e4) at most, and in front of the fit F / 2 times as far for r; p, up to 1, is
/// how far that is.
inline Weight later_weight(const Vec3d& x, const Vec3d& n_i, const Vec3d& n_j, double u, double rho,
                           const std::array<float, 10>& quadric, const Firm& firm,
                           const FitParams& params) {
  const double near = u * parabola(length(x) / rho), same = dot(n_i, n_j);
  if (near < 1e-6 || same < -0.5) return {};
  const double falloff = 2 / (params.normal_sigma * params.normal_sigma);
  const double along = std::min(1.0, dot(normalized(gradient_at(quadric, x)), n_j) + 0.01);
  const double f = value_at(quadric, x) + params.offset, ahead = std::clamp(f, 0.0, 1.0);
  const double w = firm.firmness * (1 - firm.roundness);
  const double sharp = 1 + firm.sharp * w, front = 1 + 3 * w * ahead, sharper = sharp * front;
  const double differs = std::max(0.0, (1 - w) * (1 - same) + w * (1 - along));
  const double r = std::max(-f, 0.5 * firm.firmness * f) / params.tau;
  const double value =
      near *
      std::exp(-std::min(25.0, falloff * sharper * differs + std::min(r * r, std::log(1e4))));
  // The products of normals are good to 6 and 12 epsilon, f to 10 epsilon of its terms, which add
  // up to 1.5 rho, the exponent and the rest to 20; F moves all terms.
  const double by_normals = falloff * sharper * ((1 - w) * 6 + w * 12);
  const double by_distance =
      (2 * r / params.tau + falloff * sharp * differs * 3 * w) * 15 * rho + 25;
  const double by_firmness = falloff * ((firm.sharp * front + 3 * ahead * sharp) * differs +
                                        sharper * std::abs(along - same)) +
                             r * std::max(f, 0.0) / params.tau;
  return {value, value * (kEpsilon * (by_normals + by_distance + 20) + firm.error * by_firmness)};
}

/// The problem that a pass solves for fit k of surface particle i, with the weights that the pass
/// before gives; `before` is empty in the first, in which neighbours weigh near_by(l / rho). Points
/// have their weights' errors for weights.
struct PassProblem {
  FitProblem problem;
  std::vector<double> weights;
};
inline PassProblem pass_problem(const Surroundings& all, const ParticleFits& before, std::size_t k,
                                std::size_t i, double rho, const FitParams& params,
                                const Firm& firm, double (*near_by)(double) = parabola) {
  PassProblem one{{all.position[i], rho, {}}, {}};
  for (std::size_t j = 0; j < all.position.size(); ++j) {
    const Vec3d x = all.position[j] - one.problem.centre;
    if (length(x) >= rho) continue;
    const Vec3d &n_i = all.normal[i], &n_j = all.normal[j];
    const Weight weight = before.size() == 0
                              ? first_weight(x, n_i, n_j, all.weight[j], rho, params, near_by)
                              : later_weight(x, n_i, n_j, all.weight[j], rho, before.quadric[k],
                                             firm, params);
    one.problem.points.push_back({all.position[j], n_j, weight.error});
    one.weights.push_back(weight.value);
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
/// their share of it.
inline double residual_error(const PassProblem& one, const std::array<float, 10>& quadric,
                             const FitParams& params) {
  double weight = 0, off = 0;
  for (std::size_t j = 0; j < one.weights.size(); ++j) {
    if (!(one.weights[j] > 0)) continue;
    const double f =
        value_at(quadric, one.problem.points[j].position - one.problem.centre) + params.offset;
    weight += one.weights[j] * robustness(-f, params.tau);
    off += one.problem.points[j].weight * f * f;
  }
  const double square = off / weight;
  const double root = residual_of(one, quadric, params);
  return 4 * 20 * kEpsilon * 2 * one.problem.scale + std::min(std::sqrt(square), square / root);
}

}  // namespace meniscus::reference
