// Running error analysis: a double, and how far a float computed by the same operations can be
// from it. Every operation adds one rounding of its result.
#pragma once

#include <cfloat>
#include <cmath>

namespace meniscus::reference {

struct Bounded {
  double value = 0;
  double error = 0;

  Bounded() = default;
  Bounded(double v) : Bounded(v, std::abs(v) * kRounding) {}  // NOLINT: a constant, rounded once
  Bounded(double v, double e) : value(v), error(e) {}

  static constexpr double kRounding = FLT_EPSILON / 2;
  static Bounded rounded(double v, double e) { return {v, e + (std::abs(v) + e) * kRounding}; }
};

inline Bounded operator+(const Bounded& a, const Bounded& b) {
  return Bounded::rounded(a.value + b.value, a.error + b.error);
}
inline Bounded operator-(const Bounded& a, const Bounded& b) {
  return Bounded::rounded(a.value - b.value, a.error + b.error);
}
inline Bounded operator*(const Bounded& a, const Bounded& b) {
  return Bounded::rounded(a.value * b.value, std::abs(a.value) * b.error +
                                                 std::abs(b.value) * a.error + a.error * b.error);
}
inline Bounded operator/(const Bounded& a, const Bounded& b) {
  const double least = std::abs(b.value) - b.error;  // a divisor that may be zero bounds nothing
  const double quotient = a.value / b.value;
  return Bounded::rounded(quotient,
                          least > 0 ? (a.error + std::abs(quotient) * b.error) / least : INFINITY);
}

}  // namespace meniscus::reference
