// Method fit: a quadric around every particle of the surface near the visible ones, blended in
// sheets; the density field where no fit can be trusted. Method groups: the same with a quadric
// around each group of merged particles; method stable: around the seen particles alone.
// run_on_fits() is section 2 of the paper, step by step.
#include <utility>

#include "methods/layers.hpp"
#include "methods/methods.hpp"
#include "methods/recorded_fits.hpp"
#include "methods/seeding.hpp"
#include "stages/fit/particle_fit.hpp"
#include "stages/fit/trust.hpp"
#include "stages/mesh/mesh.hpp"
#include "stages/mesh/silhouettes.hpp"
#include "stages/sample/sampler.hpp"

namespace meniscus {
namespace {

// Where the front layer ends between the two nodes of each silhouette edge (paper 2.5). A point
// belongs to the layer when the blend, or the field where the layer is splash, goes on there.
// Waits.
std::vector<SilhouetteEdge> cut_silhouettes(const Sampler& sampler, const SurfaceMap& nodes) {
  const double z_max = sampler.params.grid.z_max;
  const std::vector<SilhouetteEdge> edges = find_silhouette_edges(nodes, z_max);
  const FitTiles tiles = list_fits(sampler.device, sampler.view, sampler.records, nodes.grid);
  const auto sample = [&](const std::vector<float>& points, const std::vector<float>& near) {
    std::vector<float> near_fits = near;
    for (std::size_t e = 0; e < edges.size(); ++e)
      if (nodes.kind[edges[e].front] == Kind::splash) near_fits[e] = kNoSurface;
    return sample_points(sampler, nodes.grid, tiles, points, near, near_fits);
  };
  return bisect_silhouettes(nodes, edges, z_max, sample);
}

// All three methods: only the places of the fits differ.
Extraction run_on_fits(Device& device, const View& given_view, const WorldParticles& particles,
                       const Parameters& given, const Seeding& seeding,
                       std::vector<StageTime>* timings) {
  StageClock clock(device, timings);

  // 2.1: the particles in view, and those of them that are seen.
  const Fluid fluid = measure_fluid({device, given_view, given, clock}, particles);
  const View& view = fluid.view;
  const Parameters params = for_disorder(given, fluid.disorder);
  const FitFrame frame{device, view, params, clock};
  std::optional<FluidView> measured;
  const Visible seen = look_at(frame, fluid, measured);

  // 2.2: their triangulation, and the surface's particles around them.
  Shell shell = find_shell(frame, fluid, seen, measured, seeding);
  const auto& [visible, mesh] = shell.triangulated;
  clock.start("region");
  const SplatParticles on_screen = upload_splats(device, fluid.particles, seen.index);
  const KeptTriangles triangles = upload_triangles(device, mesh);
  const auto backdrop_of = [&, &view = view, &params = params](const SampleGrid& grid) {
    return draw_backdrop(device, view, on_screen, triangles, shell.splash, grid, params);
  };

  // 2.3: a quadric around each seed.
  clock.start("fit");
  const SurfaceParticles around = orient(frame, fluid, seen, shell);
  const FitSurface surface = upload_surface(device, fluid.particles, around);
  measure_roundness(device, surface, shell.trials, params.fit, params.blend, params.disorder);
  const Seeds seeds = seeding.choose(frame, fluid, shell, around);
  DeviceFits made = make_fits(device, surface, fluid.particles, seeds.places, around,
                              seeds.neighbours, params.fit, seeds.extent);
  clock.start("trust");
  measure_surroundings(device, fluid.cells, made);
  ParticleFits fits = download(device, std::move(made));
  const std::vector<double> trust = trust_of(fits, params.disorder);
  clock.start("region");
  Backdrop of_image;  // drawn while the host is at the fits' records
  if (params.image) of_image = backdrop_of(pixel_grid(view));

  // 2.4: the surface at pixels and at the nodes of the mesh.
  auto [records, residual] = record_fits(fits, trust, params);
  const DeviceRecords on_device = upload_records(device, records);
  const Sampler sampler{device,      view,           params,     std::move(records), on_device,
                        fluid.cells, fluid.levelled, fluid.body, shell.least_radius};
  Extraction result;
  if (params.image)
    result.image = sample_grid(sampler, pixel_grid(view), std::exchange(of_image, {}),
                               params.aovs.group || params.aovs.residual, clock);
  if (params.mesh) {
    const SampleGrid grid = node_grid(view, params.grid.cell);
    const SurfaceBuffers on_nodes = sample_grid(sampler, grid, backdrop_of(grid), false, clock);
    clock.start("mesh");  // 2.5
    const SurfaceMap nodes = download(device, on_nodes);
    result.mesh = make_mesh(view, nodes, cut_silhouettes(sampler, nodes), params.grid);
  }
  result.counts = count_particles(particles, fluid.particles, fluid.split, visible, mesh);
  result.counts.*seeding.counted = static_cast<std::int64_t>(fits.size());
  result.residual = std::move(residual);
  for (float& each : result.residual) each *= static_cast<float>(fluid.disorder.unit());
  result.disorder = fluid.disorder;
  if (params.image && params.layers > 0)
    result.layers = find_layers(device, view,
                                {fluid.particles, fluid.cells, fluid.levelled, around,
                                 std::move(fits), trust, seeds.places.index},
                                front_of(device, view, result.image, params.layers), params, clock);
  clock.stop();
  return result;
}

}  // namespace

Extraction run_fit(Device& device, const View& view, const WorldParticles& particles,
                   const Parameters& params, std::vector<StageTime>* timings) {
  return run_on_fits(device, view, particles, params, kEveryParticle, timings);
}

Extraction run_stable(Device& device, const View& view, const WorldParticles& particles,
                      const Parameters& params, std::vector<StageTime>* timings) {
  return run_on_fits(device, view, particles, params, kSeenParticles, timings);
}

Extraction run_groups(Device& device, const View& view, const WorldParticles& particles,
                      const Parameters& params, std::vector<StageTime>* timings) {
  return run_on_fits(device, view, particles, params, kMergedGroups, timings);
}

}  // namespace meniscus
