// The closed surface: the steps of method fit (section 2 of the paper) without a camera. All
// particles of the surface get a quadric, not only those near the visible ones; the sampler of
// rays gives way to the implicit function at points in space, and the mesh of the screen to dual
// contouring (docs/mesh.md).
#include "methods/closed.hpp"

#include <numeric>
#include <utility>

#include "base/parallel.hpp"
#include "device/give_back.hpp"
#include "device/stage_clock.hpp"
#include "methods/closed_steps.hpp"
#include "methods/contour.hpp"
#include "methods/recorded_fits.hpp"
#include "stages/closed/crumbs.hpp"
#include "stages/closed/dual_faces.hpp"
#include "stages/closed/dual_vertices.hpp"
#include "stages/closed/implicit.hpp"
#include "stages/fit/particle_fit.hpp"
#include "stages/fit/roundness.hpp"
#include "stages/fit/trust.hpp"
#include "stages/frame/relax.hpp"
#include "stages/sheet/surface.hpp"

namespace meniscus {
namespace {

// Corners of cells are evaluated this near to particles that see air; the surface is one particle
// radius outside them, and wherever else it goes more corners are added.
constexpr double kBand = 2;

// Round fits of particles anywhere (a disorder of 2) have so much more support than in views,
// particle radii. Views look less far for the normals of waves. With that support closed meshes
// were too small by 1.1 % of their volume, with this one by .9 %, and creases stay as they were.
constexpr double kMoreRoundSupport = 0.75;

// All that stand for the surface and are fitted, where `wanted`.
Visible fitted_of(const Projected& placed, const FieldSurface& shell,
                  const std::function<bool(const Vec3d& position)>& wanted) {
  Visible fitted;
  for (std::size_t k = 0; k < shell.index.size(); ++k) {
    const std::int32_t i = shell.index[k];
    if (shell.weight[k] < kLeastSurface ||
        (wanted && !wanted(placed.eye(static_cast<std::size_t>(i)))))
      continue;
    fitted.index.push_back(i);
    fitted.owned.push_back(1);
  }
  return fitted;
}

// What is made of particles.
struct Closed {
  DualMesh mesh;  // in their eye space
  ParticleFits fits;
};

// All of a surface.
DualMesh mesh_at_once(const Contoured& of) {
  of.clock.start("corners");
  SpaceGrid grid = grid_around(of.seeds, band_of(of.cell), of.cell);
  close_grid(of.device, of.function, grid);
  return mesh_grid(of.device, of.function, grid, of.clock);
}

// The same, box after box. Where corners were wanted too often, all boxes are made anew and not
// only those in which they were: what is wanted late spreads from box to box, and a box whose
// neighbours ended too soon does not know what would have come from there.
DualMesh mesh_boxes(const Contoured& of, const std::vector<BlockBox>& boxes) {
  for (int around = kRoundsAround;;) {
    std::vector<MeshPart> parts;
    int rounds = 0;
    for (const BlockBox& box : boxes) {
      parts.push_back(mesh_box(of, box, around, rounds));
      give_back_idle(of.device);
    }
    if (enough_around(rounds) <= around) return join_parts(std::move(parts)).mesh;
    around = enough_around(rounds);
  }
}

// Section 2 of the paper; cells of side `cell`, in the fluid's unit of length.
Closed close_surface(Device& device, const PlacedFluid& placed, double cell, std::size_t memory,
                     const Parameters& params, StageClock& clock) {
  FittedFluid fluid = fit_fluid(device, placed, params, clock);

  // 2.4: F at the corners of cells around the surface.
  const Contoured contoured{device, fluid.function, fluid.seeds, cell, clock};
  const std::vector<BlockBox> boxes = share_cells(contoured, {}, memory);
  Closed made;
  made.mesh = boxes.size() == 1 ? mesh_at_once(contoured) : mesh_boxes(contoured, boxes);
  drop_crumbs(made.mesh, kLeastFluid, least_air(placed.disorder));
  made.fits = std::move(fluid.fits);
  return made;
}

// All of run_closed() from where particles are placed on.
Extraction mesh_fluid(Device& device, const PlacedFluid& fluid, const WorldParticles& particles,
                      const ClosedParams& closed, const Parameters& params, StageClock& clock) {
  Extraction result;
  const double unit = fluid.disorder.unit();
  result.counts.particles = static_cast<std::int64_t>(fluid.particles.size());
  if (fluid.particles.size() == 0) {
    result.counts.in_view = 0;  // which to_world() warns of
    return result;
  }

  Closed made = close_surface(device, fluid, closed.cell / unit, closed.memory / 2, params, clock);
  result.mesh = to_world(fluid.view, std::move(made.mesh));
  result.counts.fits = static_cast<std::int64_t>(made.fits.size());
  result.residual = std::move(made.fits.residual);
  for (float& residual : result.residual) residual *= static_cast<float>(unit);
  result.disorder = fluid.disorder;

  if (particles.moving || !particles.attributes.empty()) {
    clock.start("motion");
    carry_values(device, fluid.view, fluid.particles, particles, params, result);
  }
  clock.stop();
  return result;
}

}  // namespace

double band_of(double cell) { return std::max(kBand, 1.8 * cell); }

FluidField measure_field(Device& device, const PlacedFluid& fluid, const RegionParams& params) {
  FluidField field;
  field.cells = upload_cells(device, fluid.host_cells, fluid.disorder.mass());
  field.gradients = allocate<float>(device, 4 * field.cells.x.size);
  field.levelled =
      level_cells(device, field.cells, Measured::near_air, for_disorder(params, fluid.disorder),
                  field.gradients, lone_factor(params, fluid.disorder));
  return field;
}

FittedFluid fit_fluid(Device& device, const PlacedFluid& without_voids, const Parameters& given,
                      StageClock& clock, const FitScope& scope) {
  clock.start("relax");
  const std::optional<PlacedFluid> filled = with_voids(without_voids);
  const PlacedFluid& even = filled ? *filled : without_voids;
  FittedFluid fluid;
  const Projected& placed = even.particles;
  Parameters params = for_disorder(given, even.disorder);
  params.fit.round_support += kMoreRoundSupport * even.disorder.anywhere();
  const double disorder = params.disorder;
  // 2.1: the density field, and the particles of the surface.
  clock.start("field");
  const auto [cells, levelled, field] = measure_field(device, even, given.region);
  clock.start("surface");
  FieldSurface found;
  {
    const HostView gradients(device, field);
    found = find_surface({}, even.host_cells, {gradients.data(), gradients.size()}, disorder);
    fluid.seeds = near_air(even.host_cells, gradients.data());
  }
  const Visible fitted = fitted_of(placed, found, scope.fitted);

  // 2.2, 2.3: a quadric around each of them.
  clock.start("fit");
  const Visible tried = scope.tried ? fitted_of(placed, found, scope.tried) : fitted;
  const TrialPlaces trials = find_trials(device, placed, tried, found.index);
  const FitNeighbours neighbours =
      find_neighbours(device, placed, fitted, found.index, fit_reach(params.fit));
  const SurfaceParticles around = with_normals(std::move(found), {}, {});
  const FitSurface surface = upload_surface(device, placed, around);
  measure_roundness(device, surface, trials, params.fit, params.blend, disorder);
  DeviceFits made =
      make_fits(device, surface, placed, fitted, around, neighbours, params.fit, {}, scope.noise);
  clock.start("trust");
  measure_surroundings(device, cells, made);
  if (scope.noise) fluid.rough = rough_residuals(device, made);
  fluid.fits = download(device, std::move(made));
  std::vector<double> trust = trust_of(fluid.fits, disorder);
  std::vector<std::uint32_t> all(fluid.fits.size());
  std::iota(all.begin(), all.end(), 0u);
  distrust_gaps(device, cells, fluid.fits, all, disorder, trust);
  const BlendRecords records = record_fits(fluid.fits, trust, params).records;
  fluid.function = make_implicit(device, records, levelled, params, scope.reach);
  fluid.reach.resize(fluid.fits.size());  // faces reach as far as the fits that they are from
  for (std::size_t k = 0; k < fluid.reach.size(); ++k)
    fluid.reach[k] = counts(records, k) ? records.foot[4 * k + 3] : 0;
  return fluid;
}

DualMesh mesh_grid(Device& device, const ImplicitFunction& function, const SpaceGrid& grid,
                   StageClock& clock, const CornerBox& within) {
  clock.start("crossings");
  CrossedEdges edges = list_crossings(grid);
  find_crossings(device, function, grid, edges);
  clock.start("mesh");
  DualMesh mesh = place_vertices(grid, edges, {});
  settle_vertices(device, function, mesh);
  join_vertices(grid, edges, mesh, within);
  return mesh;
}

Mesh to_world(const View& view, DualMesh made) {
  const std::size_t n = made.position.size();
  Mesh mesh;
  mesh.position.resize(n);
  mesh.normal.resize(n);
  parallel_for(n, 4096, [&](std::size_t begin, std::size_t end) {
    for (std::size_t v = begin; v < end; ++v) {
      mesh.position[v] = static_cast<Vec3>(world_from_eye(view, made.position[v]));
      mesh.normal[v] = static_cast<Vec3>(made.normal[v]);
    }
  });
  mesh.triangle = std::move(made.triangle);
  return mesh;
}

Extraction run_closed(Device& device, const View& view, const WorldParticles& particles,
                      const ClosedParams& closed, const Parameters& params,
                      std::vector<StageTime>* timings) {
  StageClock clock(device, timings);
  // Eye space is the world's axes: stages that need no pixels take it as any other.
  return mesh_fluid(device,
                    place_fluid(view, params, clock,
                                [&](const View& in) { return place_particles(in, particles); }),
                    particles, closed, params, clock);
}

Extraction run_closed(Device& device, const View& view, const WorldParticles& particles,
                      const ClosedParams& closed, const Parameters& params,
                      const Disorder& disorder, std::vector<StageTime>* timings) {
  StageClock clock(device, timings);
  clock.start("project");
  const View in_its_unit = coarser(view, disorder.unit());
  Projected placed = place_particles(in_its_unit, particles);
  clock.start("relax");
  even_out(placed, disorder);
  return mesh_fluid(device, evened_fluid(in_its_unit, disorder, std::move(placed)), particles,
                    closed, params, clock);
}

}  // namespace meniscus
