// Numbers as people read them.
#pragma once

#include <string>

#include "grouped.hpp"
#include "kernels/results.hpp"

namespace meniscus::bench {

/// printf into a string.
[[gnu::format(printf, 1, 2)]] std::string printed(const char* format, ...);

/// Three significant digits: "0.0123", "4.56", "789".
std::string three_digits(double value);

/// "634 M", "1.2 G".
std::string with_prefix(double value);

/// "256 KiB".
std::string size_of(double bytes);

/// "45.1 GB/s in 256 KiB, ...; 207 GFLOP/s fused, ...": a session's roofline in words.
std::string roofline_line(const Roofline& roofline);

/// What to hold against a session's times: that other work ran beside; empty: nothing.
std::string warning_on(const Session& session);

}  // namespace meniscus::bench
