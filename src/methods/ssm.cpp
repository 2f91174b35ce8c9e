// Method ssm: Screen Space Meshes (Mueller, Schirm, Duthaler 2007), the paper's baseline.
#include "stages/ssm.hpp"

#include <numeric>

#include "methods/methods.hpp"
#include "stage_clock.hpp"
#include "stages/mesh.hpp"
#include "stages/visible.hpp"

namespace meniscus {

Extraction run_ssm(Device& device, const View& view, const WorldParticles& particles,
                   const Parameters& params, std::vector<StageTime>* timings) {
  Extraction result;
  StageClock clock(device, timings);
  clock.start("project");
  const Projected projected = project_particles(device, view, particles, params.ssm.footprint);
  std::vector<std::int32_t> all(projected.size());
  std::iota(all.begin(), all.end(), 0);
  const SplatParticles spheres = upload_splats(device, projected, all);

  const auto make_surface = [&](const SampleGrid& grid) {
    clock.start("splat");
    const Buffer<float> depth = splat_depth(device, spheres, grid, params.ssm.footprint);
    clock.start("smooth");
    return ssm_surface(device, view, depth, grid, params.ssm, params.grid.cell);
  };
  if (params.image) result.image = make_surface(pixel_grid(view));
  if (params.mesh) {
    SurfaceMap nodes = make_surface(node_grid(view, params.grid.cell));
    clock.start("mesh");
    // The baseline's vertex normals are those of its triangles.
    nodes.normal.assign(nodes.normal.size(), Vec3{});
    MeshParams mesh = params.grid;
    mesh.z_max = params.ssm.z_max;
    const std::vector<SilhouetteEdge> edges =
        place_circle_cuts(nodes, find_silhouette_edges(nodes, mesh.z_max), projected, params.ssm);
    result.mesh = make_mesh(view, nodes, edges, mesh);
  }
  clock.stop();
  result.counts = {{"particles", static_cast<std::int64_t>(particles.x.size())},
                   {"in view", static_cast<std::int64_t>(projected.size())}};
  return result;
}

}  // namespace meniscus
