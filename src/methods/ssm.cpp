// Method ssm: Screen Space Meshes (Mueller, Schirm, Duthaler 2007), the paper's baseline.
#include "stages/other_methods/ssm.hpp"

#include "methods/methods.hpp"

namespace meniscus {

Extraction run_ssm(Device& device, const View& view, const WorldParticles& particles,
                   const Parameters& params, std::vector<StageTime>* timings) {
  return run_on_spheres(
      device, view, particles, params, timings, params.ssm.footprint, params.ssm.z_max,
      [&](const DeviceSpheres& spheres, const SampleGrid& grid) {
        const auto spheres_depth = cast_spheres(device, view, spheres, grid);
        const auto depth =
            smooth_depth(device, view, spheres_depth, grid, params.ssm, params.grid.cell);
        return DepthAndNormals{depth, depth_normals(device, view, depth, grid, params.ssm.z_max)};
      });
}

}  // namespace meniscus
