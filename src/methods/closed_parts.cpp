// The closed surface, a part of space after another (docs/mesh.md). A part is made of the particles
// in a box and of those around it that bear on what is in the box: what is farther away weighs
// nothing, so every sum is the same as over all particles.
//
// Three numbers are of the whole frame: what residual noise explains, the farthest reach of a fit,
// and how often corners were added until the surface was closed. All parts are made with what
// these nearly always are. Where the parts find others, all are made again with these.
#include "methods/closed_parts.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include "device/give_back.hpp"
#include "device/stage_clock.hpp"
#include "methods/closed_steps.hpp"
#include "methods/contour.hpp"
#include "stages/closed/crumbs.hpp"
#include "stages/fit/faces.hpp"
#include "stages/fit/roundness.hpp"
#include "stages/fit/trust.hpp"
#include "stages/frame/relax.hpp"

namespace meniscus {
namespace {

// How far around the corners where F is evaluated particles bear on it, step by step backwards; in
// the unit of length of the particles' disorder (relax.hpp).
struct Halo {
  double fitted;     // fits
  double tried;      // trial fits, which roundness follows from
  double particles;  // all
};

Halo halo_of(const Parameters& params, const Disorder& disorder) {
  constexpr double kRounding = 0.5;
  // Who sees the 27 cells around it filled is inside (measure_gradients()); a particle's levelled
  // weight and its normal follow from that. Crowds are counted in cubes of two radii, which must be
  // whole.
  constexpr double kField = 2 * kDensitySupport + 2;
  // F looks at fits as far as they reach from their feet, which lie within a radius of the surface
  // through the particle.
  const double counted = kBlendReach * params.blend.radius + 1 + std::abs(params.fit.offset);
  // The faces at a bevel follow from fits around it. Trust is a mean over a fit's sheet, of what
  // follows from the normals around.
  const double trusted = counted + kFaceReach + kTrustSheet + kEdgeReach;
  // These normals, and supports, follow from those of the pass before.
  const double fitted =
      trusted + (params.fit.passes - 1) * std::max<double>(fit_reach(params.fit), kResidualReach);
  // Their roundness is a mean over bent places of means over a sheet of what trial fits around say.
  const double tried = fitted + kBentReach + kEvidenceSheet + kEvidenceReach;
  const double surface = std::max(fitted + fit_reach(params.fit), tried + kTrialReach);
  return {fitted, tried, surface + kField + kRounding + filling_influence(disorder)};
}

// What is taken for known of the whole frame, or was found.
struct Known {
  double noise = kLeastNoise;
  double reach = 1;
  int rounds = kRoundsAround;  // at most
};

struct Made {
  std::vector<MeshPart> mesh;   // of its boxes
  std::vector<Mesh> carried;    // velocities and attributes of their vertices
  Mesh nothing;                 // of no vertices
  std::vector<float> residual;  // of its own fits before the last pass
  double reach = 1;             // of these, the farthest
  int rounds = 0;               // after which no more of its own corners were wanted
  std::int64_t particles = 0, fits = 0;
};

// One part of a frame of which this is known.
class PartMaker {
 public:
  PartMaker(Device& device, const View& view, const Disorder& disorder, double cell,
            std::size_t memory, const Parameters& params, bool carry, StageClock& clock)
      : device_(device),
        view_(view),
        disorder_(disorder),
        cell_(cell),
        memory_(memory),
        params_(params),
        carry_(carry),
        clock_(clock) {}

  Made make(const BlockBox& own, PlacedParticles part, const Known& known) const {
    const WorldParticles& particles = part.particles;
    Made made;
    if (carry_)
      for (const Attribute& attribute : particles.attributes)
        made.nothing.attributes.push_back({attribute.name, {}});
    const PlacedFluid placed = evened_fluid(view_, disorder_, std::move(part.placed));
    if (placed.particles.size() == 0) return made;
    const SpaceBox inside = space_of(own, cell_), evaluated = space_of(own, cell_, known.rounds);
    for (std::size_t i = 0; i < placed.particles.size(); ++i)
      made.particles += inside.holds(placed.particles.eye(i));
    FittedFluid fluid = fit(placed, evaluated, known);
    for (std::size_t k = 0; k < fluid.fits.size(); ++k)
      if (inside.holds(fluid.fits.position[k])) {
        ++made.fits;
        made.reach = std::max(made.reach, double{fluid.reach[k]});
        made.residual.push_back(fluid.rough[k]);
      }
    fluid.fits = {};
    give_back_idle(device_);
    const Contoured contoured{device_, fluid.function, fluid.seeds, cell_, clock_};
    for (const BlockBox& box : share_cells(contoured, own, memory_)) {
      made.mesh.push_back(mesh_box(contoured, box, known.rounds, made.rounds));
      if (carry_) made.carried.push_back(carried(placed.particles, particles, made.mesh.back()));
      clock_.stop();
      give_back_idle(device_);
    }
    return made;
  }

