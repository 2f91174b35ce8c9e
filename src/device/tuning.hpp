// How a device's kernels are launched fastest: measured by `meniscus tune`, kept on disk. No choice
// changes a bit of any result.
#pragma once

#include <cstddef>

#include "meniscus/device.hpp"

namespace meniscus {

/// What is chosen for a device.
struct Tuning {
  int vector_width = 1;    // pixels or groups that a work-item of a loop-heavy kernel takes: 1 or 8
  std::size_t group = 64;  // work-items in a group of a row of them, a power of two
  bool operator==(const Tuning&) const = default;
};

/// What suits devices of its kind. rusticl's llvmpipe ends all loops of a work-item after 65,535
/// rounds, so that one must not do much.
Tuning default_tuning(const DeviceInfo& info);

/// What was kept for this device, driver and version of Meniscus; without that, default_tuning.
Tuning tuning_of(const DeviceInfo& info);

/// Keeps it beside the built programs (program_cache.hpp). False: it cannot be written there.
bool keep_tuning(const DeviceInfo& info, const Tuning& tuning);
void forget_tuning(const DeviceInfo& info);

}  // namespace meniscus
