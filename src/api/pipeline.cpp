// The way into the methods; each is a table of contents of its own in methods/.
#include "api/pipeline.hpp"

#include "device/stage_clock.hpp"
#include "methods/methods.hpp"
#include "stages/motion.hpp"

namespace meniscus {
namespace {

Extraction run_method(Device& device, const View& view, const WorldParticles& particles,
                      const Parameters& params, std::vector<StageTime>* timings) {
  switch (params.method) {
    case Method::paper:
      return run_paper(device, view, particles, params, timings);
    case Method::ssm:
      return run_ssm(device, view, particles, params, timings);
    case Method::spheres:
      return run_spheres(device, view, particles, params, timings);
    case Method::bilateral:
      return run_bilateral(device, view, particles, params, timings);
    case Method::narrow_range:
      return run_narrow_range(device, view, particles, params, timings);
    case Method::curvature_flow:
      return run_curvature_flow(device, view, particles, params, timings);
    case Method::anisotropic:
      return run_anisotropic(device, view, particles, params, timings);
    case Method::groups:
      return run_groups(device, view, particles, params, timings);
    case Method::stable:
      return run_stable(device, view, particles, params, timings);
    default:
      return run_fit(device, view, particles, params, timings);
  }
}

}  // namespace

Extraction run_pipeline(Device& device, const View& view, const WorldParticles& particles,
                        const Parameters& params, std::vector<StageTime>* timings) {
  Extraction made = run_method(device, view, particles, params, timings);
  const bool moves = particles.moving && ((params.image && params.aovs.velocity) || params.mesh);
  if (!moves && (particles.attributes.empty() || !(params.image || params.mesh))) return made;
  StageClock clock(device, timings);
  clock.start("motion");
  carry_values(device, view, project_particles(device, view, particles, kMotionMargin), particles,
               params, made);
  clock.stop();
  return made;
}

}  // namespace meniscus
