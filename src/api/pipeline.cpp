// The way into the methods; each is a table of contents of its own in methods/.
#include "api/pipeline.hpp"

#include "device/stage_clock.hpp"
#include "methods/methods.hpp"
#include "stages/extras/motion.hpp"

namespace meniscus {
namespace {

RunMethod* function_of(Method method) {
  switch (method) {
    case Method::paper:
      return run_paper;
    case Method::ssm:
      return run_ssm;
    case Method::spheres:
      return run_spheres;
    case Method::bilateral:
      return run_bilateral;
    case Method::narrow_range:
      return run_narrow_range;
    case Method::curvature_flow:
      return run_curvature_flow;
    case Method::anisotropic:
      return run_anisotropic;
    case Method::groups:
      return run_groups;
    case Method::stable:
      return run_stable;
    default:
      return run_fit;
  }
}

}  // namespace

Extraction run_pipeline(Device& device, const View& given, const WorldParticles& particles,
                        const Parameters& params, std::vector<StageTime>* timings) {
  Extraction made = function_of(params.method)(device, given, particles, params, timings);
  made.view = coarser(given, made.disorder.unit());
  const bool moves = particles.moving && ((params.image && params.aovs.velocity) || params.mesh);
  if (!moves && (particles.attributes.empty() || !(params.image || params.mesh))) return made;
  StageClock clock(device, timings);
  clock.start("motion");
  carry_values(device, made.view, project_particles(made.view, particles, kMotionMargin), particles,
               params, made);
  clock.stop();
  return made;
}

}  // namespace meniscus
