// A run as one page that needs nothing else: style and pictures are part of it.
#pragma once

#include <string>
#include <vector>

#include "kernels/compare.hpp"
#include "kernels/results.hpp"

namespace meniscus::bench {

/// The page: verdicts as bars, a roofline plot for each session, all results, and the comparison
/// where `pairs` has one.
std::string to_html(const BenchRun& run, const std::vector<SessionPair>& pairs);

/// The roofline plot of a session as SVG: a dot for each kernel at its largest size, with its name,
/// and its smaller sizes as a trail; those of `near` are drawn as near the limit. Kernels that
/// compute nothing are left out.
std::string roofline_plot(const Session& session, const std::vector<std::string>& near);

}  // namespace meniscus::bench
