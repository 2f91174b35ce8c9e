#include "methods/layers.hpp"

#include <cmath>
#include <utility>

#include "base/parallel.hpp"
#include "stages/dual_mesh.hpp"
#include "stages/implicit.hpp"
#include "stages/roundness.hpp"
#include "stages/surface.hpp"
#include "stages/trust.hpp"
#include <cstdlib>

namespace meniscus {
namespace {
static double knob(const char* n, double d) { const char* v = getenv(n); return v ? atof(v) : d; }

// Particles of the surface with less u are not fitted, as in with_rim().
constexpr double kOpen = 0.5;

// How far beyond the screen particles count where the front was made from others: what is out of
// view seems to end there, and fits that lie at such an end must not reach the screen.
constexpr double kMargin = 16;

// Of the mesh, particle radii: its cells; how near to particles that see air their corners are
// asked at first; from which depth behind the front on its place matters.
constexpr double kCell = 2, kBand = 2, kBehindFront = 0.75;

constexpr double kLeastFluid = 1, kLeastAir = 8;

// The fit of every particle of the surface is much like those beside it. Of the particles that the
// front has not fitted one a cube of this side (particle radii) and side of the fluid is.
constexpr double kApart = 2.5;

// The cube of a point, and which of six ways its normal points.
std::uint64_t place_of(const Vec3d& at, const Vec3d& normal) {
  const double side = knob("LAPART", kApart);
  const auto coordinate = [&](double v) {
    return static_cast<std::uint64_t>(static_cast<std::int64_t>(std::floor(v / side)) + (1 << 19)) &
           0xfffff;
  };
  const double x = std::abs(normal.x), y = std::abs(normal.y), z = std::abs(normal.z);
  const int axis = x >= y && x >= z ? 0 : y >= z ? 1 : 2;
  const double along = axis == 0 ? normal.x : axis == 1 ? normal.y : normal.z;
  const std::uint64_t way = static_cast<std::uint64_t>(2 * axis + (along < 0 ? 1 : 0));
  return ((coordinate(at.x) << 20 | coordinate(at.y)) << 20 | coordinate(at.z)) << 3 | way;
}

Visible choose_hidden(const KnownFluid& known) {
  const SurfaceParticles& around = known.around;
  std::vector<std::uint64_t> taken;
  taken.reserve(known.fits.size());
  for (std::size_t k = 0; k < known.fits.size(); ++k)
    taken.push_back(place_of(known.fits.position[k], known.fits.normal[k]));
  std::sort(taken.begin(), taken.end());
  std::vector<std::pair<std::uint64_t, std::int32_t>> candidates;
  for (std::size_t k = 0; k < around.index.size(); ++k) {
    if (around.weight[k] < kOpen) continue;
    const Vec3d at = known.particles.eye(static_cast<std::size_t>(around.index[k]));
    candidates.emplace_back(place_of(at, around.normal[k]), around.index[k]);
  }
  std::sort(candidates.begin(), candidates.end());
  Visible hidden;
  auto next = taken.begin();
  for (std::size_t k = 0; k < candidates.size(); ++k) {
    const std::uint64_t place = candidates[k].first;
    if (k > 0 && candidates[k - 1].first == place) continue;
    while (next != taken.end() && *next < place) ++next;
    if (next != taken.end() && *next == place) continue;
    hidden.index.push_back(candidates[k].second);
  }
  std::sort(hidden.index.begin(), hidden.index.end());
  hidden.owned.assign(hidden.index.size(), 1);
  return hidden;
}

ParticleFits fit_hidden(Device& device, const KnownFluid& known, const Visible& hidden,
                        const Parameters& params) {
  const SurfaceParticles& around = known.around;
  const FitNeighbours trial =
      find_neighbours(device, known.particles, hidden.index, around.index, kTrialReach);
  const FitNeighbours neighbours =
      find_neighbours(device, known.particles, hidden.index, around.index, params.fit.support);
  const std::vector<float> roundness =
      knob("LROUND", 1) ? measure_roundness(device, known.particles, hidden, around, trial,
                                            params.fit, params.blend)
                        : std::vector<float>(hidden.index.size(), 0.0f);
  FitParams fit = params.fit;
  fit.passes = static_cast<int>(knob("LPASSES", fit.passes));
  return fit_particles(device, known.particles, hidden, around, neighbours, roundness, fit);
}

template <class T>
void append(std::vector<T>& to, const std::vector<T>& from) {
  to.insert(to.end(), from.begin(), from.end());
}

// Fits of the front and others, all of which count alike.
void join_fits(ParticleFits& fits, const ParticleFits& more) {
  append(fits.position, more.position);
  append(fits.normal, more.normal);
  append(fits.surface, more.surface);
  append(fits.support, more.support);
  append(fits.roundness, more.roundness);
  append(fits.edge, more.edge);
  append(fits.firmness, more.firmness);
  append(fits.spread, more.spread);
  append(fits.supporters, more.supporters);
  append(fits.foot, more.foot);
  append(fits.quadric, more.quadric);
  append(fits.residual, more.residual);
  if (!fits.extent.empty()) fits.extent.resize(fits.size(), 0);
  fits.visible.assign(fits.size(), 1);
}

// Whether where an edge crosses the surface matters: not in front of what the pixel shows, or there.
std::vector<std::uint32_t> list_hidden(const View& view, const std::vector<float>& front,
                                       const CrossedEdges& edges) {
  std::vector<std::uint32_t> hidden;
  const double behind = knob("LBEHIND", kBehindFront);
  for (std::size_t e = 0; e < edges.size(); ++e) {
    const Vec3d& at = edges.position[e];
    const PixelPosition p = project(view, at);
    if (-at.z > 0 && p.w > 0 && p.u >= 0 && p.v >= 0 && p.u < view.width && p.v < view.height) {
      const std::size_t pixel = static_cast<std::size_t>(p.v) * static_cast<std::size_t>(view.width) +
                                static_cast<std::size_t>(p.u);
      const Vec3d along = ray_direction(view, p.u, p.v);
      if (-at.z < front[pixel] / view.radius + behind && front[pixel] < kNoSurface &&
          dot(along, edges.normal[e]) < -knob("LFACING", .6) * length(along))
        continue;
    }
    hidden.push_back(static_cast<std::uint32_t>(e));
  }
  return hidden;
}

DualMesh close_surface(Device& device, const View& view, const std::vector<float>& front,
                       const KnownFluid& known, const ImplicitFunction& function,
                       const Parameters& params, StageClock& clock) {
  clock.start("corners");
  Points seeds;
  {
    const HostView gradients(device, known.field);
    seeds = near_air(known.host_cells, gradients.data());
  }
  ImplicitFunction field = function;
  if (knob("LFIELD", 1)) field.alone = true;
  SpaceGrid grid = grid_around(seeds, knob("LBAND", kBand), knob("LCELL", kCell));
  do {
    fill_corners(grid, [&](const Points& points) {
      return measure_implicit(device, field, points).value;
    });
  } while (want_closed(grid));
  clock.start("crossings");
  CrossedEdges edges = list_crossings(grid);
  if (knob("LOLD", 0)) {
  find_crossings(device, function, grid, (int)knob("LROUNDS",6), .004, edges);
  } else {
  guess_crossings(grid, edges);
  const std::vector<std::uint32_t> hidden = list_hidden(view, front, edges);
  measure_crossings(device, function, hidden, edges);
  }
  clock.start("mesh");
  DualMesh mesh = place_vertices(grid, edges, {0.05, knob("LMOSTOFF", 2), knob("LMARGIN", -0.5)});
  if (knob("LSETTLE", 0)) settle_vertices(device, function, mesh);
  join_vertices(grid, edges, mesh);
  drop_crumbs(mesh, kLeastFluid, kLeastAir);
  (void)params;
  return mesh;
}

}  // namespace

std::vector<float> front_of(Device& device, const View& view, const SurfaceBuffers& image) {
  const HostView depth(device, image.depth);
  std::vector<float> front(image.grid.size());
  for (std::size_t s = 0; s < front.size(); ++s) front[s] = world_depth(view, depth[s]);
  return front;
}

Layers find_layers(Device& device, const View& view, KnownFluid known,
                   const std::vector<float>& front, const Parameters& params, StageClock& clock) {
  clock.start("fit");
  const Visible hidden = choose_hidden(known);
  if (getenv("LVERB")) fprintf(stderr, "hidden %zu front %zu\n", hidden.index.size(), known.fits.size());
  const ParticleFits more = fit_hidden(device, known, hidden, params);
  clock.start("trust");
  append(known.trust, measure_trust(device, more, known.cells));
  join_fits(known.fits, more);
  distrust_gaps(device, known.cells, known.fits, known.trust);
  const ImplicitFunction function =
      make_implicit(device,
                    make_records(known.fits, known.trust, params.fit,
                                 kBlendReach * params.blend.radius),
                    known.levelled, params);
  const DualMesh mesh = close_surface(device, view, front, known, function, params, clock);
  clock.start("layers");
  Layers layers = trace_layers(view, mesh, front, params.layers);
  clock.stop();
  return layers;
}

Layers run_layers(Device& device, const View& view, const WorldParticles& particles,
                  const std::vector<float>& front, const Parameters& params,
                  std::vector<StageTime>* timings) {
  StageClock clock(device, timings);
  clock.start("project");
  const Projected placed = project_particles(device, view, particles, kMargin);
  if (placed.size() == 0) return trace_layers(view, {}, front, params.layers);
  clock.start("field");
  const Cells host_cells = make_cells(placed.x, placed.y, placed.z, kDensitySupport);
  const DeviceCells cells = upload_cells(device, host_cells);
  const Buffer<float> field = measure_gradients(device, cells, Measured::near_air);
  const DeviceCells levelled = level_cells(device, cells, field, params.region);
  clock.start("surface");
  FieldSurface found;
  {
    const HostView gradients(device, field);
    found = find_surface({}, host_cells, {gradients.data(), gradients.size()});
  }
  const SurfaceParticles around = with_normals(std::move(found), {}, {});
  return find_layers(device, view, {placed, host_cells, cells, levelled, field, around, {}, {}},
                     front, params, clock);
}

}  // namespace meniscus
