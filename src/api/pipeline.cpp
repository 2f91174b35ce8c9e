// The way into the methods; each is a table of contents of its own in methods/.
#include "api/pipeline.hpp"

#include "device/stage_clock.hpp"
#include "methods/methods.hpp"
#include "prepare/attributes.hpp"
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

void carry_values(Device& device, const View& view, const Projected& projected,
                  const WorldParticles& particles, const Parameters& params, Extraction& made) {
  const bool moves = particles.moving && ((params.image && params.aovs.velocity) || params.mesh);
  std::vector<float> depth;
  if (params.image) depth = download(device, made.image.depth);
  std::vector<Vec3d> vertices;
  if (params.mesh)
    for (const Vec3& world : made.mesh.position)
      vertices.push_back(eye_from_world(view, Vec3d(world)));
  if (moves) {
    const MovingParticles moving = upload_moving(device, projected, particles.velocity);
    if (params.image && params.aovs.velocity)
      made.velocity = motion_of_samples(device, view, moving, made.image.grid, depth);
    if (params.mesh) made.mesh.velocity = motion_of_points(device, moving, vertices);
  }
  for (const AttributeTriple& triple : triples_of(particles.attributes)) {
    const MovingParticles carriers = upload_moving(device, projected, triple.values);
    if (params.image)
      add_attributes(triple, particles.attributes,
                     motion_of_samples(device, view, carriers, made.image.grid, depth),
                     made.attributes);
    if (params.mesh)
      add_attributes(triple, particles.attributes, motion_of_points(device, carriers, vertices),
                     made.mesh.attributes);
  }
}

Counts count_particles(const WorldParticles& particles, const Projected& projected) {
  Counts counts;
  counts.particles = static_cast<std::int64_t>(particles.x.size());
  counts.in_view = static_cast<std::int64_t>(projected.size());
  return counts;
}

Counts count_particles(const WorldParticles& particles, const Projected& projected,
                       const SplashSplit& split, const Visible& visible,
                       const Triangulation& mesh) {
  Counts counts = count_particles(particles, projected);
  counts.splash = static_cast<std::int64_t>(split.splash.size());
  counts.visible = static_cast<std::int64_t>(visible.index.size());
  counts.triangles = static_cast<std::int64_t>(mesh.triangle.size());
  return counts;
}

}  // namespace meniscus
