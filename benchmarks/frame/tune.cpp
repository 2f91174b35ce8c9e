#include "frame/tune.hpp"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <memory>
#include <vector>

#include "base/content_hash.hpp"
#include "device/device.hpp"
#include "meniscus/error.hpp"
#include "meniscus/extract.hpp"

namespace meniscus {
namespace {

constexpr double kGain = 0.03;  // of the default's time: more is worth a change

/// A way with the device that is opened for it.
struct Runner {
  Trial trial;
  std::unique_ptr<Device> device;
  std::uint64_t hash = 0;
  std::vector<double> times;  // of frames, ms

  Runner(const DeviceInfo& info, const Tuning& tuning) {
    trial.tuning = tuning;
    device = std::make_unique<Device>(info);
    device->state().vector_width = tuning.vector_width;
    device->state().row_group = tuning.group;
    device->state().discs = tuning.discs;
  }

  /// The first frame builds the kernels, and is not counted.
  void run(const FrameInput& frame, bool counts) {
    if (!trial.error.empty()) return;
    try {
      Parameters parameters;
      parameters.motion = false;
      const auto begin = std::chrono::steady_clock::now();
      const Surface surface = extract(*device, frame.particles, frame.camera, parameters);
      const std::chrono::duration<double, std::milli> ms = std::chrono::steady_clock::now() - begin;
      if (counts)
        times.push_back(ms.count());
      else
        hash = content_hash(surface);
    } catch (const Error& error) {
      trial.error = error.what();
    }
  }
};

// All ways, in turns, so that other work on the machine slows all of them.
void measure(std::vector<Runner>& runners, std::size_t first, const FrameInput& frame, int rounds,
             const std::function<void(const std::string&)>& say) {
  for (std::size_t k = first; k < runners.size(); ++k) {
    say(to_string(runners[k].trial.tuning));
    runners[k].run(frame, false);
    runners[k].trial.same_bits =
        runners[k].trial.error.empty() && runners[k].hash == runners[0].hash;
  }
  for (Runner& runner : runners) runner.times.clear();
  say("in turns");
  for (int round = 0; round < rounds; ++round)
    for (Runner& runner : runners) runner.run(frame, true);
  for (Runner& runner : runners) {
    std::vector<double>& times = runner.times;
    std::sort(times.begin(), times.end());
    runner.trial.ms = times.empty() ? INFINITY : times.front();
    // How far one frame alone spreads is not known: then no way is_faster.
    runner.trial.spread_ms =
        times.size() < 2 ? INFINITY
                         : times[std::max<std::size_t>(1, times.size() / 4)] - times.front();
  }
}

const Trial& fastest(const std::vector<Runner>& runners) {
  const Trial* best = &runners.front().trial;
  for (const Runner& runner : runners)
    if (runner.trial.error.empty() && runner.trial.same_bits && runner.trial.ms < best->ms)
      best = &runner.trial;
  return *best;
}

}  // namespace

bool is_faster(const Trial& trial, const Trial& usual) {
  const double gained = usual.ms - trial.ms;
  return gained > kGain * usual.ms && gained > trial.spread_ms + usual.spread_ms;
}

TuningRun tune(const DeviceInfo& info, const FrameInput& frame, int rounds,
               const std::function<void(const std::string&)>& say) {
  const Tuning usual = default_tuning(info);
  std::vector<Runner> runners;
  runners.emplace_back(info, usual);
  Tuning other = usual;
  other.vector_width = usual.vector_width == 8 ? 1 : 8;
  runners.emplace_back(info, other);
  measure(runners, 0, frame, rounds, say);
  if (!runners[0].trial.error.empty()) throw DeviceError(runners[0].trial.error);
  // Then one choice after the other, each with the best of those before.
  const auto try_also = [&](const std::vector<Tuning>& ways) {
    const std::size_t first = runners.size();
    for (const Tuning& way : ways) runners.emplace_back(info, way);
    measure(runners, first, frame, rounds, say);
  };
  other = fastest(runners).tuning;
  other.discs = other.discs == DiscForm::bins ? DiscForm::minima : DiscForm::bins;
  try_also({other});
  std::vector<Tuning> groups;
  for (const std::size_t group : {16u, 32u, 128u, 256u}) {
    if (group > info.largest_group) continue;
    groups.push_back(fastest(runners).tuning);
    groups.back().group = group;
  }
  try_also(groups);

  TuningRun run;
  for (const Runner& runner : runners) run.trials.push_back(runner.trial);
  const Trial& best = fastest(runners);
  run.best = is_faster(best, runners[0].trial) ? best.tuning : usual;
  return run;
}

std::string to_string(const Tuning& tuning) {
  return "width " + std::to_string(tuning.vector_width) + ", groups of " +
         std::to_string(tuning.group) + ", discs by " + to_string(tuning.discs);
}

}  // namespace meniscus
