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
};

/// Runs of the same program differ by this much with where the system put it in memory.
inline constexpr double kLeastNoise = 0.02;

/// "faster", "slower" or "within the noise".
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

/// "PoCL, 2 threads".
std::string title_of(const Session& session);

}  // namespace meniscus::bench
