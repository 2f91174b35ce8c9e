#include "meniscus/session.hpp"

#include <atomic>
#include <mutex>
#include <thread>
#include <utility>

#include "api/extract_sparingly.hpp"
#include "base/team.hpp"

namespace meniscus {

struct Session::State {
  explicit State(Device opened) : device(std::move(opened)) {}
  Device device;
  std::mutex in_use;
  std::atomic<std::thread::id> user{};  // whose turn it is; nobody's: the number of no thread
  std::atomic<bool> cancelled{false};
  const char* calling = "progress";  // the callback that ran last
};

namespace {

/// A thread's turn: while it lives, the session is its own, and each stage asks whether to go on.
template <typename State>
class Turn {
 public:
  Turn(State& state, const Session::Settings& settings) : state_(state) {
    if (state.user == std::this_thread::get_id())
      throw InvalidArgument(std::string("session: ") + state.calling +
                            " calls extract on the session that calls it (take another device)");
    lock_ = std::unique_lock(state.in_use);
    state.user = std::this_thread::get_id();
    state.cancelled = false;
    state.device.on_stage([&state, &settings](const std::string& stage) {
      state.calling = "progress";
      if (settings.progress) settings.progress(stage);
      if (state.cancelled) throw Cancelled("cancelled before stage " + stage);
    });
    if (settings.on_notice)
      state.device.on_notice([&state, &settings](const Notice& notice) {
        state.calling = "on_notice";
        settings.on_notice(notice);
      });
  }
  ~Turn() {
    state_.device.on_notice({});
    state_.device.on_stage({});
    state_.user = std::thread::id();
  }
  Turn(const Turn&) = delete;
  Turn& operator=(const Turn&) = delete;

 private:
  State& state_;
  std::unique_lock<std::mutex> lock_;
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
  const Turn turn(*state_, settings);
  Device& device = state_->device;
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
  const Turn turn(*state_, settings);
  return meniscus::extract_closed(state_->device, particles, closed, parameters, timings);
}

Surface Session::extract_closed(const BorrowedParticles& particles, const ClosedParams& closed,
                                const Parameters& parameters, const Settings& settings,
                                std::vector<StageTime>* timings) {
  const Turn turn(*state_, settings);
  return meniscus::extract_closed(state_->device, particles, closed, parameters, timings);
}

void Session::draw_whitewater(const std::vector<WhitewaterSource>& sources,
                              const Parameters& parameters, Surface& surface,
                              const Settings& settings, std::vector<StageTime>* timings) {
  const Turn turn(*state_, settings);
  meniscus::draw_whitewater(state_->device, sources, parameters, surface, timings, settings.memory);
}

void Session::cancel() { state_->cancelled = true; }

const DeviceInfo& Session::device() const { return state_->device.info(); }

}  // namespace meniscus
