// fit_particles: every pass against the pass before; measure_edges; find_noise.
#include "stages/fit/particle_fit.hpp"

#include <utility>

#include "verify/reference/particle_fit.hpp"
#include "verify/stage_cases/cases.hpp"
#include "verify/stage_cases/mesh_by_hand.hpp"
#include "verify/stage_cases/roundness.hpp"
#include "verify/stage_cases/worst.hpp"

namespace meniscus::verify {
namespace {

ParticleFits fit(Device& device, const FittedSurface& scene, const FitParams& params) {
  return fit_particles(device, scene.projected, scene.seen, scene.around, params);
}

// `before` and `earlier` are the fits of the last two passes.
void see_pass(const FittedSurface& scene, const ParticleFits& earlier, const ParticleFits& before,
              const ParticleFits& after, const FitParams& params, Worst& equation,
              Worst& residual) {
  const reference::Surroundings all = scene.surroundings(before);
  const reference::Surroundings passed = scene.surroundings(earlier);
  for (std::size_t k = 0; k < after.size(); ++k) {
    const std::size_t i = static_cast<std::size_t>(scene.place[k]);
    const auto one = reference::pass_problem(all, before, k, i, after.support[k], params,
                                             reference::firm_of(passed, i, params, 0));
    const auto left =
        reference::residuals(one.problem, after.quadric[k], params.offset, one.weights, params, 1);
    for (int q = 0; q < 10; ++q) equation.see(left.error[q], 0, left.bound[q], left.size[q]);
    residual.see(after.residual[k], reference::residual_of(one, after.quadric[k], params),
                 reference::residual_error(one, after.quadric[k], params), one.problem.scale);
  }
}

// The narrow and the wide trial fits, whose neighbours weigh by the B-spline.
void see_trials(Device& device, const FittedSurface& scene, Worst& equation) {
  const reference::Surroundings all = scene.surroundings({});
  for (const bool wide : {false, true}) {
    const std::vector<reference::TrialFit> trial = trial_fits(device, scene, wide);
    const FitParams params = reference::round_params({}, wide ? 1 : 0);
    for (std::size_t k = 0; k < trial.size(); ++k) {
      const auto one = reference::pass_problem(all, {}, k, static_cast<std::size_t>(scene.place[k]),
                                               kTrialReach, params, {}, reference::spline);
      const auto left =
          reference::residuals(one.problem, trial[k].quadric, 0, one.weights, params, 1);
      for (int q = 0; q < 10; ++q) equation.see(left.error[q], 0, left.bound[q], left.size[q]);
    }
  }
}

void see_edges(const FittedSurface& scene, const ParticleFits& fits, const FitParams& params,
               Worst& edge, Worst& firmness, Worst& supporters) {
  const reference::Surroundings all = scene.surroundings(fits);
  for (std::size_t k = 0; k < fits.size(); ++k) {
    const auto expected =
        reference::measure(all, static_cast<std::size_t>(scene.place[k]), fits.support[k],
                           fits.quadric[k], fits.residual[k], params);
    if (expected.margin < 1e-5) continue;  // a neighbour more or less
    const double bound = reference::edge_error(expected, params);
    edge.see(fits.edge[k], expected.edge, bound, 1);
    firmness.see(fits.firmness[k], expected.firmness, bound, 1);
    supporters.see(fits.supporters[k], expected.supporters,
                   expected.supporters * expected.neighbours * kEpsilon);
  }
}

// A surface whose particles lie up to `noise` off, particle radii.
FittedSurface rough_surface(int size, double noise, double (*surface)(double, double)) {
  Random random(11);
  return fitted_surface(
      field(size, 6, [&](double u, double v) { return surface(u, v) + random(-noise, noise); }));
}

// Of rough particles, whose noise is more than what counts without any.
void see_supports(Device& device, int size, Worst& support) {
  const FittedSurface scene = rough_surface(size, 0.5, hills);
  const FitParams params;
  FitParams full = params;
  full.least_support = 1;
  --full.passes;
  const reference::Surroundings all = scene.surroundings(fit(device, scene, full));
  const ParticleFits fits = fit(device, scene, params);
  for (std::size_t k = 0; k < fits.size(); ++k) {
    const auto [expected, error] =
        reference::narrowed_support(all, static_cast<std::size_t>(scene.place[k]), params);
    support.see(fits.support[k], expected, error + 4 * kEpsilon * expected, expected);
  }
}

}  // namespace

ReferenceErrors particle_fit_case(Device& device, int size) {
  Worst equation("fit_particles", "normal equations"), residual("measure_edges", "residual"),
      edge("measure_edges", "edge"), firmness("measure_edges", "firmness"),
      supporters("measure_edges", "supporters"), support("fit_particles", "support"),
      trial("fit_particles", "trial fits");
  for (const auto& surface : {hills, roof}) {
    Projected particles = field(size, 2, surface);
    // Two that lie all but on each other.
    particles.x[1] = particles.x[0] + 0.02f;
    particles.y[1] = particles.y[0];
    particles.z[1] = particles.z[0];
    particles.u[1] = particles.u[0] + 0.02f;
    particles.v[1] = particles.v[0];
    const FittedSurface scene = fitted_surface(particles);
    FitParams params;
    params.least_support = 1;
    ParticleFits earlier, before;
    for (params.passes = 1; params.passes <= 3; ++params.passes) {
      const ParticleFits after = fit(device, scene, params);
      see_pass(scene, earlier, before, after, params, equation, residual);
      earlier = std::exchange(before, after);
    }
    see_edges(scene, before, params, edge, firmness, supporters);
    see_trials(device, scene, trial);
  }
  // Fits along an edge that their own particles lie off.
  const FittedSurface rough = rough_surface(size, 0.3, roof);
  see_edges(rough, fit(device, rough, {}), {}, edge, firmness, supporters);
  see_supports(device, size, support);
  return {equation.error(),   residual.error(), edge.error(), firmness.error(),
          supporters.error(), support.error(),  trial.error()};
}

}  // namespace meniscus::verify
