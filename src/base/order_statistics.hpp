// The least, the greatest and the middle of many values.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <span>
#include <vector>

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
  Bounds all;
  for (const Bounds& lane : lanes)
    all = {std::min(all.least, lane.least), std::max(all.most, lane.most)};
  return all;
}

/// The value that n / 2 of n > 0 values come before in ascending order. Two of a sample hold it
/// between them but for bad luck, so that most values are only compared with these.
inline float median_of(std::vector<float> values) {
  const auto take = [](std::vector<float>& all, std::size_t place) {
    const auto at = all.begin() + static_cast<std::ptrdiff_t>(place);
    std::nth_element(all.begin(), at, all.end());
    return *at;
  };
  const std::size_t n = values.size();
  constexpr std::size_t kMany = 4096, kEvery = 16;
  if (n >= kMany) {
    std::vector<float> sample;
    for (std::size_t i = 0; i < n; i += kEvery) sample.push_back(values[i]);
    const std::size_t middle = sample.size() / 2;
    const std::size_t margin =  // four standard deviations
        static_cast<std::size_t>(2 * std::sqrt(static_cast<double>(sample.size())));
    const float low = take(sample, middle - margin), high = take(sample, middle + margin);
    std::vector<float> between(n);
    std::size_t below = 0, found = 0;
    for (const float value : values) {
      between[found] = value;
      found += static_cast<std::size_t>((value >= low) & (value <= high));
      below += static_cast<std::size_t>(value < low);
    }
    between.resize(found);
    if (below <= n / 2 && n / 2 < below + found) return take(between, n / 2 - below);
  }
  return take(values, n / 2);
}

}  // namespace meniscus
