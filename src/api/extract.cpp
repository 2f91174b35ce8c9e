// The one door: checks, a frame filled from whatever holds the particles, the method, and the way
// back to world space.
#include <cmath>
#include <utility>

#include "api/extract_sparingly.hpp"
#include "api/host_threads.hpp"
#include "api/pipeline.hpp"
#include "base/parallel.hpp"
#include "base/team.hpp"
#include "device/device.hpp"
#include "device/stage_clock.hpp"
#include "meniscus/device.hpp"
#include "meniscus/extract.hpp"
#include "methods/layers.hpp"
#include "output/spray.hpp"
#include "output/to_world.hpp"
#include "prepare/fill.hpp"

namespace meniscus {
namespace {

// Draws the frame's spray on the image, with what it carries.
void add_spray(Device& device, const FilledFrame& frame, Extraction& extraction) {
  SurfaceMap image = download(device, extraction.image);
  image.velocity = std::move(extraction.velocity);
  const std::vector<std::int32_t> shown = draw_spray(frame.view, frame.spray, image);
  for (std::size_t a = 0; a < frame.of_the_spray.size(); ++a)
    for (std::size_t s = 0; s < shown.size(); ++s) {
      if (shown[s] < 0) continue;
      const float value = frame.of_the_spray[a][static_cast<std::size_t>(shown[s])];
      extraction.attributes[a].values[s] = std::isnan(value) ? 0 : value;
    }
  extraction.image = upload(device, image);
  extraction.velocity = std::move(image.velocity);
}

// A frame that streams keeps what bears on the front; layers want all of it.
FilledFrame fill_for_layers(const Filling& filling, const ParticleSource& source, double radius) {
  Parameters params = filling.params;
  params.particle_radius = radius;
  params.motion = false;
  Notices told_before;
  return fill_whole_frame(
      {filling.device, filling.camera, params, filling.memory, filling.clock, told_before}, source);
}

Surface extract_frame(const Filling& filling, const ParticleSource& source,
                      std::vector<StageTime>* timings) {
  Device& device = filling.device;
  const Parameters& params = filling.params;
  FilledFrame frame = fill_frame(filling, source);
  Surface surface;
  surface.camera = filling.camera;
  surface.particle_radius = frame.radius;
  FilledFrame streamed;  // with all that streamed past the frame
  const bool layers_apart = params.layers > 0 && params.image && source.size() >= kStreamed;
  if (layers_apart) streamed = fill_for_layers(filling, source, frame.radius);
  if (!source.team().leads()) return surface;
  Parameters of_front = params;
  if (layers_apart) of_front.layers = 0;
  Extraction extraction = run_pipeline(device, frame.view, frame.particles, of_front, timings);
  frame.view = extraction.view;
  if (frame.all >= 0) {
    extraction.counts.particles = frame.all;
    extraction.counts.streamed = true;
  }
  if (frame.factor > 1) {
    filling.clock.start("spray");
    if (params.image) add_spray(device, frame, extraction);
    filling.clock.stop();
    for (float& residual : extraction.residual) residual *= static_cast<float>(frame.factor);
    extraction.counts.representatives = static_cast<std::int64_t>(frame.particles.x.size());
    extraction.counts.spray = static_cast<std::int64_t>(frame.spray.size());
  }
  if (layers_apart)
    extraction.layers =
        run_layers(device, streamed.view, streamed.particles,
                   front_of(device, frame.view, extraction.image, params.layers), params, timings);
  return to_world(device, frame.view, std::move(extraction), std::move(surface), params,
                  filling.notices, timings);
}

}  // namespace

Surface extract(Device& device, const ParticleSource& source, const Camera& camera,
                const Parameters& params, std::vector<StageTime>* timings, std::size_t memory) {
  device.state().told.clear();
  return extract_again(device, source, camera, params, timings, memory);
}

Surface extract_again(Device& device, const ParticleSource& source, const Camera& camera,
                      const Parameters& params, std::vector<StageTime>* timings,
                      std::size_t memory) {
  check(camera);
  check(params);
  if (const BorrowedParticles* const all = source.in_memory()) check(*all);
  const TimedKernels timed(device, timings != nullptr);
  StageClock clock(device, timings);
  Notices notices([&device](const Notice& notice) { device.state().tell(notice); });
  const Filling filling{device, camera, params, memory, clock, notices};
  Surface surface = on_threads(host_threads(device.info()),
                               [&] { return extract_frame(filling, source, timings); });
  surface.notices = notices.all();
  return surface;
}

Surface extract(Device& device, const BorrowedParticles& particles, const Camera& camera,
                const Parameters& params, std::vector<StageTime>* timings) {
  check(camera);
  check(params);
  return extract(device, *source_of(particles), camera, params, timings);
}

Surface extract(Device& device, const Particles& particles, const Camera& camera,
                const Parameters& params, std::vector<StageTime>* timings) {
  check(camera);
  check(params);
  check(particles);  // what is not borrowed, too
  return extract(device, BorrowedParticles(particles), camera, params, timings);
}

}  // namespace meniscus
