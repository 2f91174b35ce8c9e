// The layers along rays: what the front knows of the fluid is used again, and no more is found out
// than exits need (docs/layers.md).
#include "methods/layers.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include "base/key_table.hpp"
#include "base/parallel.hpp"
#include "methods/closed_steps.hpp"
#include "methods/contour.hpp"
#include "methods/recorded_fits.hpp"
#include "stages/closed/crumbs.hpp"
#include "stages/closed/dual_faces.hpp"
#include "stages/closed/dual_vertices.hpp"
#include "stages/closed/implicit.hpp"
#include "stages/fit/roundness.hpp"
#include "stages/fit/trust.hpp"
#include "stages/frame/near_lists.hpp"
#include "stages/frame/relax.hpp"
#include "stages/sheet/surface.hpp"

namespace meniscus {
namespace {

// How far beyond the screen particles count where the front was made from others: what is out of
// view seems to end there, and fits that lie at such an end must not reach the screen.
constexpr double kMargin = 16;

// The mesh's cells, and how near to the surface's particles their corners are evaluated at first;
// particle radii.
constexpr double kCell = 2, kBand = 2;

// The field gives the cells that the surface passes through, the fits where it is: that may be up
// to two radii away, and in a cell beside it.
constexpr Placing kPlacing{.most_off = 2, .margin = -0.5, .quick = true};

// Crossings that lie less than this behind the front (particle radii) and face the eye by more than
// this cosine are the front itself. The mesh has nothing of cells that have no others: rays enter
// there, and the front shows where.
constexpr double kBehindFront = 0.75, kFacing = 0.2;

// The fit of every particle of the surface is much like those beside it where the surface is flat:
// a fit stands for the particles within this reach (particle radii) whose normals are like its own.
constexpr double kStandsFor = 4;

// Where normals of the field turn by less, 1 - cosine (11 degrees), the surface is flat; as far as
// roundness goes, on the mean. Those by more than 120 degrees off are of the other side.
constexpr double kFlat = 0.02, kOtherSide = -0.5;

// What the front shows to be creases is creases behind it, too: it is not measured how round it
// is where fewer than this share of the front's bends are round, each by 1 / (d^2 + reach^2)^2 of
// its distance d. They are summed up in cubes.
constexpr double kMostRound = 0.5, kBendReach = 16, kBendCube = 16;
constexpr std::size_t kGrain = 256;  // particles, crossings that are worth a thread

// A cube of space that holds a place, in one number.
std::uint64_t cube_of(const Vec3d& at, double side) {
  const auto part = [&](double along) {
    return static_cast<std::int32_t>(std::clamp(std::floor(along / side), -1e6, 1e6));
  };
  return key_of({part(at.x), part(at.y), part(at.z)});
}

// The particles to fit where the front has no fits: one after the other, but for those that a
// fitted one stands for.
Visible choose_hidden(const KnownFluid& known, const Cells& cells) {
  const SurfaceParticles& around = known.around;
  std::vector<char> is_fitted(around.index.size());
  for (const std::int32_t place : places_in(around.index, known.fitted))
    is_fitted[static_cast<std::size_t>(place)] = 1;
  std::vector<std::size_t> places;
  std::vector<std::int32_t> unfitted;
  for (std::size_t k = 0; k < around.index.size(); ++k) {
    if (is_fitted[k] || around.weight[k] < kLeastSurface) continue;
    places.push_back(k);
    unfitted.push_back(around.index[k]);
  }
  const NearLists near = list_near(known.particles, unfitted, cells, kStandsFor);
  Visible hidden;
  for (std::size_t k = 0; k < unfitted.size(); ++k) {
    const Vec3d& normal = around.normal[places[k]];
    const auto speaks = [&](cl_int other) {
      const auto place = static_cast<std::size_t>(other);
      return is_fitted[place] && dot(normal, around.normal[place]) > 1 - kFlat;
    };
    if (std::ranges::any_of(near[k], speaks)) continue;
    is_fitted[places[k]] = 1;
    hidden.index.push_back(unfitted[k]);
  }
  hidden.owned.assign(hidden.index.size(), 1);
  return hidden;
}

// What the front knows of the bends in a cube of space. A crease's fits have low edges.
struct FrontBends {
  Vec3d centre;
  double round = 0, all = 0;
};

std::vector<FrontBends> bends_of(const ParticleFits& front) {
  KeyTable cubes;
  std::vector<FrontBends> bends;
  for (std::size_t k = 0; k < front.size(); ++k) {
    const double round = front.roundness[k], bend = std::max(round, 1 - front.edge[k]);
    if (bend <= 0) continue;
    const Vec3d& at = front.position[k];
    const std::uint32_t cube = cubes.add(cube_of(at, kBendCube));
    if (cube == bends.size()) bends.emplace_back();
    bends[cube].centre += at * bend;
    bends[cube].round += round;
    bends[cube].all += bend;
  }
  for (FrontBends& cube : bends) cube.centre = cube.centre / cube.all;
  return bends;
}

// Whether the front's bends are creases around a place, most of them.
bool is_among_creases(const std::vector<FrontBends>& bends, const Vec3d& at) {
  double round = 0, all = 0;
  for (const FrontBends& cube : bends) {
    const Vec3d to = cube.centre - at;
    const double far = dot(to, to) + kBendReach * kBendReach, weight = 1 / (far * far);
    round += weight * cube.round;
    all += weight * cube.all;
  }
  return round < kMostRound * all;
}

// Those of them that may be round: about which normals turn, and not among creases. The fits behind
// the front are few, and two sheets of few fits follow a crease badly: their trials alone take it
// for round.
Visible choose_bent(const KnownFluid& known, const Cells& cells, const Visible& hidden) {
  const SurfaceParticles& around = known.around;
  const NearLists near = list_near(known.particles, hidden.index, cells, kEvidenceReach);
  const std::vector<std::int32_t> places = places_in(around.index, hidden.index);
  const auto turn_at = [&](std::size_t k) {
    const auto own = static_cast<std::size_t>(places[k]);
    const Vec3d at = known.particles.eye(static_cast<std::size_t>(around.index[own]));
    double all = 0, turn = 0;
    for (const cl_int j : near[k]) {
      const auto other = static_cast<std::size_t>(j);
      const Vec3d to = known.particles.eye(static_cast<std::size_t>(around.index[other])) - at;
      const double cosine = dot(around.normal[own], around.normal[other]);
      if (cosine < kOtherSide) continue;
      const double near_by =
          std::max(0.0, 1 - dot(to, to) / (double{kEvidenceReach} * kEvidenceReach));
      const double weight = around.weight[other] * near_by * near_by * near_by;
      all += weight;
      turn += weight * (1 - cosine);
    }
    return turn / all;  // the particle itself counts
  };
  const std::vector<FrontBends> bends = bends_of(known.fits);
  std::vector<char> is_bent(hidden.index.size());
  parallel_for(is_bent.size(), kGrain, [&](std::size_t begin, std::size_t end) {
    for (std::size_t k = begin; k < end; ++k) {
      const auto particle = static_cast<std::size_t>(hidden.index[k]);
      is_bent[k] = turn_at(k) > kFlat && !is_among_creases(bends, known.particles.eye(particle));
    }
  });
  Visible bent;
  for (std::size_t k = 0; k < is_bent.size(); ++k)
    if (is_bent[k]) bent.index.push_back(hidden.index[k]);
  bent.owned.assign(bent.index.size(), 1);
  return bent;
}

// Most particles around hidden fits have no fit, and normals as rough as they came, as around
// groups: hidden fits are not firm, as those of groups of one.
ParticleFits fit_hidden(Device& device, const KnownFluid& known, const Parameters& params) {
  const SurfaceParticles& around = known.around;
  const Cells cells =
      cells_of(known.particles, around.index, std::max(kStandsFor, double{kEvidenceReach}));
  const Visible hidden = choose_hidden(known, cells);
  const FitNeighbours neighbours =
      find_neighbours(device, known.particles, hidden, around.index, fit_reach(params.fit));
  const TrialPlaces trials =
      find_trials(device, known.particles, choose_bent(known, cells, hidden), around.index);
  const FitSurface surface = upload_surface(device, known.particles, around);
  measure_roundness(device, surface, trials, params.fit, params.blend, params.disorder);
  const std::vector<double> of_groups(hidden.index.size(), 0);
  DeviceFits fits = make_fits(device, surface, known.particles, hidden, around, neighbours,
                              params.fit, of_groups);
  measure_surroundings(device, known.cells, fits);
  return download(device, std::move(fits));
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

// Where a crossing lies on the screen, and in which pixel.
struct PixelOf {
  static constexpr std::size_t kNowhere = ~std::size_t{0};
  PixelPosition at{};
  std::size_t pixel = kNowhere;
};

PixelOf find_pixel(const View& view, const Vec3d& at) {
  const PixelPosition p = project(view, at);
  if (!(-at.z > 0 && p.w > 0 && p.u >= 0 && p.v >= 0 && p.u < view.width && p.v < view.height))
    return {};
  return {p, static_cast<std::size_t>(p.v) * static_cast<std::size_t>(view.width) +
                 static_cast<std::size_t>(p.u)};
}

// The crossings that are not the front itself. Those that are get their normals.
std::vector<std::uint32_t> list_hidden(const View& view, const std::vector<float>& front,
                                       const SpaceGrid& grid, CrossedEdges& edges) {
  std::vector<PixelOf> place(edges.size());
  std::vector<float> shown(edges.size());
  std::vector<char> is_front(edges.size());
  parallel_for(edges.size(), kGrain, [&](std::size_t begin, std::size_t end) {
    for (std::size_t e = begin; e < end; ++e) place[e] = find_pixel(view, edges.position[e]);
    // Pixels lie far from each other in memory: a loop that does nothing else waits for many at
    // once.
    for (std::size_t e = begin; e < end; ++e)
      shown[e] = place[e].pixel == PixelOf::kNowhere ? kNoSurface : front[place[e].pixel];
    for (std::size_t e = begin; e < end; ++e) {
      if (shown[e] == kNoSurface || !(-edges.position[e].z < shown[e] / view.radius + kBehindFront))
        continue;
      edges.normal[e] = guess_normal(grid, edges, e);
      const Vec3d along = ray_direction(view, place[e].at.u, place[e].at.v);
      is_front[e] = dot(along, edges.normal[e]) < -kFacing * length(along);
    }
  });
  std::vector<std::uint32_t> hidden;
  hidden.reserve(edges.size());
  for (std::size_t e = 0; e < edges.size(); ++e)
    if (!is_front[e]) hidden.push_back(static_cast<std::uint32_t>(e));
  return hidden;
}

// The surface's particles, but for strays that lie so far away that no mesh reaches them.
Points seeds_of(const KnownFluid& known) {
  const double farthest = farthest_point(kBand, kCell);
  Points seeds;
  for (const std::int32_t i : known.around.index) {
    const Vec3d at = known.particles.eye(static_cast<std::size_t>(i));
    if (std::max({std::abs(at.x), std::abs(at.y), std::abs(at.z)}) <= farthest) seeds.add(at);
  }
  return seeds;
}

// 2.4 and 2.5: the mesh that rays leave, open where the front shows all of it.
DualMesh mesh_behind(Device& device, const View& view, const std::vector<float>& front,
                     const KnownFluid& known, const ImplicitFunction& function,
                     const Disorder& disorder, StageClock& clock) {
  clock.start("corners");
  ImplicitFunction field = function;
  field.alone = true;
  SpaceGrid grid = grid_around(seeds_of(known), kBand, kCell);
  close_grid(device, field, grid);
  clock.start("crossings");
  CrossedEdges edges = list_crossings(grid);
  guess_crossings(grid, edges);
  const std::vector<std::uint32_t> hidden =
      of_same_cells(grid, edges, list_hidden(view, front, grid, edges));
  measure_crossings(device, function, hidden, edges);
  clock.start("mesh");
  DualMesh mesh = place_vertices(grid, edges, hidden, kPlacing);
  join_vertices(grid, edges, hidden, mesh);
  drop_crumbs(mesh, kLeastFluid, least_air(disorder));
  return mesh;
}

}  // namespace

std::vector<float> front_of(Device& device, const View& view, const SurfaceBuffers& image,
                            int layers) {
  const HostView depth(device, image.depth);
  std::vector<float> front;
  front.reserve(image.grid.size() * static_cast<std::size_t>(layers));
  front.resize(image.grid.size());
  for (std::size_t s = 0; s < front.size(); ++s) front[s] = world_depth(view, depth[s]);
  return front;
}

Layers find_layers(Device& device, const View& view, KnownFluid known, std::vector<float> front,
                   const Parameters& params, StageClock& clock) {
  clock.start("fit");
  const ParticleFits more = fit_hidden(device, known, params);
  clock.start("trust");
  append(known.trust, trust_of(more, params.disorder));
  join_fits(known.fits, more);
  const ImplicitFunction function = make_implicit(
      device, record_fits(known.fits, known.trust, params).records, known.levelled, params);
  const DualMesh mesh =
      mesh_behind(device, view, front, known, function, {.amount = params.disorder}, clock);
  clock.start("layers");
  Layers layers = trace_layers(view, mesh, std::move(front), params.layers);
  clock.stop();
  return layers;
}

Layers run_layers(Device& device, const View& view, const WorldParticles& particles,
                  std::vector<float> front, const Parameters& given,
                  std::vector<StageTime>* timings) {
  StageClock clock(device, timings);
  const PlacedFluid fluid = place_fluid(view, given, clock, [&](const View& in) {
    return project_particles(in, particles, kMargin);
  });
  const auto& [in, disorder, placed, host_cells] = fluid;
  if (placed.size() == 0) return trace_layers(view, {}, std::move(front), given.layers);
  const Parameters params = for_disorder(given, disorder);
  clock.start("field");
  const auto [cells, levelled, field] = measure_field(device, fluid, given.region);
  clock.start("surface");
  FieldSurface found;
  {
    const HostView gradients(device, field);
    found = find_surface({}, host_cells, {gradients.data(), gradients.size()}, params.disorder);
  }
  const SurfaceParticles around = with_normals(std::move(found), {}, {});
  return find_layers(device, in, {placed, cells, levelled, around, {}, {}, {}}, std::move(front),
                     params, clock);
}

}  // namespace meniscus