 private:
  FittedFluid fit(const PlacedFluid& placed, const SpaceBox& evaluated, const Known& known) const {
    const Halo halo = halo_of(params_, disorder_);
    FitScope scope;
    scope.tried = [box = evaluated.wider(halo.tried)](const Vec3d& at) { return box.holds(at); };
    scope.fitted = [box = evaluated.wider(halo.fitted)](const Vec3d& at) { return box.holds(at); };
    scope.noise = known.noise;
    scope.reach = known.reach;
    return fit_fluid(device_, placed, params_, clock_, scope);
  }

  Mesh carried(const Projected& placed, const WorldParticles& particles,
               const MeshPart& mesh) const {
    clock_.start("motion");
    Extraction carried;
    for (const Vec3d& at : mesh.position)
      carried.mesh.position.push_back(static_cast<Vec3>(world_from_eye(view_, at)));
    carry_values(device_, view_, placed, particles, params_, carried);
    carried.mesh.position = {};
    return std::move(carried.mesh);
  }

  Device& device_;
  const View& view_;
  const Disorder& disorder_;
  double cell_;
  std::size_t memory_;  // of the cells that are held at a time
  const Parameters& params_;
  bool carry_;
  StageClock& clock_;
};

// All parts: meshes in the first process of the team, the rest of this process's own.
struct Whole {
  std::vector<MeshPart> mesh;
  std::vector<Mesh> carried;
  std::vector<float> residual;
  double reach = 1;
  int rounds = 0;
  std::int64_t particles = 0, fits = 0;
};

// Moves what each process has of a vector to the first one's parts.
template <class Part, class T>
void gather(Team& team, std::vector<T>&& mine, std::vector<Part>& parts, std::vector<T> Part::*to) {
  team.gather(std::move(mine), [&](int rank, std::vector<T>&& values) {
    parts[static_cast<std::size_t>(rank)].*to = std::move(values);
  });
}

// Adds a box's mesh of each process.
void add_box(Team& team, MeshPart mesh, Mesh carried_by_own, Whole& whole) {
  const auto processes = static_cast<std::size_t>(team.size());
  std::vector<MeshPart> boxes(processes);
  gather(team, std::move(mesh.blocks), boxes, &MeshPart::blocks);
  gather(team, std::move(mesh.vertex), boxes, &MeshPart::vertex);
  gather(team, std::move(mesh.between), boxes, &MeshPart::between);
  gather(team, std::move(mesh.position), boxes, &MeshPart::position);
  gather(team, std::move(mesh.normal), boxes, &MeshPart::normal);
  gather(team, std::move(mesh.others), boxes, &MeshPart::others);
  gather(team, std::move(mesh.triangle), boxes, &MeshPart::triangle);
  std::vector<Mesh> carried(processes);
  gather(team, std::move(carried_by_own.velocity), carried, &Mesh::velocity);
  for (Attribute& attribute : carried_by_own.attributes)
    team.gather(std::move(attribute.values), [&](int rank, std::vector<float>&& values) {
      carried[static_cast<std::size_t>(rank)].attributes.push_back(
          {attribute.name, std::move(values)});
    });
  if (!team.leads()) return;
  for (MeshPart& box : boxes) whole.mesh.push_back(std::move(box));
  for (Mesh& box : carried) whole.carried.push_back(std::move(box));
}

// Adds the parts that the processes have made, whose boxes differ in number.
void add_parts(Team& team, Made made, Whole& whole) {
  whole.residual.insert(whole.residual.end(), made.residual.begin(), made.residual.end());
  whole.reach = std::max(whole.reach, made.reach);
  whole.rounds = std::max(whole.rounds, made.rounds);
  whole.particles += made.particles;
  whole.fits += made.fits;
  std::size_t boxes = 0;
  for (const std::size_t count : team.joined<std::size_t>({made.mesh.size()}))
    boxes = std::max(boxes, count);
  made.mesh.resize(boxes);
  made.carried.resize(boxes, made.nothing);
  for (std::size_t b = 0; b < boxes; ++b)
    add_box(team, std::move(made.mesh[b]), std::move(made.carried[b]), whole);
}

// Makes all parts, as many at a time as there are processes.
Whole make_parts(const PartMaker& maker, Team& team, const std::vector<BlockBox>& parts,
                 const FillPart& fill, double cell, double halo, const Known& known) {
  Whole whole;
  const auto processes = static_cast<std::size_t>(team.size());
  for (std::size_t first = 0; first < parts.size(); first += processes) {
    std::vector<SpaceBox> boxes(processes, SpaceBox::nowhere());
    for (std::size_t k = 0; k < processes && first + k < parts.size(); ++k)
      boxes[k] = space_of(parts[first + k], cell, known.rounds).wider(halo);
    const std::size_t part = std::min(first + static_cast<std::size_t>(team.rank()), parts.size());
    const bool any = part < parts.size();
    const SpaceBox own = any ? space_of(parts[part], cell) : SpaceBox::nowhere();
    add_parts(team, maker.make(any ? parts[part] : BlockBox{}, fill(part, boxes, own), known),
              whole);
  }
  return whole;
}

// What all parts found of the frame.
Known found_by_all(Team& team, Whole& whole) {
  Known found;
  found.noise = noise_of(team.joined(std::move(whole.residual)));
  whole.residual = {};
  found.reach = 1;
  found.rounds = 0;
  for (const double reach : team.joined<double>({whole.reach}))
    found.reach = std::max(found.reach, reach);
  for (const int rounds : team.joined<int>({whole.rounds}))
    found.rounds = std::max(found.rounds, rounds);
  return team.from_first(found);
}

// Makes all parts, again where the frame is not what it was taken for.
Whole make_whole(const PartMaker& maker, Team& team, const std::vector<BlockBox>& parts,
                 const FillPart& fill, double cell, double halo, const Parameters& params) {
  Known known;
  // Nearly always there is a fit that reaches as far as any can.
  known.reach = static_cast<float>(kBlendReach * params.blend.radius);
  for (;;) {
    Whole whole = make_parts(maker, team, parts, fill, cell, halo, known);
    const Known found = found_by_all(team, whole);
    const int rounds = enough_around(found.rounds);
    if (found.noise == known.noise && found.reach == known.reach && rounds <= known.rounds)
      return whole;
    known = {found.noise, found.reach, std::max(rounds, known.rounds)};
  }
}

std::int64_t sum_over(Team& team, std::int64_t own) {
  std::int64_t sum = 0;
  for (const std::int64_t one : team.joined<std::int64_t>({own})) sum += one;
  return sum;
}

// Puts what parts' vertices carry where the vertices are, of those that are kept.
template <class T, class Of>
std::vector<T> in_place(const JoinedMesh& joined, const std::vector<std::uint32_t>& kept,
                        std::size_t vertices, const Of& of_part) {
  std::vector<T> all(vertices), values(kept.size());
  for (std::size_t p = 0; p < joined.place.size(); ++p) {
    const std::vector<T>& of = of_part(p);
    for (std::size_t v = 0; v < of.size(); ++v) all[joined.place[p][v]] = of[v];
  }
  for (std::size_t v = 0; v < kept.size(); ++v) values[v] = all[kept[v]];
  return values;
}

// The velocities and attributes of all parts' vertices, those that are kept.
void carry_over(const std::vector<Mesh>& carried, const JoinedMesh& joined,
                const std::vector<std::uint32_t>& kept, std::size_t vertices, Mesh& mesh) {
  if (carried.empty()) return;
  if (std::any_of(carried.begin(), carried.end(),
                  [](const Mesh& part) { return !part.velocity.empty(); }))
    mesh.velocity = in_place<Vec3>(
        joined, kept, vertices, [&](std::size_t p) -> const auto& { return carried[p].velocity; });
  for (std::size_t a = 0; a < carried[0].attributes.size(); ++a) {
    const auto of_part = [&](std::size_t p) -> const auto& {
      return carried[p].attributes[a].values;
    };
    mesh.attributes.push_back(
        {carried[0].attributes[a].name, in_place<float>(joined, kept, vertices, of_part)});
  }
}

}  // namespace

double halo_of_parts(double cell, const Parameters& params, const Disorder& disorder) {
  return halo_of(params, disorder).particles * disorder.unit() + kRoundsAround * cell;
}

Extraction run_closed_in_parts(Device& device, const View& view, Team& team,
                               const std::vector<BlockBox>& parts, const FillPart& fill,
                               const ClosedParams& closed, const Parameters& params,
                               const Disorder& disorder, bool carry,
                               std::vector<StageTime>* timings) {
  StageClock clock(device, timings);
  const double unit = disorder.unit(), halo = halo_of(params, disorder).particles * unit;
  const View coarse = coarser(view, unit);
  const PartMaker maker(device, coarse, disorder, closed.cell / unit, closed.memory / 2, params,
                        carry, clock);
  Whole whole = make_whole(maker, team, parts, fill, closed.cell, halo, params);

  Extraction result;
  result.disorder = disorder;
  result.counts.particles = sum_over(team, whole.particles);
  result.counts.fits = sum_over(team, whole.fits);
  if (!team.leads()) return result;
  clock.start("join");
  JoinedMesh joined = join_parts(std::move(whole.mesh));
  const std::size_t vertices = joined.mesh.position.size();
  const std::vector<std::uint32_t> kept =
      drop_crumbs(joined.mesh, kLeastFluid, least_air(disorder));
  result.mesh = to_world(coarse, std::move(joined.mesh));
  if (carry) carry_over(whole.carried, joined, kept, vertices, result.mesh);
  clock.stop();
  return result;
}

}  // namespace meniscus
