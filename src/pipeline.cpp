// The table of contents: one call per stage, in the paper's order.
#include "pipeline.hpp"

#include <chrono>
#include <limits>

#include "stages/blend.hpp"
#include "stages/density.hpp"
#include "stages/fit.hpp"
#include "stages/group.hpp"
#include "stages/mesh.hpp"
#include "stages/paper.hpp"
#include "stages/region.hpp"
#include "stages/splash.hpp"
#include "stages/ssm.hpp"
#include "stages/triangulate.hpp"
#include "stages/trust.hpp"
#include "stages/visible.hpp"

namespace meniscus {

/// Names the stage that runs, for timings and for errors.
class StageClock {
 public:
  StageClock(Device& device, std::vector<StageTime>* timings) : device_(device), times_(timings) {}
  ~StageClock() { device_.state().stage.clear(); }

  void start(const std::string& stage) {
    stop();
    device_.state().stage = stage;
    begin_ = std::chrono::steady_clock::now();
  }

  void stop() {
    if (device_.state().stage.empty()) return;
    if (times_) {
      StageTime time{device_.state().stage, 0, 0};
      for (const auto& [kernel, ms] : device_.state().take_times()) time.device_ms += ms;
      time.host_ms =
          std::chrono::duration<double, std::milli>(std::chrono::steady_clock::now() - begin_)
              .count();
      times_->push_back(time);
    } else {
      device_.state().events.clear();
    }
    device_.state().stage.clear();
  }

 private:
  Device& device_;
  std::vector<StageTime>* times_;
  std::chrono::steady_clock::time_point begin_;
};

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

// The paper as printed: one call per step of its sections 2.1 to 2.5.
Extraction run_paper(Device& device, const View& view, const WorldParticles& particles,
                     const Parameters& params, std::vector<StageTime>* timings) {
  Extraction result;
  StageClock clock(device, timings);
  clock.start("project");
  const Projected projected = project_particles(device, view, particles, params.visible.footprint);
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
  MergeParams uncapped = params.merge;
  uncapped.cap = std::numeric_limits<double>::infinity();
  FitParams members_only = params.fit;
  members_only.rings = 0;
  const Groups groups = merge_groups(patched, patched.normal, uncapped, members_only);
  clock.start("fit");
  const Quadrics quadrics = fit_heights(device, patched, groups, params.fit);
  const GroupRecords records = printed_records(view, groups, quadrics, params.blend);

  const auto make_surface = [&](const SampleGrid& grid) {
    clock.start("region");
    PaperRegion region = draw_region(device, view, patched, groups, grid);
    region = smooth_contour(device, region, groups, params.region, params.grid.cell);
    clock.start("blend");
    return blend_printed(device, view, region, records, params.blend);
  };
  if (params.image) {
    SurfaceBuffers image = make_surface(pixel_grid(view));
    clock.start("normals");
    image.normal = depth_normals(device, view, image.depth, image.grid, params.grid.z_max);
    clock.start("splash");
    draw_spheres(device, view, projected, split.splash, image);
    clock.start("download");
    result.image = download(device, image);
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
  result.counts = {{"particles", static_cast<std::int64_t>(particles.x.size())},
                   {"in view", static_cast<std::int64_t>(projected.size())},
                   {"splash", static_cast<std::int64_t>(split.splash.size())},
                   {"visible", static_cast<std::int64_t>(visible.index.size())},
                   {"triangles", static_cast<std::int64_t>(patched.triangle.size())},
                   {"groups", static_cast<std::int64_t>(groups.size())}};
  return result;
}

}  // namespace

Extraction run_pipeline(Device& device, const View& view, const WorldParticles& particles,
                        const Parameters& params, std::vector<StageTime>* timings) {
  if (params.method == Method::paper) return run_paper(device, view, particles, params, timings);
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
