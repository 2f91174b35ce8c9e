// A run as tables for the terminal.
#pragma once

#include <string>
#include <vector>

#include "kernels/compare.hpp"
#include "kernels/results.hpp"

namespace meniscus::bench {

/// Every result of every session.
std::string results_table(const BenchRun& run);

/// The verdict on each kernel, farthest from its limit first.
std::string verdict_table(const BenchRun& run);

/// The differences between paired sessions, and which of them exceed the noise.
std::string comparison_table(const std::vector<SessionPair>& pairs);

/// "45.1 GB/s in 256 KiB, ...; 207 GFLOP/s fused, ...": a session's roofline in words.
std::string roofline_line(const Roofline& roofline);

/// What makes a session's times or verdicts doubtful, a sentence each: other programs that ran
/// beside, threads that did not run at once, native versions that are no measure. `one_thread`: the
/// session of the same device with one thread; may be null.
std::vector<std::string> warnings_on(const Session& session, const Session* one_thread);

/// "device" or "native"; "native*" where that is not compiled for this processor.
std::string variant_text(const Session& session, const Result& result);

/// Whether kernels of a session were measured by native versions.
bool has_native(const Session& session);

/// Those that exceed the noise before those that do not.
std::vector<Difference> changed_first(std::vector<Difference> differences);

/// "80% of 511 GB/s", "95% of a launch, 2.1 us", "not counted" or "stage, wall time".
std::string share_text(const Result& result, const Share& share);

/// "roofline, after / before: copies 1.02, ...": how the limits of two sessions differ.
std::string roofline_ratio(const SessionPair& pair);

/// "3 of 28 kernel times changed by more than the noise": what a comparison comes to.
std::string change_summary(const std::vector<Difference>& differences);

/// The verdicts of one device, farthest from its limit first.
std::vector<Verdict> farthest_first(std::vector<Verdict> verdicts);

/// "40,000 particles at 1024x768": the frame that a result was measured on.
std::string frame_of(const Result& result);

/// Three digits, "-" where nothing was counted.
std::string count_text(double value);

/// What a comparison says that has nothing to compare.
inline constexpr const char* kNothingInCommon =
    "Nothing to compare: the runs have no kernel in common at the same number of particles and "
    "size of image (give the earlier run's --kernel, --particles and --size).";

/// "0.93", "-" for what was not measured.
std::string ratio_text(double ratio);

}  // namespace meniscus::bench
