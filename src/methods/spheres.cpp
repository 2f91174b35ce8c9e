// Method spheres: the particles as they are, the least that any method starts from.
#include "stages/other_methods/spheres.hpp"

#include "methods/methods.hpp"

namespace meniscus {

Extraction run_spheres(Device& device, const View& view, const WorldParticles& particles,
                       const Parameters& params, std::vector<StageTime>* timings) {
  return run_on_spheres(
      device, view, particles, params, timings, params.spheres.footprint, params.grid.z_max,
      [&](const DeviceSpheres& spheres, const SampleGrid& grid) {
        const auto depth = cast_spheres(device, view, spheres, grid);
        return DepthAndNormals{depth, sphere_normals(device, view, spheres, grid)};
      });
}

}  // namespace meniscus
