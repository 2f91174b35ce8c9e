// What every method shares that smooths the depth map of the particles' spheres.
#include "device/stage_clock.hpp"
#include "methods/methods.hpp"
#include "stages/mesh/mesh.hpp"
#include "stages/mesh/silhouettes.hpp"
#include "stages/other_methods/ssm.hpp"
#include "stages/sample/surface_buffers.hpp"

namespace meniscus {

Extraction run_on_spheres(Device& device, const View& view, const WorldParticles& particles,
                          const Parameters& params, std::vector<StageTime>* timings,
                          double footprint, double z_max, const SphereFilter& filter) {
  Extraction result;
  StageClock clock(device, timings);
  clock.start("project");
  const Projected projected = project_particles(view, particles, footprint);
  const DeviceSpheres spheres = upload_spheres(device, view, projected, footprint);

  const auto make_surface = [&](const SampleGrid& grid) {
    clock.start("filter");
    const DepthAndNormals filtered = filter(spheres, grid);
    return SurfaceBuffers{grid, filtered.depth, filtered.normal, {}, {}, {}};
  };
  if (params.image) result.image = make_surface(pixel_grid(view));
  if (params.mesh) {
    const SurfaceBuffers surface = make_surface(node_grid(view, params.grid.cell));
    clock.start("mesh");
    const SurfaceMap nodes = download(device, surface);
    MeshParams mesh = params.grid;
    mesh.z_max = z_max;
    const std::vector<SilhouetteEdge> edges =
        place_circle_cuts(nodes, find_silhouette_edges(nodes, z_max), projected, footprint, z_max);
    result.mesh = make_mesh(view, nodes, edges, mesh);
  }
  clock.stop();
  result.counts = count_particles(particles, projected);
  return result;
}

}  // namespace meniscus
