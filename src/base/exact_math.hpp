// Functions that C libraries round differently, from operations that all round alike (the build
// contracts none of them): the same bits with every library, compiler and processor.
#pragma once

#include <bit>
#include <cmath>
#include <cstdint>

namespace meniscus {

/// e^x within one unit in the last place; 0 below -708. For x <= 0.
inline double exp_negative(double x) {
  if (!(x > -708)) return x != x ? x : 0;
  // x = whole ln 2 + rest, |rest| <= ln 2 / 2; the first part of ln 2 leaves its products exact.
  const double whole = std::floor(x * 1.4426950408889634 + 0.5);
  const double rest = (x - whole * 0x1.62e42feep-1) - whole * 0x1.a39ef35793c76p-33;
  // The series to rest^13, two terms at a time.
  const double r2 = rest * rest, r4 = r2 * r2;
  const double low = 0.5 + rest * (1.0 / 6) + r2 * (1.0 / 24 + rest * (1.0 / 120));
  const double middle =
      1.0 / 720 + rest * (1.0 / 5040) + r2 * (1.0 / 40320 + rest * (1.0 / 362880));
  const double high =
      1.0 / 3628800 + rest * (1.0 / 39916800) + r2 * (1.0 / 479001600 + rest * (1.0 / 6227020800));
  const double power = 1 + (rest + r2 * (low + r4 * (middle + r4 * high)));
  // Times 2^whole, set as its exponent's bits.
  return power *
         std::bit_cast<double>(static_cast<std::uint64_t>(1023 + static_cast<int>(whole)) << 52);
}

/// The natural logarithm of a normal x > 0 within two units in the last place, but for cancellation
/// near 1.
inline double logarithm(double x) {
  int exponent = 0;
  double part = std::frexp(x, &exponent);  // [1/2, 1)
  if (part < 0.7071067811865476) {
    part *= 2;
    --exponent;
  }
  // ln part = 2 artanh t, |t| <= .172; the series to t^19.
  const double t = (part - 1) / (part + 1), t2 = t * t;
  double series = 0;
  for (int k = 19; k >= 3; k -= 2) series = t2 * (1.0 / k + series);
  return exponent * 0x1.62e42feep-1 + (2 * t * (1 + series) + exponent * 0x1.a39ef35793c76p-33);
}

/// The cube root of x >= 0 within one unit in the last place.
inline double cube_root(double x) {
  if (!(x > 0) || std::isinf(x)) return x;
  int exponent = 0;
  double part = std::frexp(x, &exponent);  // [1/2, 1)
  const int third = (exponent + 3000) / 3 - 1000;
  part = std::ldexp(part, exponent - 3 * third);  // [1/2, 4)
  double root = 0.75 + 0.25 * part;
  // Newton's method: the error squares, from a quarter at most.
  for (int step = 0; step < 6; ++step) root -= (root - part / (root * root)) / 3;
  return std::ldexp(root, third);
}

}  // namespace meniscus
