// Method paper: the paper as printed, to reproduce its figures.
#include "stages/other_methods/paper.hpp"

#include "device/stage_clock.hpp"
#include "methods/methods.hpp"
#include "stages/frame/splash.hpp"
#include "stages/frame/visible.hpp"
#include "stages/mesh/mesh.hpp"
#include "stages/mesh/silhouettes.hpp"
#include "stages/other_methods/merge_groups.hpp"
#include "stages/other_methods/ssm.hpp"
#include "stages/sheet/triangulate.hpp"

namespace meniscus {

// The paper as printed: one call per step of its sections 2.1 to 2.5.
Extraction run_paper(Device& device, const View& view, const WorldParticles& particles,
                     const Parameters& params, std::vector<StageTime>* timings) {
  Extraction result;
  StageClock clock(device, timings);
  clock.start("project");
  const Projected projected = project_particles(view, particles, params.visible.footprint);
  clock.start("split");
  SplashSplit split = split_by_neighbours(projected, params.splash);
  clock.start("visible");
  const Visible visible =
      find_visible(device, view, projected, split.body, params.visible, params.visible.owned);
  clock.start("triangulate");
  const Triangulation triangles = triangulate(view, projected, visible, params.triangle);
  clock.start("ghost");
  const Triangulation patched = add_ghost_particles(view, triangles, params.triangle.d_max);
  for (const std::int32_t i : particles_without_group(patched, visible.index.size()))
    split.splash.push_back(i);
  clock.start("group");
  const Groups groups = merge_groups(patched, patched.normal, params.merge);
  clock.start("fit");
  const Quadrics quadrics = fit_heights(device, patched, groups, params.fit, params.paper.offset);
  const GroupRecords records = printed_records(view, groups, quadrics, params.blend);

  const auto make_surface = [&](const SampleGrid& grid) {
    clock.start("region");
    PaperRegion region = draw_region(device, view, patched, groups, grid);
    region = smooth_contour(device, region, groups, params.region, params.grid.cell);
    clock.start("blend");
    return blend_printed(device, view, region, records, params.blend, params.paper);
  };
  if (params.image) {
    SurfaceBuffers image = make_surface(pixel_grid(view));
    clock.start("normals");
    image.normal = depth_normals(device, view, image.depth, image.grid, params.grid.z_max);
    clock.start("splash");
    draw_spheres(device, view, projected, split.splash, image);
    result.image = image;
  }
  if (params.mesh) {
    const SurfaceBuffers surface = make_surface(node_grid(view, params.grid.cell));
    clock.start("splash");
    draw_spheres(device, view, projected, split.splash, surface);
    clock.start("mesh");
    const SurfaceMap nodes = download(device, surface);
    result.mesh =
        make_mesh(view, nodes, find_silhouette_edges(nodes, params.grid.z_max), params.grid);
  }
  clock.stop();

  result.residual = quadrics.residual;
  result.counts = count_particles(particles, projected, split, visible, patched);
  result.counts.groups = static_cast<std::int64_t>(groups.size());
  return result;
}

}  // namespace meniscus
