// Seeded numbers for inputs.
#pragma once

#include <random>

namespace meniscus {

/// Uniform in [low, high), the same on every platform.
class Random {
 public:
  explicit Random(unsigned seed) : engine_(seed) {}
  double operator()(double low, double high) {
    return low + (high - low) * static_cast<double>(engine_()) / 4294967296.0;
  }

 private:
  std::mt19937 engine_;
};

}  // namespace meniscus
