// What a device can do at most: its roofline, measured.
#pragma once

#include <vector>

#include "device/device.hpp"

namespace meniscus {

/// A copy between two arrays, read and write counted.
struct CopyRate {
  double bytes = 0;     // of both arrays together
  double gb_per_s = 0;  // 1e9 bytes a second
};

struct Roofline {
  std::vector<CopyRate> copy;    // ascending sizes: what fits a cache, up to what does not
  double fused_gflops = 0;       // fused multiply-adds, two operations each
  double plain_gflops = 0;       // products and sums, not fused
  double launch_us = 0;          // a launch and the wait for it, wall time
  double batched_launch_us = 0;  // a launch among many with one wait, wall time
  double empty_kernel_us = 0;  // device time of a kernel that does nearly nothing; 0: not measured
  double spread_atomics = 0;   // atomic minima on a word each, 1e9 a second
  double contended_atomics = 0;  // all on one word, 1e9 a second

  /// What a copy of that many bytes in all reaches, GB/s: between the sizes measured, by the
  /// logarithm of the size.
  double bandwidth(double bytes) const;

  /// The higher of the two rates of arithmetic, GFLOP/s.
  double peak_gflops() const;
};

/// The better of each figure of two measurements on one device: other work only slows.
Roofline better_of(const Roofline& a, const Roofline& b);

/// What a launch costs by itself, wall time.
struct LaunchCost {
  double single_us = 0;   // a launch and the wait for it
  double batched_us = 0;  // a launch among many with one wait
};

/// The best of several tries. Throws DeviceError.
LaunchCost measure_launches(Device& device, int tries);

/// How much is measured; on a device with memory of its own also a copy of eight times the last
/// size.
struct ProbeEffort {
  std::vector<std::size_t> copy_bytes{std::size_t{1} << 18, std::size_t{1} << 21,
                                      std::size_t{1} << 24, std::size_t{1} << 27};
  std::size_t atomics = std::size_t{1} << 20;
  int arithmetic_rounds = 8;
  int tries = 20;         // at least; the best one counts
  double seconds = 0.15;  // of trying, at least
};

/// Measures with the kernels of probe.cl, by events. Sizes beyond the device's largest buffer are
/// left out. Throws DeviceError.
Roofline measure_roofline(Device& device, const ProbeEffort& effort = {});

}  // namespace meniscus
