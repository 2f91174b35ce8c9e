// The least and the greatest of many values.
#pragma once

#include <array>
#include <cmath>
#include <span>

namespace meniscus {

struct Bounds {
  float least = INFINITY, most = -INFINITY;  // so where there are no values
};

/// Of values that are numbers. Eight at a time: one minimum after the other takes four cycles each.
inline Bounds bounds_of(std::span<const float> values) {
  constexpr std::size_t kLanes = 8;
  std::array<Bounds, kLanes> lanes;
  const auto take = [](Bounds& bounds, float value) {
    bounds.least = value < bounds.least ? value : bounds.least;
    bounds.most = value > bounds.most ? value : bounds.most;
  };
  std::size_t i = 0;
  for (; i + kLanes <= values.size(); i += kLanes)
    for (std::size_t k = 0; k < kLanes; ++k) take(lanes[k], values[i + k]);
  for (; i < values.size(); ++i) take(lanes[0], values[i]);
  for (const Bounds& lane : lanes) {
    take(lanes[0], lane.least);
    take(lanes[0], lane.most);
  }
  return lanes[0];
}

}  // namespace meniscus
