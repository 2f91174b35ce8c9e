// Random numbers that are the same on every machine.
#pragma once

#include <cmath>
#include <cstdint>

#include "stages/vec.hpp"

namespace meniscus::accuracy {

/// SplitMix64 (Steele, Lea, Flood 2014), and what is drawn from it. The standard library's
/// distributions differ from one library to the next.
class Random {
 public:
  explicit Random(std::uint64_t seed) : state_(seed) {}

  /// In [low, high).
  double uniform(double low, double high) {
    return low + (high - low) * (static_cast<double>(next() >> 11) * 0x1p-53);
  }
  Vec3d in_box(const Vec3d& low, const Vec3d& high) {
    const double x = uniform(low.x, high.x), y = uniform(low.y, high.y);
    return {x, y, uniform(low.z, high.z)};
  }
  /// Standard normal, by the polar method.
  double normal() {
    for (;;) {
      const double a = uniform(-1, 1), b = uniform(-1, 1), q = a * a + b * b;
      if (q > 0 && q < 1) return a * std::sqrt(-2 * std::log(q) / q);
    }
  }

 private:
  std::uint64_t next() {
    std::uint64_t z = state_ += 0x9e3779b97f4a7c15u;
    z = (z ^ (z >> 30)) * 0xbf58476d1ce4e5b9u;
    z = (z ^ (z >> 27)) * 0x94d049bb133111ebu;
    return z ^ (z >> 31);
  }
  std::uint64_t state_;
};

}  // namespace meniscus::accuracy
