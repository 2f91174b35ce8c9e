// The closed surface: the steps of method fit (section 2 of the paper) without a camera. All
// particles of the surface get a quadric, not only those near the visible ones; the sampler of
// rays gives way to the implicit function at points in space, and the mesh of the screen to dual
// contouring (docs/mesh.md).
#include "methods/closed.hpp"

#include <utility>

#include "base/parallel.hpp"
#include "base/stage_clock.hpp"
#include "methods/methods.hpp"
#include "stages/dual_mesh.hpp"
#include "stages/implicit.hpp"
#include "stages/motion.hpp"
#include "stages/particle_fit.hpp"
#include "stages/roundness.hpp"
#include "stages/surface.hpp"
#include "stages/trust.hpp"

namespace meniscus {
namespace {

// Particles of the surface with less u are not fitted, as in with_rim().
constexpr double kOpen = 0.5;

// Corners of cells are asked this near to particles that see air; the surface is one particle
// radius outside them, and wherever else it goes more corners are asked for.
constexpr double kBand = 2;

// An edge's crossing is sought until F is this small, particle radii.
constexpr int kRounds = 6;
constexpr double kEnough = 0.004;

// Particle radii cubed. A lone particle is drawn as 4.2; a particle takes 8.
constexpr double kLeastFluid = 1, kLeastAir = 8;

// All that stand for the surface and are fitted.
Visible fitted_of(const FieldSurface& shell) {
  Visible fitted;
  for (std::size_t k = 0; k < shell.index.size(); ++k)
    if (shell.weight[k] >= kOpen) {
      fitted.index.push_back(shell.index[k]);
      fitted.owned.push_back(1);
    }
  return fitted;
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

// What is made of particles.
struct Closed {
  DualMesh mesh;  // in their eye space
  ParticleFits fits;
};

// Section 2 of the paper; cells of side `cell`, particle radii.
Closed close_surface(Device& device, const Projected& placed, double cell, const Parameters& params,
                     StageClock& clock) {
  // 2.1: the density field, and the particles of the surface.
  clock.start("field");
  const Cells host_cells = make_cells(placed.x, placed.y, placed.z, kDensitySupport);
  const DeviceCells cells = upload_cells(device, host_cells);
  const Buffer<float> field = measure_gradients(device, cells, Measured::near_air);
  const DeviceCells levelled = level_cells(device, cells, field, params.region);
  clock.start("surface");
  FieldSurface found;
  Points seeds;
  {
    const HostView gradients(device, field);
    found = find_surface({}, host_cells, {gradients.data(), gradients.size()});
    seeds = near_air(host_cells, gradients.data());
  }
  const Visible fitted = fitted_of(found);

  // 2.2, 2.3: a quadric around each of them.
  clock.start("fit");
  const FitNeighbours trial =
      find_neighbours(device, placed, fitted.index, found.index, kTrialReach);
  const FitNeighbours neighbours =
      find_neighbours(device, placed, fitted.index, found.index, params.fit.support);
  const SurfaceParticles around = with_normals(std::move(found), {}, {});
  const std::vector<float> roundness =
      measure_roundness(device, placed, fitted, around, trial, params.fit, params.blend);
  ParticleFits fits =
      fit_particles(device, placed, fitted, around, neighbours, roundness, params.fit);
  clock.start("trust");
  std::vector<double> trust = measure_trust(device, fits, cells);
  distrust_gaps(device, cells, fits, trust);
  const ImplicitFunction function = make_implicit(
      device, make_records(fits, trust, params.fit, kBlendReach * params.blend.radius), levelled,
      params);

  // 2.4: F at the corners of cells around the surface, and where their edges cross it.
  clock.start("corners");
  SpaceGrid grid = grid_around(seeds, std::max(kBand, 1.8 * cell), cell);
  do {
    fill_corners(grid, [&](const Points& points) {
      return measure_implicit(device, function, points).value;
    });
  } while (want_closed(grid));
  clock.start("crossings");
  CrossedEdges edges = list_crossings(grid);
  find_crossings(device, function, grid, kRounds, kEnough, edges);

  // 2.5
  clock.start("mesh");
  Closed made;
  made.mesh = place_vertices(grid, edges, {});
  settle_vertices(device, function, made.mesh);
  join_vertices(grid, edges, made.mesh);
  drop_crumbs(made.mesh, kLeastFluid, kLeastAir);
  made.fits = std::move(fits);
  return made;
}

}  // namespace

Extraction run_closed(Device& device, const View& view, const WorldParticles& particles,
                      const ClosedParams& closed, const Parameters& params,
                      std::vector<StageTime>* timings) {
  StageClock clock(device, timings);
  Extraction result;
  // Eye space is the world's axes: stages that need no pixels take it as any other.
  const Projected placed = place_particles(view, particles);
  result.counts.particles = static_cast<std::int64_t>(placed.size());
  if (placed.size() == 0) {
    result.counts.in_view = 0;  // which to_world() warns of
    return result;
  }

  Closed made = close_surface(device, placed, closed.cell, params, clock);
  result.mesh = to_world(view, std::move(made.mesh));
  result.counts.fits = static_cast<std::int64_t>(made.fits.size());
  result.residual = std::move(made.fits.residual);

  if (particles.moving || !particles.attributes.empty()) {
    clock.start("motion");
    carry_values(device, view, placed, particles, params, result);
  }
  clock.stop();
  return result;
}

}  // namespace meniscus
