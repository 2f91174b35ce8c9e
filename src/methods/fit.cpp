// Method fit: a quadric around every particle of the surface near the visible ones, blended in
// sheets; the density field where no fit can be trusted. Method groups: the same with a quadric
// around each group of merged particles; method stable: around the seen particles alone.
// run_on_fits() is section 2 of the paper, step by step.
#include <optional>
#include <utility>

#include "base/order_statistics.hpp"
#include "base/parallel.hpp"
#include "base/rounded_up.hpp"
#include "device/stage_clock.hpp"
#include "device/together.hpp"
#include "methods/layers.hpp"
#include "methods/methods.hpp"
#include "methods/placed_fluid.hpp"
#include "methods/recorded_fits.hpp"
#include "stages/fit/particle_fit.hpp"
#include "stages/fit/roundness.hpp"
#include "stages/fit/trust.hpp"
#include "stages/frame/near_lists.hpp"
#include "stages/frame/relax.hpp"
#include "stages/frame/splash.hpp"
#include "stages/mesh/mesh.hpp"
#include "stages/mesh/silhouettes.hpp"
#include "stages/sample/sampler.hpp"
#include "stages/sheet/group.hpp"
#include "stages/sheet/merge.hpp"

namespace meniscus {
namespace {

// What every step of a frame is given.
struct Frame {
  Device& device;
  const View& view;
  const Parameters& params;
  StageClock& clock;
};

// The particles in view; their density field; which of them are splash.
struct Fluid : PlacedFluid {
  DeviceCells cells{}, levelled{};
  // The field at the particles (level_cells()), and how many nodes each of the body owns
  // (count_owned()).
  Together<float, cl_int> measured{};
  SplashSplit split{};
  SplatParticles body{};
};

Fluid measure_fluid(const Frame& frame, const WorldParticles& particles) {
  const auto& [device, view, params, clock] = frame;
  const double margin =
      std::max(params.region.reference, params.visible.footprint) + kDensitySupport;
  Fluid fluid{place_fluid(view, params, clock, [&](const View& in) {
    return project_particles(in, particles, margin);
  })};
  clock.start("split");
  parallel_both(
      [&, &params = params] {
        fluid.split = split_splash(fluid.particles, fluid.host_cells, params.splash);
      },
      [&, &device = device] {
        fluid.cells = upload_cells(device, fluid.host_cells, fluid.disorder.mass());
      });
  fluid.body = upload_splats(device, fluid.particles, fluid.split.body);
  clock.start("field");  // is measured while the host goes on
  const std::size_t n = fluid.particles.size();
  fluid.measured = {device, {4 * n, rounded_up(n, 16)}};  // whole vectors to fill
  fluid.levelled = level_cells(
      device, fluid.cells, Measured::near_air, for_disorder(params.region, fluid.disorder),
      fluid.measured.part<0>(), lone_factor(params.region, fluid.disorder));
  clock.start("visible");
  return fluid;
}

// What was measured of a fluid, on the host: the device gets no work while this lives.
using FluidView = ViewTogether<float, cl_int>;

// The seen particles, and the fluid's field with them, by one command.
Visible look_at(const Frame& frame, const Fluid& fluid, std::optional<FluidView>& view) {
  const auto& [device, camera, params, clock] = frame;
  const std::vector<std::int32_t>& body = fluid.split.body;
  SampleGrid grid;
  if (!body.empty())
    grid = count_owned(device, camera, fluid.particles, body, fluid.body, params.visible,
                       fluid.measured.part<1>());
  view.emplace(device, fluid.measured);
  return visible_among(fluid.particles, body, grid, view->data<1>(), params.visible,
                       std::min(kLeastFitted, params.visible.owned));
}

// The seen particles and those that stand for the surface around them, seen or not.
struct Shell {
  SeenMesh triangulated;
  FieldSurface found;
  Visible rim;           // the particles that are fitted, or merge first
  TrialPlaces trials;    // of the rim, for its roundness
  NearLists near;        // who is near, on the host, where particles merge
  FitNeighbours fitted;  // of the rim, where each of its particles is fitted
  SplatParticles splash;
  double least_radius = 0;  // of a particle on the screen, pixels
};

// The places that get a quadric each, and what is known of them.
struct Seeds {
  Visible places;
  FitNeighbours neighbours;
  std::vector<double> extent;  // [places] of groups (merge.hpp); else empty
};

// How a method chooses its seeds: what it looks for while the triangulation keeps the other
// processor busy, and the rest.
struct Seeding {
  std::int64_t Counts::*counted;                   // what its fits count as
  double rim_reach;                                // see with_rim(), particle radii
  bool merges;                                     // whether Shell::near is wanted
  double (*near_reach)(const Parameters& params);  // of Shell::near, at least kTrialReach
  FitNeighbours (*look_ahead)(const Frame& frame, const Fluid& fluid, const Shell& shell);
  Seeds (*choose)(const Frame& frame, const Fluid& fluid, Shell& shell,
                  const SurfaceParticles& around);
};

// Method fit: every particle of the rim.
constexpr Seeding kEveryParticle{
    &Counts::fits,
    kRimReach,
    false,
    [](const Parameters&) { return kTrialReach; },
    [](const Frame& frame, const Fluid& fluid, const Shell& shell) {
      return find_neighbours(frame.device, fluid.particles, shell.rim, shell.found.index,
                             fit_reach(frame.params.fit));
    },
    [](const Frame&, const Fluid&, Shell& shell, const SurfaceParticles&) {
      return Seeds{shell.rim, std::move(shell.fitted), {}};
    }};

// Places that come from the rim when its roundness is known: nothing is looked for before.
FitNeighbours look_later(const Frame&, const Fluid&, const Shell&) { return {}; }

// Method stable: the seen particles, as in the paper. The hidden ones of the rim help to tell what
// the surface is like; without them edges at outlines came out rounded (docs/method_decisions.md).
constexpr Seeding kSeenParticles{
    &Counts::fits,
    kRimReach,
    false,
    kEveryParticle.near_reach,
    look_later,
    [](const Frame& frame, const Fluid& fluid, Shell& shell, const SurfaceParticles& around) {
      Visible seen = more_visible(shell.rim, kLeastFitted);
      FitNeighbours neighbours = find_neighbours(frame.device, fluid.particles, seen, around.index,
                                                 fit_reach(frame.params.fit));
      return Seeds{std::move(seen), std::move(neighbours), {}};
    }};

// Method groups: what is left when nothing merges any more. Every particle tells what the surface
// is like, in a group or not: of groups alone, creases came out rounded (docs/method_decisions.md).
constexpr Seeding kMergedGroups{
    &Counts::groups,
    kRimReachGroups,
    true,
    [](const Parameters& params) { return std::max(kTrialReach, merge_reach(params.merge)); },
    look_later,
    [](const Frame& frame, const Fluid& fluid, Shell& shell, const SurfaceParticles& around) {
      const auto& [device, view, params, clock] = frame;
      clock.start("merge");
      MergedGroups groups =
          merge_particles(view, fluid.particles, shell.rim, around, shell.near, params.merge);
      clock.start("fit");
      FitNeighbours neighbours = find_neighbours(device, fluid.particles, groups.seed, around.index,
                                                 fit_reach(params.fit));
      return Seeds{std::move(groups.seed), std::move(neighbours), std::move(groups.extent)};
    }};

// Triangles keep some processors busy; meanwhile the surface's particles and their neighbours are
// found. That side alone has the device.
Shell find_shell(const Frame& frame, const Fluid& fluid, const Visible& seen,
                 std::optional<FluidView>& measured, const Seeding& seeding) {
  const auto& [device, view, params, clock] = frame;
  clock.start("surface");
  Shell shell;
  parallel_both(
      [&, &view = view, &params = params] {
        shell.triangulated = triangulate_without_pits(
            view, fluid.particles, more_visible(seen, params.visible.owned), params.triangle);
      },
      [&, &device = device, &params = params] {
        shell.found =
            find_surface(seen, fluid.host_cells, {measured->data<0>(), 4 * fluid.particles.size()},
                         params.disorder);
        measured.reset();
        shell.rim = with_rim(fluid.particles, seen, shell.found, seeding.rim_reach);
        shell.fitted = seeding.look_ahead(frame, fluid, shell);
        NearLists near = list_near(fluid.particles, shell.rim.index, shell.found.index,
                                   seeding.near_reach(params));
        shell.trials = upload_trials(device, fluid.particles, near, shell.rim, shell.found.index);
        if (seeding.merges) shell.near = std::move(near);
        shell.splash = upload_splats(device, fluid.particles, fluid.split.splash, kLargestDrop);
        shell.least_radius =
            std::min(bounds_of(fluid.particles.ku).least, bounds_of(fluid.particles.kv).least);
      });
  return shell;
}

// The particles that stand for the surface with their normals: the field's, or the triangulation's
// where that is flat (paper 2.2, step 3).
SurfaceParticles orient(const Frame& frame, const Fluid& fluid, const Visible& seen, Shell& shell) {
  const Triangulation& mesh = shell.triangulated.mesh;
  const NormalSources sources =
      normal_sources(fluid.particles, seen, mesh, without_descent(seen, shell.found));
  const std::vector<Vec3d> of_triangles =
      smooth_normals(mesh, frame.params.merge.smoothing_rounds, sources.vertex);
  return with_normals(
      std::move(shell.found), seen,
      first_normals(frame.view, fluid.particles, seen, mesh, of_triangles, sources));
}

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
  const Frame frame{device, view, params, clock};
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
