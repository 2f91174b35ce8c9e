#include "prepare/radius_estimate.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

#include "base/exact_math.hpp"
#include "prepare/canonical_order.hpp"

namespace meniscus {
namespace {

constexpr std::array kReaches{2.0, 2.5, 3.0, 4.0};  // of a sphere, nearest distances
constexpr std::size_t kTaken = 1;                   // of these

// Of particles strewn without any order, the thinnest fluid, s is 1.8 times that distance; of a
// splashing fluid 1.27 times.
constexpr double kThinnest = 2, kDense = 1.4;  // s over the distance

double percentile(std::vector<double>& values, double share) {
  const auto place =
      values.begin() + static_cast<std::ptrdiff_t>(share * static_cast<double>(values.size() - 1));
  std::nth_element(values.begin(), place, values.end());
  return *place;
}

}  // namespace

RadiusEstimate estimate_radius(const BorrowedParticles& p, std::vector<std::size_t> order,
                               std::size_t samples) {
  const auto copied = [&](std::size_t a, std::size_t b) { return at_one_position(p, a, b); };
  order.erase(std::unique(order.begin(), order.end(), copied), order.end());
  const std::size_t step = std::max<std::size_t>(1, order.size() / samples);
  const auto squared_distance = [&](std::size_t i, std::size_t j) {
    const double dx = double{p.x[j]} - p.x[i], dy = double{p.y[j]} - p.y[i],
                 dz = double{p.z[j]} - p.z[i];
    return dx * dx + dy * dy + dz * dz;
  };
  std::vector<double> nearest;
  for (std::size_t k = 0; k < order.size(); k += step) {
    double best = INFINITY;
    for (const std::size_t j : order) {
      const double squared = squared_distance(order[k], j);
      if (squared > 0) best = std::min(best, squared);
    }
    if (std::isfinite(best)) nearest.push_back(std::sqrt(best));
  }
  if (nearest.empty()) return {};
  const double apart = percentile(nearest, 0.5);

  std::array<std::vector<double>, kReaches.size()> held;
  for (std::size_t k = 0; k < order.size(); k += step) {
    std::array<double, kReaches.size()> sum{};
    for (const std::size_t j : order) {
      const double squared = squared_distance(order[k], j) / (apart * apart);
      if (squared > kReaches.back() * kReaches.back()) continue;
      for (std::size_t r = 0; r < kReaches.size(); ++r)
        sum[r] += std::max(0.0, 1 - squared / (kReaches[r] * kReaches[r]));
    }
    for (std::size_t r = 0; r < kReaches.size(); ++r) held[r].push_back(sum[r]);
  }
  std::array<double, kReaches.size()> spacing{};
  for (std::size_t r = 0; r < kReaches.size(); ++r) {
    const double reach = kReaches[r] * apart;
    const double volume = 8 * std::numbers::pi / 15 * reach * reach * reach;
    spacing[r] = cube_root(volume / percentile(held[r], 0.95));
  }
  if (!(spacing[kTaken] < kThinnest * apart)) return {apart / 2, apart / 2, spacing[kTaken] / 2};
  const auto [least, most] = std::minmax_element(spacing.begin(), spacing.end());
  return {spacing[kTaken] / 2, *least / 2, *most / 2, spacing[kTaken] < kDense * apart};
}

}  // namespace meniscus
