// The second door: all of the fluid, without a camera.
#include "meniscus/closed.hpp"

#include <utility>

#include "base/parallel.hpp"
#include "base/printed.hpp"
#include "base/stage_clock.hpp"
#include "base/team.hpp"
#include "device/device.hpp"
#include "meniscus/device.hpp"
#include "methods/closed.hpp"
#include "output/to_world.hpp"
#include "prepare/fill.hpp"

namespace meniscus {
namespace {

constexpr double kLeastCell = 0.1, kMostCell = 4;  // particle radii

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

Surface mesh_frame(const Filling& filling, const ParticleSource& source, const ClosedParams& closed,
                   std::vector<StageTime>* timings) {
  const FilledFrame frame = fill_everything(filling, source);
  Surface surface;
  surface.particle_radius = frame.radius;
  surface.notices = std::move(filling.notices);
  if (!source.team().leads()) return surface;
  return to_world(
      filling.device, frame.view,
      run_closed(filling.device, frame.view, frame.particles, closed, filling.params, timings),
      std::move(surface), filling.params, timings);
}

}  // namespace

void check(const ClosedParams& closed) {
  if (closed.cell >= kLeastCell && closed.cell <= kMostCell) return;
  throw InvalidArgument({.code = Code::parameter_out_of_range,
                         .text = setting("cell") + printed(" is %g, must be %g to %g", closed.cell,
                                                           kLeastCell, kMostCell),
                         .subject = "cell",
                         .found = closed.cell,
                         .wanted = closed.cell < kLeastCell ? kLeastCell : kMostCell});
}

Surface extract_closed(Device& device, const ParticleSource& source, const ClosedParams& closed,
                       const Parameters& parameters, std::vector<StageTime>* timings) {
  check(closed);
  const Parameters params = of_meshes(parameters);
  if (const BorrowedParticles* const all = source.in_memory()) check(*all);
  const TimedKernels timed(device, timings != nullptr);
  StageClock clock(device, timings);
  std::vector<Notice> notices;
  const Camera none;
  const Filling filling{device, none, params, kStreamMemory, clock, notices};
  const DeviceInfo& info = device.info();
  return on_threads(info.is_part ? info.compute_units : 0,
                    [&] { return mesh_frame(filling, source, closed, timings); });
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
