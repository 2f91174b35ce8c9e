// What `bench` is asked for.
#pragma once

#include <array>
#include <string>
#include <vector>

namespace meniscus::cli {

struct BenchOptions {
  std::string device;                // as --device has it; "all": every usable one
  std::vector<std::string> kernels;  // parts of names; empty: all
  std::vector<long long> particles{10000, 40000, 160000};
  std::array<int, 2> size{1024, 768};  // pixels
  int threads = 0;                     // 0: one and all
  int repetitions = 20;
  std::string json, html;            // files; json "-" is standard output
  std::vector<std::string> compare;  // an earlier run; or two, and nothing is measured
  bool quiet = false, list = false;
  // For the child of a run:
  bool is_child = false;
  bool without_control = false;  // native versions that are no more than a control are left out
};

/// Measures the kernels and writes what was asked for. Returns the exit code: 128 + the signal
/// where one stopped it; then it writes what was measured before. Throws Error, and
/// CLI::ValidationError where an option names nothing that there is.
int bench_kernels(const BenchOptions& options);

}  // namespace meniscus::cli
