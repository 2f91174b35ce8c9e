// Numbers and tables for people.
#pragma once

#include <cstdint>
#include <cstdio>
#include <string>
#include <vector>

#include "base/printed.hpp"
#include "meniscus/extract.hpp"
#include "program/cli/terminal.hpp"

namespace meniscus::cli {

/// Rows of timings that are no stages, beside kBuilding (stage_clock.hpp).
inline constexpr const char *kReading = "read", *kWriting = "write";

/// Lines of "what   text" on standard error; silent with -q.
class Talk {
 public:
  explicit Talk(bool quiet) : quiet_(quiet) {}
  void operator()(const char* what, const std::string& text) const {
    if (!quiet_) print_line(stderr, printed("%-10s %s", what, text.c_str()));
  }

 private:
  bool quiet_;
};

/// "35,937 particles, 3,125 visible, ...": all counts in one line.
std::string counts_line(const Counts& counts);

/// The stages with their times and sums, then the counts, as a table on standard output.
void print_timings(const std::vector<StageTime>& stages, const Counts& counts);

/// The most that the device's buffers and the program took at a time so far, on standard output.
void print_memory(std::uint64_t device_bytes, std::uint64_t host_bytes);

/// What one of several processes took for its share of the particles.
struct RankReport {
  double survey_ms = 0, fronts_ms = 0, select_ms = 0;  // wall time, waiting included
  double waited_ms = 0;                                // for other ranks and for messages
  double processor_ms = 0;                             // of all its threads, start to end
  std::uint64_t device_bytes = 0, host_bytes = 0;      // peaks
};

/// This process's stages so far, summed into a report.
RankReport report_of(const std::vector<StageTime>& stages, double waited_ms,
                     std::uint64_t device_bytes);

/// A table of the ranks' times and memory, in their order.
void print_ranks(const std::vector<RankReport>& ranks);

}  // namespace meniscus::cli
