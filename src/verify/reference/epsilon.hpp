// The rounding that the references' error bounds are made of.
#pragma once

#include <cfloat>

namespace meniscus {

/// The largest relative error of one rounding to float.
inline constexpr double kEpsilon = FLT_EPSILON / 2;

}  // namespace meniscus
