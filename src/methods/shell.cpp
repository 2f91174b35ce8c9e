#include "methods/shell.hpp"

#include <algorithm>
#include <utility>

#include "base/order_statistics.hpp"
#include "base/parallel.hpp"
#include "base/rounded_up.hpp"
#include "stages/sheet/smooth_normals.hpp"

namespace meniscus {

Fluid measure_fluid(const FitFrame& frame, const WorldParticles& particles) {
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

Visible look_at(const FitFrame& frame, const Fluid& fluid, std::optional<FluidView>& view) {
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

Shell find_shell(const FitFrame& frame, const Fluid& fluid, const Visible& seen,
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

SurfaceParticles orient(const FitFrame& frame, const Fluid& fluid, const Visible& seen,
                        Shell& shell) {
  const Triangulation& mesh = shell.triangulated.mesh;
  const NormalSources sources =
      normal_sources(fluid.particles, seen, mesh, without_descent(seen, shell.found));
  const std::vector<Vec3d> of_triangles =
      smooth_normals(mesh, frame.params.merge.smoothing_rounds, sources.vertex);
  return with_normals(
      std::move(shell.found), seen,
      first_normals(frame.view, fluid.particles, seen, mesh, of_triangles, sources));
}

}  // namespace meniscus
