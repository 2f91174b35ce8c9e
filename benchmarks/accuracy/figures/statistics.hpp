// The few statistics that figures are made of.
#pragma once

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <vector>

#include "stages/vec.hpp"

namespace meniscus::accuracy {

/// A figure that has nothing to measure.
inline constexpr double kNone = std::numeric_limits<double>::quiet_NaN();
inline constexpr double kDegree = std::numbers::pi / 180;  // radians
inline constexpr double kClamp = 2;     // s; larger errors count as this
inline constexpr double kJump = 1;      // s; neighbours whose depths differ by more are two layers
inline constexpr int kSpeckPixels = 8;  // a piece of at most this many pixels is a speck

inline bool finite(double depth) { return depth < std::numeric_limits<double>::infinity(); }

inline double clamped(double error) { return std::clamp(error, -kClamp, kClamp); }

/// The value below which `share` of the values lie; NaN: there are none. Reorders the values.
inline double percentile(std::vector<double>& values, double share) {
  if (values.empty()) return kNone;
  const auto k = std::min(values.size() - 1, static_cast<std::size_t>(share * values.size()));
  std::nth_element(values.begin(), values.begin() + k, values.end());
  return values[k];
}

/// Root of the mean square and mean of what was added.
struct Moments {
  double square = 0, sum = 0, count = 0;
  void add(double value) {
    square += value * value;
    sum += value;
    ++count;
  }
  double rms() const { return count > 0 ? std::sqrt(square / count) : kNone; }
  double mean() const { return count > 0 ? sum / count : kNone; }
};

/// Degrees; exact for small angles, where an arc cosine is not.
inline double angle_between(const Vec3d& a, const Vec3d& b) {
  return std::atan2(length(cross(a, b)), dot(a, b)) * 180 / std::numbers::pi;
}

}  // namespace meniscus::accuracy
