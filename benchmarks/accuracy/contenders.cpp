#include "accuracy/contenders.hpp"

#include <memory>

#include "accuracy/figures/statistics.hpp"
#include "accuracy/peers.hpp"
#include "accuracy/ray_cast.hpp"

namespace meniscus::accuracy {

Contender library_method(Device& device, const Parameters& parameters) {
  return {to_string(parameters.method),
          [&device, parameters](const Particles& particles, const Lens& lens) {
            return extract(device, particles, camera_of(lens), parameters);
          }};
}

Contender splashsurf(const std::string& program) {
  struct Last {
    std::vector<float> x, y, z;
    Mesh mesh;
  };
  const auto last = std::make_shared<Last>();
  return {"splashsurf", [program, last](const Particles& particles, const Lens& lens) {
            const double radius = particles.particle_radius;
            require(radius > 0, "splashsurf: the particles state no radius");
            if (last->x != particles.x || last->y != particles.y || last->z != particles.z)
              *last = {particles.x, particles.y, particles.z,
                       reconstruct_with_splashsurf(program, particles, radius)};
            const Map map = ray_cast(last->mesh, lens);
            Surface surface = surface_of(lens, map, radius);
            surface.mesh = visible_vertices(last->mesh, lens, map, radius);
            return surface;
          }};
}

Surface surface_of(const Lens& lens, const Map& map, double particle_radius) {
  Surface surface;
  surface.camera = camera_of(lens);
  surface.depth = map.depth;
  surface.normal = map.normal;
  surface.particle_radius = particle_radius;
  const std::size_t pixels = map.depth.size();
  surface.position.resize(pixels);
  surface.group.resize(pixels);
  surface.kind.resize(pixels);
  surface.residual.resize(pixels);
  for (std::size_t p = 0; p < pixels; ++p) {
    if (!finite(map.depth[p])) continue;
    surface.position[p] = static_cast<Vec3>(lens.point(p, map.depth[p]));
    surface.group[p] = 1;
    surface.kind[p] = Kind::surface;
  }
  return surface;
}

}  // namespace meniscus::accuracy
