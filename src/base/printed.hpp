// Numbers as people read them.
#pragma once

#include <cstdint>
#include <string>

#include "base/grouped.hpp"

namespace meniscus {

/// printf into a string.
[[gnu::format(printf, 1, 2)]] std::string printed(const char* format, ...);

/// Three significant digits, and all before the point: "0.0123", "4.56", "789", "50,887".
std::string three_digits(double value);

/// "634 M", "1.20 G".
std::string with_prefix(double value);

/// 1.5e9 -> "1.4 GiB".
std::string size_of(std::uint64_t bytes);

/// "1:02:03", "2:03" or "45 s".
std::string duration(double seconds);

/// How fast frames come: "4.26 frames/s"; slower than one a second "3.70 s a frame", "1:02 a
/// frame".
std::string frame_rate(double frames_per_second);

}  // namespace meniscus
