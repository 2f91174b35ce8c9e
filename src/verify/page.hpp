// A run of verify as one page.
#pragma once

#include <string>

#include "verify/results.hpp"

namespace meniscus::verify {

/// The page: a verdict on each device, what failed, a matrix of kernels and devices, frames, probes
/// and limits side by side. It needs nothing else.
std::string to_html(const VerifyRun& run);

}  // namespace meniscus::verify
