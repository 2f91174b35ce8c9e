// The way into the methods; each is a table of contents of its own in methods/.
#include "pipeline.hpp"

#include "methods/methods.hpp"
#include "stage_clock.hpp"
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
  const bool on_image = params.image && params.aovs.velocity;
  if (!particles.moving || !(on_image || params.mesh)) return made;
  StageClock clock(device, timings);
  clock.start("motion");
  const MovingParticles moving = upload_moving(
      device, project_particles(device, view, particles, kMotionMargin), particles.velocity);
  if (on_image)
    made.velocity = motion_of_samples(device, view, moving, made.image.grid,
                                      download(device, made.image.depth));
  if (params.mesh) {
    std::vector<Vec3d> vertices;
    for (const Vec3& world : made.mesh.position)
      vertices.push_back(eye_from_world(view, Vec3d(world)));
    made.mesh.velocity = motion_of_points(device, moving, vertices);
  }
  clock.stop();
  return made;
}

std::vector<std::pair<std::string, std::int64_t>> count_particles(const WorldParticles& particles,
                                                                  const Projected& projected,
                                                                  const SplashSplit& split,
                                                                  const Visible& visible,
                                                                  const Triangulation& mesh) {
  return {{"particles", static_cast<std::int64_t>(particles.x.size())},
          {"in view", static_cast<std::int64_t>(projected.size())},
          {"splash", static_cast<std::int64_t>(split.splash.size())},
          {"visible", static_cast<std::int64_t>(visible.index.size())},
          {"triangles", static_cast<std::int64_t>(mesh.triangle.size())}};
}

}  // namespace meniscus
