// Method stable: a quadric around every visible particle. Nothing is merged, so nothing changes
// abruptly from frame to frame.
#include "stages/other_methods/stable.hpp"

#include "device/stage_clock.hpp"
#include "methods/methods.hpp"
#include "stages/fit/particle_fit.hpp"
#include "stages/frame/density.hpp"
#include "stages/frame/splash.hpp"
#include "stages/frame/visible.hpp"
#include "stages/mesh/mesh.hpp"
#include "stages/mesh/silhouettes.hpp"
#include "stages/sample/settle.hpp"
#include "stages/sheet/group.hpp"
#include "stages/sheet/triangulate.hpp"

namespace meniscus {

Extraction run_stable(Device& device, const View& view, const WorldParticles& particles,
                      const Parameters& params, std::vector<StageTime>* timings) {
  Extraction result;
  StageClock clock(device, timings);
  clock.start("project");
  const double margin = std::max(params.stable.capsule, params.visible.footprint) + kDensitySupport;
  const Projected projected = project_particles(view, particles, margin);
  clock.start("split");
  const Cells host_cells = make_cells(projected.x, projected.y, projected.z, kDensitySupport);
  const SplashSplit split = split_splash(projected, host_cells, params.splash);
  clock.start("visible");
  const Visible fitted = find_visible(device, view, projected, split.body, params.visible,
                                      std::min(kLeastFitted, params.visible.owned));
  clock.start("triangulate");
  const Triangulation mesh =
      triangulate(view, projected, more_visible(fitted, params.visible.owned), params.triangle);
  clock.start("fit");
  const std::vector<Vec3d> normals = first_normals(
      view, projected, fitted, mesh, smooth_normals(mesh, params.merge.smoothing_rounds));
  const ParticleFits fits =
      fit_particles(device, projected, fitted, seen_surface(fitted, normals), params.fit);
  const GroupRecords records = stable_records(fits, params.fit, params.blend.radius);
  const Buffer<float> device_records = upload(device, records.values);

  clock.start("upload");
  const SplatParticles splash = upload_splats(device, projected, split.splash, kLargestDrop);
  const DeviceCells cells = upload_cells(device, host_cells);
  const DeviceCells levelled = level_cells(device, cells, params.region, Measured::near_air);

  const auto make_surface = [&](const SampleGrid& grid) {
    clock.start("region");
    const StableRegion region =
        draw_stable_region(device, view, mesh, fitted, fits, device_records, grid, params);
    clock.start("blend");
    const SurfaceBuffers surface = blend_particles(device, view, region, device_records,
                                                   list_tiles(view, records, grid), params.blend);
    clock.start("splash");
    const Extent extent = splash_extent(device, splash, grid, no_blocks(device, grid));
    const SampleLists lists = list_samples(device, grid, extent.from, extent.occupied);
    draw_splash(device, view, lists, levelled, extent, surface, params.region);
    return surface;
  };
  if (params.image) result.image = make_surface(pixel_grid(view));
  if (params.mesh) {
    const SurfaceBuffers surface = make_surface(node_grid(view, params.grid.cell));
    clock.start("mesh");
    const SurfaceMap nodes = download(device, surface);
    result.mesh =
        make_mesh(view, nodes, find_silhouette_edges(nodes, params.grid.z_max), params.grid);
  }
  clock.stop();

  result.residual = fits.residual;
  result.counts = count_particles(particles, projected, split, fitted, mesh);
  return result;
}

}  // namespace meniscus
