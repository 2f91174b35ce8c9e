#include "kernels/text.hpp"

#include <cmath>
#include <cstdarg>
#include <cstdio>

namespace meniscus::bench {

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
  const int decimals = 2 - static_cast<int>(std::floor(std::log10(std::abs(value))));
  return printed("%.*f", std::max(0, std::min(decimals, 6)), value);
}

std::string with_prefix(double value) {
  constexpr const char* kPrefixes[] = {"", " k", " M", " G", " T"};
  int prefix = 0;
  for (; value >= 999.5 && prefix < 4; ++prefix) value /= 1000;
  return three_digits(value) + kPrefixes[prefix];
}

std::string size_of(double bytes) {
  constexpr const char* kUnits[] = {"B", "KiB", "MiB", "GiB"};
  int unit = 0;
  for (; bytes >= 1000 && unit < 3; ++unit) bytes /= 1024;
  return printed("%.0f %s", bytes, kUnits[unit]);
}

std::string roofline_line(const Roofline& roofline) {
  std::string line = "copies";
  for (const CopyRate& copy : roofline.copy)
    line += (&copy == &roofline.copy.front() ? " " : ", ") + three_digits(copy.gb_per_s) +
            " GB/s in " + size_of(copy.bytes);
  return line + "; " + three_digits(roofline.fused_gflops) + " GFLOP/s fused, " +
         three_digits(roofline.plain_gflops) + " plain; a launch " +
         three_digits(roofline.launch_us) + " us, in a batch " +
         three_digits(roofline.batched_launch_us) + " us; atomic minima " +
         with_prefix(1e9 * roofline.spread_atomics) + "/s, on one word " +
         with_prefix(1e9 * roofline.contended_atomics) + "/s";
}

std::string warning_on(const Session& session) {
  if (!session.disturbed()) return "";
  return printed("other work ran beside, on %.1f processors: threads may not have run at once",
                 session.other_work);
}

}  // namespace meniscus::bench
