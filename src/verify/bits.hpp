// Comparing what a device found with what was expected, bit by bit.
#pragma once

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

namespace meniscus::verify {

inline std::uint32_t bits_of(float value) { return std::bit_cast<std::uint32_t>(value); }
inline float float_of(std::uint32_t bits) { return std::bit_cast<float>(bits); }

/// One unit in the last place of a float of that size, at least the least denormal.
inline double ulp_of(double value) {
  if (!std::isfinite(value)) return 0x1p104;
  const int exponent = value == 0 ? -126 : std::max(std::ilogb(value), -126);
  return std::ldexp(1.0, std::min(exponent, 127) - 23);
}

/// How far a value is from the one that was expected, in `ulp` of that; infinite where only one of
/// them is finite.
inline double ulps_between(double expected, double found, double ulp) {
  if (expected == found) return 0;
  return std::isfinite(expected) && std::isfinite(found) ? std::abs(found - expected) / ulp
                                                         : INFINITY;
}

/// How a value is read: as an integer, as a float, or as a float whose zeros are alike.
enum class Reading { integers, floats, unsigned_zeros };

/// What differs between two arrays of 32-bit values.
struct Difference {
  std::size_t count = 0, of = 0;
  std::size_t first = 0;  // index, where count > 0
  double ulp = 0;         // the largest of floats; infinite where only one is finite or NaN
};

/// NaN is like NaN, whatever its bits.
Difference compare(const std::vector<std::uint32_t>& expected,
                   const std::vector<std::uint32_t>& found, Reading reading);

/// "0x3f800000 (1)" of a float, "0x00000001 (1)" of an integer.
std::string hex(std::uint32_t bits, Reading reading);

}  // namespace meniscus::verify
