// Numbers and tables for people.
#pragma once

#include <cstdint>
#include <cstdio>
#include <string>
#include <utility>
#include <vector>

#include "meniscus/meniscus.hpp"
#include "printed.hpp"

namespace meniscus::cli {

/// Lines of "what   text" on standard error; silent with -q.
class Talk {
 public:
  explicit Talk(bool quiet) : quiet_(quiet) {}
  void operator()(const char* what, const std::string& text) const {
    if (!quiet_) std::fprintf(stderr, "%-10s %s\n", what, text.c_str());
  }

 private:
  bool quiet_;
};

/// "35,937 particles, 3,125 visible, ...": all counts in one line.
std::string counts_line(const std::vector<std::pair<std::string, std::int64_t>>& counts);

/// The stages with their times and sums, then the counts, as a table on standard output.
void print_timings(const std::vector<StageTime>& stages,
                   const std::vector<std::pair<std::string, std::int64_t>>& counts);

/// The most that the device's buffers and the program took at a time so far, on standard output.
void print_memory(std::uint64_t device_bytes, std::uint64_t host_bytes);

}  // namespace meniscus::cli
