// Runs the kernels' benchmarks on a device.
#pragma once

#include <functional>
#include <string>
#include <vector>

#include "kernels/results.hpp"

namespace meniscus::bench {

inline constexpr double kMostRepetitions = 100;

struct MeasureOptions {
  std::vector<std::string> kernels;  // parts of names; empty: all
  std::vector<long long> particles{10000, 40000, 160000};
  int width = 1024, height = 768;  // of the image, pixels
  int repetitions = 20;            // launches, at least
  double seconds = 0.3;            // of launches, but no more of them than kMostRepetitions
  /// Whether native versions that are not compiled for this processor run, too, a few times: no
  /// verdict is drawn from them, but they are the control where runs are compared.
  bool control = true;
  ProbeEffort probes;
  std::function<int()> stop{};  // the signal that asks to stop; 0: none yet. Empty: none ever
};

/// The names of the kernels that can be measured.
std::vector<std::string> kernel_names();

/// Those with one of the parts in their names; all where there are no parts.
std::vector<std::string> chosen_names(const std::vector<std::string>& parts);

/// Measures the roofline, before and after every chosen kernel at every size. Of a kernel: one
/// launch that is not timed, then launches one by one, in random order with those of the native
/// version, which runs with `threads` threads (0: not at all). See also `control`. A native version
/// whose result differs from the device's is left out, with a note.
///
///   say  receives a line on each kernel before it is measured
///
/// When `stop` asks for it, no other kernel is begun: the session has what was measured before,
/// with the first roofline, and says so.
///
/// Throws DeviceError, and InvalidArgument when no kernel has any of the names.
Session measure(Device& device, int threads, const MeasureOptions& options,
                const std::function<void(const std::string&)>& say);

}  // namespace meniscus::bench
