// How a device's kernels are launched fastest: measured by `meniscus tune`, kept on disk. No choice
// changes a bit of any result.
#pragma once

#include <cstddef>

#include "meniscus/device.hpp"

namespace meniscus {

/// How discs and spheres are drawn into maps of samples. Both ways give the same bits.
enum class DiscForm {
  bins,    // bin by bin of samples, from lists of discs (bins.cl)
  minima,  // disc by disc, by atomic minima of the samples' depths (minima.cl)
};

/// "bins" or "minima".
const char* to_string(DiscForm form);

/// What is chosen for a device.
struct Tuning {
  int vector_width = 1;    // pixels or groups that a work-item of a loop-heavy kernel takes: 1 or 8
  std::size_t group = 64;  // work-items in a group of a row of them, a power of two
  DiscForm discs = DiscForm::bins;
  bool operator==(const Tuning&) const = default;
};

/// What suits devices of its kind: CPUs draw bin by bin, which a vector does at once, others by
/// atomic minima, which wait for no list. rusticl's llvmpipe ends all loops of a work-item after
/// 65,535 rounds, so that one must not do much.
Tuning default_tuning(const DeviceInfo& info);

/// What was kept for this device, driver and version of Meniscus; without that, default_tuning.
Tuning tuning_of(const DeviceInfo& info);

/// Keeps it beside the built programs (program_cache.hpp). False: it cannot be written there.
bool keep_tuning(const DeviceInfo& info, const Tuning& tuning);
void forget_tuning(const DeviceInfo& info);

}  // namespace meniscus
