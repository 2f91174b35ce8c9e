// A run as tables for the terminal.
#pragma once

#include <string>

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

/// What to hold against a session's times: that other work ran beside; empty: nothing.
std::string warning_on(const Session& session);

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
