// The records of kernels/records.h: values of several numbers that kernels take as one argument.
#pragma once

#include <cstdint>
#include <type_traits>

namespace meniscus::records {

using uint = std::uint32_t;

#define RECORD(name) struct name
#include "../../kernels/records.h"
#undef RECORD
inline constexpr float kOnEdge = ON_EDGE, kEnded = ENDED, kPassed = PASSED, kSteep = STEEP,
                       kFitReach = FIT_REACH, kWhitewaterMost = WHITEWATER_MOST,
                       kRoundest = ROUNDEST, kDensitySupport = DENSITY_SUPPORT,
                       kMotionSupport = MOTION_SUPPORT;
#undef ON_EDGE
#undef ENDED
#undef PASSED
#undef STEEP
#undef FIT_REACH
#undef WHITEWATER_MOST
#undef ROUNDEST
#undef DENSITY_SUPPORT
#undef MOTION_SUPPORT

/// Whether a record has the same layout on every device: plain, and all members have four bytes.
template <class T>
inline constexpr bool is_record =
    std::is_class_v<T>&& std::is_trivially_copyable_v<T>&& std::is_standard_layout_v<T> &&
    alignof(T) == 4;

}  // namespace meniscus::records
