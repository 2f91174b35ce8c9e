#include "meniscus/session.hpp"

#include <atomic>
#include <mutex>
#include <utility>

#include "api/extract_sparingly.hpp"
#include "base/team.hpp"

namespace meniscus {

struct Session::State {
  explicit State(Device opened) : device(std::move(opened)) {}
  Device device;
  std::mutex in_use;
  std::atomic<bool> cancelled{false};
};

namespace {

/// While it lives, each stage asks whether to go on.
class Watch {
 public:
  Watch(Device& device, const std::atomic<bool>& cancelled, const Session::Settings& settings)
      : device_(device) {
    device_.on_stage([&cancelled, &settings](const std::string& stage) {
      if (settings.progress) settings.progress(stage);
      if (cancelled) throw Cancelled("cancelled before stage " + stage);
    });
  }
  ~Watch() { device_.on_stage({}); }
  Watch(const Watch&) = delete;
  Watch& operator=(const Watch&) = delete;

 private:
  Device& device_;
};

}  // namespace

Session::Session(const std::string& selector) : Session(Device(selector)) {}
Session::Session(Device device) : state_(std::make_unique<State>(std::move(device))) {}
Session::~Session() = default;
Session::Session(Session&&) noexcept = default;
Session& Session::operator=(Session&&) noexcept = default;

Surface Session::extract(const ParticleSource& particles, const Camera& camera,
                         const Parameters& parameters, const Settings& settings,
                         std::vector<StageTime>* timings) {
  const std::lock_guard turn(state_->in_use);
  Device& device = state_->device;
  state_->cancelled = false;
  const Watch watch(device, state_->cancelled, settings);
  try {
    return meniscus::extract(device, particles, camera, parameters, timings, settings.memory);
  } catch (const OutOfDeviceMemory& error) {
    if (particles.team().size() > 1) throw;  // the others go on without this process
    return extract_sparingly(device, particles, camera, parameters, timings, settings.memory,
                             error);
  }
}

Surface Session::extract(const BorrowedParticles& particles, const Camera& camera,
                         const Parameters& parameters, const Settings& settings,
                         std::vector<StageTime>* timings) {
  check(camera);
  check(parameters);
  return extract(*source_of(particles), camera, parameters, settings, timings);
}

Surface Session::extract_closed(const ParticleSource& particles, const ClosedParams& closed,
                                const Parameters& parameters, const Settings& settings,
                                std::vector<StageTime>* timings) {
  const std::lock_guard turn(state_->in_use);
  state_->cancelled = false;
  const Watch watch(state_->device, state_->cancelled, settings);
  return meniscus::extract_closed(state_->device, particles, closed, parameters, timings);
}

void Session::draw_whitewater(const std::vector<WhitewaterSource>& sources,
                              const Parameters& parameters, Surface& surface,
                              const Settings& settings, std::vector<StageTime>* timings) {
  const std::lock_guard turn(state_->in_use);
  state_->cancelled = false;
  const Watch watch(state_->device, state_->cancelled, settings);
  meniscus::draw_whitewater(state_->device, sources, parameters, surface, timings, settings.memory);
}

void Session::cancel() { state_->cancelled = true; }

const DeviceInfo& Session::device() const { return state_->device.info(); }

}  // namespace meniscus
