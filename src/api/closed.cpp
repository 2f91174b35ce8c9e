// The second door: all of the fluid, without a camera.
#include "meniscus/closed.hpp"

#include <algorithm>
#include <cmath>
#include <optional>
#include <utility>

#include "api/host_threads.hpp"
#include "base/parallel.hpp"
#include "base/printed.hpp"
#include "base/team.hpp"
#include "device/device.hpp"
#include "device/stage_clock.hpp"
#include "meniscus/device.hpp"
#include "methods/closed.hpp"
#include "methods/closed_parts.hpp"
#include "methods/closed_steps.hpp"
#include "output/simplify.hpp"
#include "output/straighten.hpp"
#include "output/to_world.hpp"
#include "prepare/even_parts.hpp"
#include "prepare/fill.hpp"
#include "prepare/parts.hpp"
#include "prepare/sampled_disorder.hpp"
#include "stages/closed/space_grid.hpp"

namespace meniscus {
namespace {

constexpr double kLeastCell = 0.1, kMostCell = 4, kMostAdaptive = 1;  // particle radii

void check_range(const char* name, double value, double least, double most) {
  if (value >= least && value <= most) return;
  throw InvalidArgument({.code = Code::parameter_out_of_range,
                         .text = setting(name) + printed(" is %g, must be %g to %g particle radii",
                                                         value, least, most),
                         .subject = name,
                         .found = value,
                         .wanted = value < least ? least : most});
}

// What is asked of a frame: a mesh.
Parameters of_meshes(const Parameters& parameters) {
  Parameters params = parameters;
  params.image = false;
  params.mesh = true;
  check(params);
  if (params.method != Method::fit)
    throw InvalidArgument("a closed mesh is made by method fit, not by " +
                          to_string(params.method));
  return params;
}

// Where cells are, around the origin; particle radii.
double farthest_of(const ClosedParams& closed) {
  return farthest_point(band_of(closed.cell), closed.cell);
}

// What is left of so many bytes beside places that are held: half of them at least.
std::size_t left_beside(const EvenedPlaces& places, std::size_t memory) {
  return memory - std::min(memory / 2, 3 * sizeof(float) * places.x.size());
}

// A frame that streams, in parts where it is large or several processes share it.
Surface mesh_parts(const Filling& filling, const ParticleSource& source, const ClosedParams& closed,
                   std::vector<StageTime>* timings) {
  const Parameters& params = filling.params;
  Team& team = source.team();
  const double block = kBlockSide * closed.cell;
  const PartedFrame frame = survey_parts(filling, source, block, farthest_of(closed));
  filling.clock.start("relax");
  const Disorder disorder = find_disorder(source, frame.view, params);
  filling.clock.stop();
  const double halo = halo_of_parts(closed.cell, params, disorder);
  std::vector<BlockBox> parts = share_parts(filling.memory, frame, block, halo, team.size());
  std::vector<PartTally> tallies(parts.size());
  const auto report_all = [&] {
    report(team.size() == 1 ? tallies : team.joined(tallies), frame, filling.notices);
  };
  std::optional<EvenedPlaces> evened;
  if (parts.size() > 1 && disorder.amount > 0) {
    tallies.clear();
    evened = even_out_in_parts(filling, source, frame, disorder, block, tallies);
    report_all();
    parts = share_parts(left_beside(*evened, filling.memory), frame, block, halo, team.size());
  }
  const FillPart fill = [&](std::size_t part, const std::vector<SpaceBox>& boxes,
                            const SpaceBox& own) {
    PartTally tally;
    PlacedParticles filled = evened ? fill_part(filling, source, frame, boxes, *evened)
                                    : fill_part(filling, source, frame, boxes, own, tally);
    if (!evened && part < parts.size()) tallies[part] = tally;
    return filled;
  };
  // For the first process; the others get nothing.
  std::vector<SpaceBox> everything(static_cast<std::size_t>(team.size()), SpaceBox::nowhere());
  everything[0] = {};
  const bool carries = frame.moving || !source.attributes().empty();
  Extraction made;
  if (parts.size() == 1) {
    const WorldParticles particles = fill(0, everything, {}).particles;
    if (!evened) report_all();
    if (team.leads())
      made = run_closed(filling.device, frame.view, particles, closed, params, disorder, timings);
  } else {
    made = run_closed_in_parts(filling.device, frame.view, team, parts, fill, closed, params,
                               disorder, carries && frame.all_known, timings);
    if (!evened) report_all();
    // Where what some particles carry is not known, particles from anywhere may speak for them.
    if (carries && !frame.all_known) {
      const PlacedParticles all = fill(parts.size(), everything, {});
      if (team.leads())
        carry_values(filling.device, coarser(frame.view, disorder.unit()), all.placed,
                     all.particles, params, made);
    }
  }
  Surface surface;
  surface.particle_radius = frame.radius;
  if (!team.leads()) return surface;
  return to_world(filling.device, frame.view, std::move(made), std::move(surface), params,
                  filling.notices, timings);
}

Surface mesh_frame(const Filling& filling, const ParticleSource& source, const ClosedParams& closed,
                   std::vector<StageTime>* timings) {
  if (source.size() >= kStreamed) return mesh_parts(filling, source, closed, timings);
  const FilledFrame frame = fill_everything(filling, source, farthest_of(closed));
  Surface surface;
  surface.particle_radius = frame.radius;
  if (!source.team().leads()) return surface;
  return to_world(
      filling.device, frame.view,
      run_closed(filling.device, frame.view, frame.particles, closed, filling.params, timings),
      std::move(surface), filling.params, filling.notices, timings);
}

}  // namespace

void check(const ClosedParams& closed) {
  check_range("cell", closed.cell, kLeastCell, kMostCell);
  check_range("adaptive", closed.adaptive, 0, kMostAdaptive);
}

Surface extract_closed(Device& device, const ParticleSource& source, const ClosedParams& closed,
                       const Parameters& parameters, std::vector<StageTime>* timings) {
  check(closed);
  const Parameters params = of_meshes(parameters);
  if (const BorrowedParticles* const all = source.in_memory()) check(*all);
  const TimedKernels timed(device, timings != nullptr);
  StageClock clock(device, timings);
  device.state().told.clear();
  Notices notices([&device](const Notice& notice) { device.state().tell(notice); });
  const Camera none;
  const Filling filling{device, none, params, closed.memory, clock, notices};
  return on_threads(host_threads(device.info()), [&] {
    Surface surface = mesh_frame(filling, source, closed, timings);
    clock.start("straighten");
    straighten_edges(surface.mesh, closed.cell * surface.particle_radius, surface.particle_radius);
    clock.stop();
    if (closed.adaptive > 0) {
      clock.start("simplify");
      surface.mesh = simplify(std::move(surface.mesh), closed.adaptive, surface.particle_radius);
      clock.stop();
    }
    surface.notices = notices.all();
    return surface;
  });
}

Surface extract_closed(Device& device, const BorrowedParticles& particles,
                       const ClosedParams& closed, const Parameters& parameters,
                       std::vector<StageTime>* timings) {
  return extract_closed(device, *source_of(particles), closed, parameters, timings);
}

Surface extract_closed(Device& device, const Particles& particles, const ClosedParams& closed,
                       const Parameters& parameters, std::vector<StageTime>* timings) {
  check(particles);  // what is not borrowed, too
  return extract_closed(device, BorrowedParticles(particles), closed, parameters, timings);
}

}  // namespace meniscus
