// Method fit: a quadric around every particle of the surface near the visible ones, blended in
// sheets; the density field where no fit can be trusted. Method groups: the same with a quadric
// around each group of merged particles.
#include <utility>

#include "base/order_statistics.hpp"
#include "base/parallel.hpp"
#include "base/stage_clock.hpp"
#include "methods/methods.hpp"
#include "stages/behind.hpp"
#include "stages/blend.hpp"
#include "stages/density.hpp"
#include "stages/group.hpp"
#include "stages/interpolate.hpp"
#include "stages/merge.hpp"
#include "stages/mesh.hpp"
#include "stages/particle_fit.hpp"
#include "stages/region.hpp"
#include "stages/roundness.hpp"
#include "stages/settle.hpp"
#include "stages/silhouettes.hpp"
#include "stages/specks.hpp"
#include "stages/splash.hpp"
#include "stages/triangulate.hpp"
#include "stages/trust.hpp"
#include "stages/visible.hpp"

namespace meniscus {
namespace {

// What the blend needs of a frame, on the device.
struct FittedFrame {
  DeviceRecords records;  // of the fits
  SplatParticles hidden;  // body particles, visible or not: what shows behind a front layer
  SplatParticles splash;
  DeviceCells cells;     // all particles in view
  DeviceCells levelled;  // the same with even level
  double least_radius;   // of a particle on the screen, pixels
};

double least_radius(const Projected& projected) {
  return std::min(bounds_of(projected.ku).least, bounds_of(projected.kv).least);
}

// Where the front layer ends between the two nodes of each silhouette edge. A point belongs to the
// layer when the blend, or the field where the layer is splash, goes on there.
std::vector<SilhouetteEdge> cut_silhouettes(Device& device, const View& view,
                                            const SurfaceMap& nodes, const BlendRecords& records,
                                            const FittedFrame& frame, const Parameters& params) {
  const std::vector<SilhouetteEdge> edges = find_silhouette_edges(nodes, params.grid.z_max);
  const FitTiles tiles = list_fits(device, view, records, nodes.grid);
  const auto sample = [&](const std::vector<float>& points, const std::vector<float>& near) {
    std::vector<float> blended = near;
    for (std::size_t e = 0; e < edges.size(); ++e)
      if (nodes.kind[edges[e].front] == Kind::splash) blended[e] = kNoSurface;
    const Buffer<float> at = upload(device, points);
    const SurfaceBuffers samples =
        empty_surface(device, {static_cast<int>(near.size()), 1, 0.0f, 1.0f});
    blend_points(device, view, frame.records, tiles, nodes.grid, at, upload(device, blended),
                 samples, params.blend);
    settle_points(device, view, frame.cells, frame.levelled, at, upload(device, near), samples,
                  params.region);
    const SurfaceMap map = download(device, samples);
    std::vector<SurfaceSample> found;
    for (std::size_t e = 0; e < near.size(); ++e) found.push_back({map.depth[e], map.normal[e]});
    return found;
  };
  return bisect_silhouettes(nodes, edges, params.grid.z_max, sample);
}

// The surface where it is asked for: reference depth, blend, contour, and splash before it. First
// the samples of a coarse lattice, then those between that these do not tell. Samples whose nearest
// layer ends before them look again behind it.
SurfaceBuffers make_surface(Device& device, const View& view, const SampleGrid& grid, Fronts fronts,
                            const Triangulation& mesh, const BlendRecords& records,
                            const FittedFrame& frame, bool groups, const Parameters& params,
                            StageClock& clock) {
  clock.start("region");
  SurfaceBuffers surface = empty_surface(device, grid);
  const Buffer<float>& front = fronts.depth;  // by name: lambdas capture no structured bindings
  const OccupiedBlocks& occupied = fronts.occupied;
  const Buffer<float> triangles = draw_triangles(device, view, mesh, grid, occupied);
  const FitTiles tiles = list_fits(device, view, records, grid);
  const Extent splash = splash_extent(device, frame.splash, grid, occupied);
  // Of the samples that show nothing in the layers so far, the reference depth of the last.
  const auto open = filled<float>(device, grid.size(), kNoSurface);

  const auto fill_layer = [&](const SampleLists& lists, const Buffer<float>& reference) {
    clock.start("blend");
    blend_groups(device, view, lists, frame.records, tiles, reference, surface, params.blend);
    clock.start("settle");
    settle_samples(device, view, lists, frame.cells, frame.levelled, triangles, reference, surface,
                   open, params.region, false);
  };
  const auto splash_over = [&](const SampleLists& lists) {
    draw_splash(device, view, lists, frame.levelled, splash, surface, params.region);
  };
  const auto fill_front = [&](const LayerSamples& wanted) {
    fill_layer(wanted.surface, front);
    clock.start("splash");
    splash_over(keep_samples(device, wanted.splash, splash.from, surface.depth, open));
  };
  // Interpolated between samples at most 4/3 particle radii apart, or two samples.
  int coarsest = params.region.interpolation > 0 ? 2 : 1;
  while (coarsest > 1 && coarsest < kTile &&
         2 * coarsest * grid.step <= kWidestCell * frame.least_radius)
    coarsest *= 2;
  const ListedBlocks listed = blocks_of(device, grid, coarsest == 1);
  fill_front({list_samples(device, grid, front, occupied, coarsest),
              list_samples(device, grid, splash.from, splash.occupied, coarsest)});
  for (int every = coarsest / 2; every > 0; every /= 2) {
    clock.start("interpolate");
    fill_front(interpolate_samples(device, view, front, occupied, splash.from, splash.occupied,
                                   open, surface, params.region.interpolation, frame.least_radius,
                                   listed, every));
  }

  // What lies behind the front layer, at all samples together: few are open.
  constexpr int kBehind = 2;       // layers
  constexpr double kLayerGap = 3;  // particle radii
  // The levelled field lies one radius outside the particles, a little more between two.
  constexpr float kBehindFootprint = 1.4f;  // particle radii
  clock.start("behind");
  const SampleLists gaps = list_samples(device, grid, open, occupied, listed);
  const Discs hidden =
      outline_discs(device, frame.hidden, grid, {{kBehindFootprint, 1.0f}}, Drawn::behind);
  const DiscsBehind discs = list_discs(device, hidden, gaps, open, kLayerGap);
  SampleLists lists = gaps;
  for (int layer = 0; layer < kBehind; ++layer) {
    clock.start("behind");
    if (layer > 0) lists = keep_samples(device, lists, open, surface.depth);
    const Buffer<float> reference = splat_behind(device, discs, lists, open, kLayerGap);
    lists = keep_samples(device, lists, reference, surface.depth);
    fill_layer(lists, reference);
  }
  clock.start("settle");
  settle_samples(device, view, gaps, frame.cells, frame.levelled, triangles, front, surface, open,
                 params.region, true);
  clock.start("splash");
  splash_over(keep_samples(device, gaps, splash.from, surface.depth));
  clock.start("specks");
  close_specks(device, surface, listed, frame.least_radius);
  clock.start("blend");
  if (!groups)
    surface.group = {};
  else if (coarsest > 1)
    surface.group = choose_groups(device, view, surface, frame.records, coarsest, params.blend);
  return surface;
}

// Both methods: only where the fits come from differs, from particles or from merged groups.
Extraction run_on_fits(Device& device, const View& view, const WorldParticles& particles,
                       const Parameters& params, bool merges, std::vector<StageTime>* timings) {
  Extraction result;
  StageClock clock(device, timings);
  clock.start("project");
  const double margin =
      std::max(params.region.reference, params.visible.footprint) + kDensitySupport;
  const Projected projected = project_particles(device, view, particles, margin);

  clock.start("split");
  const Cells host_cells = make_cells(projected.x, projected.y, projected.z, kDensitySupport);
  const DeviceCells cells = upload_cells(device, host_cells);
  clock.start("field");  // is measured while the host goes on
  const Buffer<float> field = measure_gradients(device, cells, Measured::near_air);
  const DeviceCells levelled = level_cells(device, cells, field, params.region);
  clock.start("split");
  const SplashSplit split = split_splash(projected, host_cells, params.splash);
  clock.start("visible");
  const SplatParticles body = upload_splats(device, projected, split.body);
  const Visible fitted = find_visible(device, view, projected, split.body, body, params.visible,
                                      std::min(kLeastFitted, params.visible.owned));
  clock.start("surface");
  // Triangles keep one processor busy; meanwhile the surface's particles and their neighbours are
  // found. That side alone has the device.
  SeenMesh triangulated;
  SplatParticles splash;
  double radius = 0;
  FieldSurface found;
  Visible rim;
  FitNeighbours neighbours, trial_neighbours;
  parallel_both(
      [&] {
        triangulated = triangulate_without_pits(
            view, projected, more_visible(fitted, params.visible.owned), params.triangle);
      },
      [&] {
        {
          const HostView gradients(device, field);
          found = find_surface(fitted, host_cells, {gradients.data(), gradients.size()});
        }
        rim = with_rim(projected, fitted, found, merges ? kRimReachGroups : kRimReach);
        if (!merges)
          neighbours =
              find_neighbours(device, projected, rim.index, found.index, params.fit.support);
        trial_neighbours = find_neighbours(device, projected, rim.index, found.index, kTrialReach);
        splash = upload_splats(device, projected, split.splash, kLargestDrop);
        radius = least_radius(projected);
      });
  const auto& [visible, mesh] = triangulated;
  clock.start("region");
  const SplatParticles seen = upload_splats(device, projected, visible.index);
  const auto draw_fronts = [&](const SampleGrid& grid) {
    const double footprint = params.region.reference, bulge = params.fit.offset / footprint;
    return splat_fronts(device, seen, grid, footprint, bulge);
  };
  Fronts on_image;  // drawn while the host is at the fits' records
  if (params.image) on_image = draw_fronts(pixel_grid(view));
  clock.start("fit");
  const NormalSources sources =
      normal_sources(projected, fitted, mesh, without_descent(fitted, found));
  const std::vector<Vec3d> normals =
      first_normals(view, projected, fitted, mesh,
                    smooth_normals(mesh, params.merge.smoothing_rounds, sources.vertex), sources);
  const SurfaceParticles around = with_normals(std::move(found), fitted, normals);
  // Every particle tells what the surface is like, in a group or not: of groups alone, creases came
  // out rounded (docs/method.md).
  std::vector<float> roundness =
      measure_roundness(device, projected, rim, around, trial_neighbours, params.fit, params.blend);
  MergedGroups groups;
  if (merges) {
    clock.start("merge");
    groups = merge_particles(view, projected, rim, around, params.merge);
    clock.start("fit");
    neighbours =
        find_neighbours(device, projected, groups.seed.index, around.index, params.fit.support);
    std::vector<float> of_seeds;
    for (const std::int32_t place : places_in(rim.index, groups.seed.index))
      of_seeds.push_back(roundness[static_cast<std::size_t>(place)]);
    roundness.swap(of_seeds);
  }
  const Visible& seeds = merges ? groups.seed : rim;
  ParticleFits fits =
      fit_particles(device, projected, seeds, around, neighbours, roundness, params.fit);
  if (merges) weigh_groups(fits, groups.share, groups.extent);
  clock.start("trust");
  const std::vector<double> trust = measure_trust(device, fits, cells);
  const BlendRecords records =
      make_records(fits, trust, params.fit, kBlendReach * params.blend.radius);
  const FittedFrame frame{upload_records(device, records), body, splash, cells, levelled, radius};

  if (params.image)
    result.image = make_surface(device, view, pixel_grid(view), std::move(on_image), mesh, records,
                                frame, params.aovs.group || params.aovs.residual, params, clock);
  if (params.mesh) {
    const SampleGrid grid = node_grid(view, params.grid.cell);
    const SurfaceBuffers surface = make_surface(device, view, grid, draw_fronts(grid), mesh,
                                                records, frame, false, params, clock);
    clock.start("mesh");
    const SurfaceMap nodes = download(device, surface);
    const std::vector<SilhouetteEdge> edges =
        cut_silhouettes(device, view, nodes, records, frame, params);
    result.mesh = make_mesh(view, nodes, edges, params.grid);
  }
  clock.stop();

  result.residual = fits.residual;
  result.counts = count_particles(particles, projected, split, visible, mesh);
  result.counts.emplace_back(merges ? "groups" : "fits", static_cast<std::int64_t>(fits.size()));
  return result;
}

}  // namespace

Extraction run_fit(Device& device, const View& view, const WorldParticles& particles,
                   const Parameters& params, std::vector<StageTime>* timings) {
  return run_on_fits(device, view, particles, params, false, timings);
}

Extraction run_groups(Device& device, const View& view, const WorldParticles& particles,
                      const Parameters& params, std::vector<StageTime>* timings) {
  return run_on_fits(device, view, particles, params, true, timings);
}

}  // namespace meniscus
