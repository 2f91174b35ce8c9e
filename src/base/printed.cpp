#include "base/printed.hpp"

#include <algorithm>
#include <cmath>
#include <cstdarg>
#include <cstdio>

namespace meniscus {

std::string printed(const char* format, ...) {
  std::va_list arguments, again;
  va_start(arguments, format);
  va_copy(again, arguments);
  std::string text(static_cast<std::size_t>(std::vsnprintf(nullptr, 0, format, arguments)), '\0');
  std::vsnprintf(text.data(), text.size() + 1, format, again);
  va_end(arguments);
  va_end(again);
  return text;
}

std::string three_digits(double value) {
  if (value == 0 || !std::isfinite(value)) return printed("%g", value);
  if (std::abs(value) >= 1e15) return printed("%.2e", value);
  if (std::abs(value) >= 999.5) return grouped(std::llround(value));
  const int decimals = 2 - static_cast<int>(std::floor(std::log10(std::abs(value))));
  return printed("%.*f", std::max(0, std::min(decimals, 6)), value);
}

std::string with_prefix(double value) {
  constexpr const char* kPrefixes[] = {"", " k", " M", " G", " T"};
  int prefix = 0;
  for (; value >= 999.5 && prefix < 4; ++prefix) value /= 1000;
  return three_digits(value) + kPrefixes[prefix];
}

std::string size_of(std::uint64_t bytes) {
  constexpr const char* kUnits[] = {"B", "KiB", "MiB", "GiB", "TiB"};
  auto value = static_cast<double>(bytes);
  int unit = 0;
  for (; value >= 1024 && unit < 4; ++unit) value /= 1024;
  return printed(value < 10 && unit > 0 ? "%.1f %s" : "%.0f %s", value, kUnits[unit]);
}

std::string duration(double seconds) {
  const auto whole = std::llround(std::max(0.0, seconds));
  const auto h = whole / 3600, m = whole / 60 % 60, s = whole % 60;
  if (h > 0) return printed("%lld:%02lld:%02lld", h, m, s);
  if (m > 0) return printed("%lld:%02lld", m, s);
  return printed("%lld s", s);
}

std::string frame_rate(double frames_per_second) {
  if (frames_per_second >= 1) return three_digits(frames_per_second) + " frames/s";
  const double seconds = 1 / frames_per_second;
  return (seconds < 60 ? three_digits(seconds) + " s" : duration(seconds)) + " a frame";
}

}  // namespace meniscus
