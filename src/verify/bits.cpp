#include "verify/bits.hpp"

#include <algorithm>
#include <cstdio>

namespace meniscus::verify {
namespace {

bool alike(std::uint32_t a, std::uint32_t b, Reading reading) {
  if (a == b) return true;
  if (reading == Reading::integers) return false;
  const float x = float_of(a), y = float_of(b);
  return (std::isnan(x) && std::isnan(y)) ||
         (reading == Reading::unsigned_zeros && x == 0 && y == 0);
}

}  // namespace

Difference compare(const std::vector<std::uint32_t>& expected,
                   const std::vector<std::uint32_t>& found, Reading reading) {
  Difference difference{0, expected.size(), 0, 0};
  for (std::size_t i = 0; i < expected.size(); ++i) {
    const bool there = i < found.size();
    if (there && alike(expected[i], found[i], reading)) continue;
    if (difference.count++ == 0) difference.first = i;
    if (!there || reading == Reading::integers) continue;
    const double wanted = float_of(expected[i]);
    difference.ulp =
        std::max(difference.ulp, ulps_between(wanted, float_of(found[i]), ulp_of(wanted)));
  }
  return difference;
}

std::string hex(std::uint32_t bits, Reading reading) {
  char text[48];
  if (reading == Reading::integers)
    std::snprintf(text, sizeof(text), "0x%08x (%d)", bits, static_cast<int>(bits));
  else
    std::snprintf(text, sizeof(text), "0x%08x (%.9g)", bits, static_cast<double>(float_of(bits)));
  return text;
}

}  // namespace meniscus::verify
