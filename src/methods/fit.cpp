// Method fit: groups of similar normal, a quadric each, blended in sheets; the density field where
// no group can be trusted.
#include "stages/fit.hpp"

#include "methods/methods.hpp"
#include "stage_clock.hpp"
#include "stages/blend.hpp"
#include "stages/density.hpp"
#include "stages/group.hpp"
#include "stages/mesh.hpp"
#include "stages/region.hpp"
#include "stages/splash.hpp"
#include "stages/triangulate.hpp"
#include "stages/trust.hpp"
#include "stages/visible.hpp"

namespace meniscus {
namespace {

// What the blend needs of a frame, on the device.
struct FittedFrame {
  Buffer<float> records;  // of the groups
  SplatParticles body;    // visible particles
  SplatParticles hidden;  // body particles, visible or not: what shows behind a front layer
  SplatParticles splash;
  DeviceCells cells;     // all particles in view
  DeviceCells levelled;  // the same with even level
};

// The surface where it is asked for: reference depth, blend, contour. Samples whose nearest layer
// ends before them look again behind it; then the splash is drawn.
SurfaceBuffers make_surface(Device& device, const View& view, const SampleGrid& grid,
                            const Triangulation& mesh, const GroupRecords& records,
                            const FittedFrame& frame, const Parameters& params, StageClock& clock) {
  clock.start("region");
  const SurfaceBuffers surface = empty_surface(device, grid);
  const Buffer<float> triangles = draw_triangles(device, view, mesh, grid);
  const double footprint = params.region.reference, bulge = params.fit.offset / footprint;
  Buffer<float> reference = splat_depth(device, frame.body, grid, footprint, bulge);
  Buffer<float> core = splat_depth(device, frame.body, grid, kCoreFootprint);
  const TileLists tiles = list_tiles(view, records, grid);

  constexpr int kLayers = 3;
  constexpr double kLayerGap = 3;  // particle radii
  for (int layer = 0; layer < kLayers; ++layer) {
    clock.start("blend");
    blend_groups(device, view, frame.records, tiles, reference, surface, params.blend);
    clock.start("settle");
    const Buffer<float> behind =
        settle_samples(device, view, frame.cells, frame.levelled, triangles, reference, core,
                       surface, params.region, layer + 1 == kLayers);
    if (layer + 1 == kLayers) break;
    core = splat_depth(device, frame.hidden, grid, kCoreFootprint, 1, &behind, kLayerGap);
    reference = core;
  }
  clock.start("splash");
  draw_splash(device, view, frame.levelled, frame.splash, surface, params.region);
  return surface;
}

}  // namespace

Extraction run_fit(Device& device, const View& view, const WorldParticles& particles,
                   const Parameters& params, std::vector<StageTime>* timings) {
  Extraction result;
  StageClock clock(device, timings);
  clock.start("project");
  const double margin =
      std::max(params.region.reference, params.visible.footprint) + kDensitySupport;
  const Projected projected = project_particles(device, view, particles, margin);

  clock.start("split");
  const SplashSplit split = split_splash(projected, params.splash);
  clock.start("visible");
  const Visible visible =
      find_visible(device, view, projected, split.body, params.visible, params.visible.owned);
  clock.start("triangulate");
  const Triangulation mesh = triangulate(view, projected, visible, params.triangle);
  clock.start("group");
  const std::vector<Vec3d> normals = smooth_normals(mesh, params.merge.smoothing_rounds);
  const Groups groups = merge_groups(mesh, normals, params.merge, params.fit);
  clock.start("fit");
  const std::vector<FitProblem> problems = group_problems(mesh, groups, vertex_normals(mesh));
  const Quadrics quadrics = fit_quadrics(device, problems, params.fit);
  clock.start("trust");
  const DeviceCells cells =
      upload_cells(device, make_cells(projected.x, projected.y, projected.z, kDensitySupport));
  const DeviceCells levelled = level_cells(device, cells, params.region);
  const std::vector<double> trust =
      measure_trust(device, mesh, groups, problems, quadrics, cells, params.fit.offset);
  const GroupRecords records =
      make_records(groups, quadrics, trust, params.blend, params.fit.offset);
  const FittedFrame frame{upload(device, records.values),
                          upload_splats(device, projected, visible.index),
                          upload_splats(device, projected, split.body),
                          upload_splats(device, projected, split.splash),
                          cells,
                          levelled};

  if (params.image) {
    const SurfaceBuffers image =
        make_surface(device, view, pixel_grid(view), mesh, records, frame, params, clock);
    clock.start("download");
    result.image = download(device, image);
  }
  clock.stop();

  result.residual = quadrics.residual;
  result.counts = {{"particles", static_cast<std::int64_t>(particles.x.size())},
                   {"in view", static_cast<std::int64_t>(projected.size())},
                   {"splash", static_cast<std::int64_t>(split.splash.size())},
                   {"visible", static_cast<std::int64_t>(visible.index.size())},
                   {"triangles", static_cast<std::int64_t>(mesh.triangle.size())},
                   {"groups", static_cast<std::int64_t>(groups.size())}};
  return result;
}

}  // namespace meniscus
