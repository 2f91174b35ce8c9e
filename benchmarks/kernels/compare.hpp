// Two runs, or two devices, against each other.
#pragma once

#include <string>
#include <vector>

#include "kernels/results.hpp"

namespace meniscus::bench {

/// One kernel at one size in two sessions.
struct Difference {
  Result before, after;
  /// The times' ratio, after over before: above 1 it became slower.
  double ratio() const { return after.best_ms() / before.best_ms(); }
  /// By how much the ratio may differ from 1 for no reason: both noises over the time before, but
  /// at least kLeastNoise.
  double noise() const;
  bool exceeds_noise() const;
  /// The same ratio of the native version, which has not changed: what it moves, the machine moved.
  /// Where a kernel has none, the median over the natives of the run; 0: there is none at all.
  double control = 0, control_noise = 0;
  /// Whether the control moved by more than its noise, so that the ratio tells nothing.
  bool is_undecided() const;
};

/// Runs of the same program differ by this much with where the system put it in memory.
inline constexpr double kLeastNoise = 0.02;

/// "faster", "slower", "within the noise" or "undecided"; of a native version "control moved".
const char* verdict_on(const Difference& difference);

/// The results of `after` whose kernel, variant and size `before` has, too.
std::vector<Difference> compare(const Session& before, const Session& after);

/// Pairs the sessions of two runs, each at most once: those of one device and number of threads,
/// then those of one number of threads, then the rest in order. Within one run, when `before` is
/// null: the first device with each of the others, on as many threads where there is such a
/// session.
struct SessionPair {
  const Session* before;
  const Session* after;
};
std::vector<SessionPair> pair_sessions(const BenchRun* before, const BenchRun& after);

/// Whether a run has a result of one of these kernels, at one of these sizes.
bool has_any(const BenchRun& run, const std::vector<std::string>& kernels,
             const std::vector<long long>& particles, int width, int height);

/// The sizes of a run's frames: "10,000 particles at 1024x768, 40,000 particles at 1024x768".
std::string sizes_of(const BenchRun& run);

/// "PoCL, 2 threads"; of a session from a file "old.json: PoCL, 2 threads".
std::string title_of(const Session& session);

}  // namespace meniscus::bench
