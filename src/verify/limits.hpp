// What a device can do at most: tried, not believed.
#pragma once

#include <cstddef>
#include <functional>

#include "device/device.hpp"
#include "verify/row.hpp"

namespace meniscus::verify {

/// Tries the largest buffer, local memory and work-group, and measures what a build, a launch and a
/// transfer cost. A limit below what the device claims is a failed row, required only where it is
/// below what Meniscus needs: buffers of 16 MiB, work-groups of one. The reasons say the figures.
///
///   full  buffers up to half of the host's free memory; else up to 256 MiB
void probe_limits(Device& device, bool full, const Report& report);

/// The largest n in (0, most] for which works(n) is true, where it is for every smaller one; 0 when
/// it is for none. Tries `most` first and stops when it knows n to within `step`.
std::size_t largest_that_works(std::size_t most, std::size_t step,
                               const std::function<bool(std::size_t)>& works);

}  // namespace meniscus::verify
