// Method curvature-flow: screen-space mean curvature flow (van der Laan, Green, Sainz 2009).
#include "methods/methods.hpp"
#include "stages/other_methods/filter.hpp"
#include "stages/other_methods/ssm.hpp"

namespace meniscus {

Extraction run_curvature_flow(Device& device, const View& view, const WorldParticles& particles,
                              const Parameters& params, std::vector<StageTime>* timings) {
  return run_on_spheres(
      device, view, particles, params, timings, params.curvature_flow.footprint,
      params.curvature_flow.z_max, [&](const DeviceSpheres& spheres, const SampleGrid& grid) {
        const auto spheres_depth = cast_spheres(device, view, spheres, grid);
        const auto depth = flow_curvature(device, view, spheres_depth, grid, params.curvature_flow);
        return DepthAndNormals{
            depth, depth_normals(device, view, depth, grid, params.curvature_flow.z_max)};
      });
}

}  // namespace meniscus
