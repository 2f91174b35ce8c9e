#include "methods/extraction.hpp"

#include "prepare/attributes.hpp"
#include "stages/extras/motion.hpp"

namespace meniscus {

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

}  // namespace meniscus
