// Method narrow-range: the narrow-range filter (Truong and Yuksel 2018).
#include "methods/methods.hpp"
#include "stages/other_methods/filter.hpp"
#include "stages/other_methods/ssm.hpp"

namespace meniscus {

Extraction run_narrow_range(Device& device, const View& view, const WorldParticles& particles,
                            const Parameters& params, std::vector<StageTime>* timings) {
  return run_on_spheres(
      device, view, particles, params, timings, params.narrow_range.footprint, params.grid.z_max,
      [&](const DeviceSpheres& spheres, const SampleGrid& grid) {
        const auto spheres_depth = cast_spheres(device, view, spheres, grid);
        const auto depth =
            filter_narrow_range(device, view, spheres_depth, grid, params.narrow_range);
        return DepthAndNormals{depth, depth_normals(device, view, depth, grid, params.grid.z_max)};
      });
}

}  // namespace meniscus
