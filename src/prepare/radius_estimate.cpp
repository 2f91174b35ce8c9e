#include "prepare/radius_estimate.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <functional>
#include <numbers>
#include <utility>

#include "base/exact_math.hpp"
#include "base/parallel.hpp"
#include "prepare/canonical_order.hpp"

namespace meniscus {
namespace {

constexpr std::array kReaches{2.0, 2.5, 3.0, 4.0};  // of a sphere, nearest distances
constexpr std::size_t kTaken = 1;                   // of these

constexpr std::size_t kAtOnce = 64;  // positions that are looked at together

// Of particles strewn without any order, the thinnest fluid, s is 1.8 times that distance; of a
// splashing fluid 1.27 times.
constexpr double kThinnest = 2, kDense = 1.4;  // s over the distance

double percentile(std::vector<double>& values, double share) {
  const auto place =
      values.begin() + static_cast<std::ptrdiff_t>(share * static_cast<double>(values.size() - 1));
  std::nth_element(values.begin(), place, values.end());
  return *place;
}

// Positions one after the other by x, so that a search leaves off where x alone is too far.
class Sorted {
 public:
  /// Of a canonical order, which is by x; each position once.
  Sorted(const BorrowedParticles& p, std::vector<std::size_t> order) {
    const auto copied = [&](std::size_t a, std::size_t b) { return at_one_position(p, a, b); };
    order.erase(std::unique(order.begin(), order.end(), copied), order.end());
    for (std::vector<float>& along : places_) along.reserve(order.size());
    for (const std::size_t i : order) {
      places_[0].push_back(p.x[i]);
      places_[1].push_back(p.y[i]);
      places_[2].push_back(p.z[i]);
    }
  }

  std::size_t size() const { return places_[0].size(); }

  /// Squared, world units; infinite where there is no other position.
  double nearest_of(std::size_t k) const {
    double best = INFINITY;
    const auto take = [&](std::size_t j) {
      if (squared_along(0, k, j) >= best) return false;
      best = std::min(best, squared_distance(k, j));
      return true;
    };
    for (std::size_t j = k; j-- > 0 && take(j);) {
    }
    for (std::size_t j = k + 1; j < size() && take(j); ++j) {
    }
    return best;
  }

  /// The sums of 1 - (d/R)^2 for each R of kReaches, in units of `apart` (world units).
  std::array<double, kReaches.size()> held_around(std::size_t k, double apart) const {
    constexpr double kMost = kReaches.back() * kReaches.back();
    const std::vector<float>& along = places_[0];
    const auto in_reach = [&](float x) {
      const double d = double{x} - along[k];
      return d * d / (apart * apart) <= kMost;
    };
    const auto own = along.begin() + static_cast<std::ptrdiff_t>(k);
    auto first = static_cast<std::size_t>(
        std::partition_point(along.begin(), own, std::not_fn(in_reach)) - along.begin());
    const auto last =
        static_cast<std::size_t>(std::partition_point(own, along.end(), in_reach) - along.begin());
    std::array<double, kReaches.size()> sum{};
    std::array<std::size_t, kAtOnce> near;
    for (; first < last; first += kAtOnce) {
      const std::size_t found = near_some(k, first, std::min(kAtOnce, last - first),
                                          kReaches.back() * apart, near.data());
      for (std::size_t n = 0; n < found; ++n) {
        const double squared = squared_distance(k, near[n]) / (apart * apart);
        if (squared > kMost) continue;
        for (std::size_t r = 0; r < kReaches.size(); ++r)
          sum[r] += std::max(0.0, 1 - squared / (kReaches[r] * kReaches[r]));
      }
    }
    return sum;
  }

 private:
  /// Those of up to kAtOnce positions from `first` on that are within `reach` of k along y and z,
  /// and hardly any others: a loop that becomes vectors, and one that mostly finds none of eight.
  std::size_t near_some(std::size_t k, std::size_t first, std::size_t count, double reach,
                        std::size_t* near) const {
    const float *const y = places_[1].data(), *const z = places_[2].data();
    const float at_y = y[k], at_z = z[k];
    const float most = static_cast<float>(1.001 * reach);  // with room for rounding
    std::array<std::uint8_t, kAtOnce> is_near{};
    for (std::size_t n = 0; n < count; ++n) {
      const int along_y = std::abs(y[first + n] - at_y) <= most;
      const int along_z = std::abs(z[first + n] - at_z) <= most;
      is_near[n] = static_cast<std::uint8_t>(along_y & along_z);
    }
    std::size_t found = 0;
    for (std::size_t eight = 0; eight < kAtOnce; eight += 8) {
      std::uint64_t any = 0;
      std::memcpy(&any, is_near.data() + eight, sizeof any);
      if (any == 0) continue;
      for (std::size_t n = eight; n < eight + 8; ++n) {
        near[found] = first + n;
        found += is_near[n];
      }
    }
    return found;
  }
  double squared_along(std::size_t axis, std::size_t i, std::size_t j) const {
    const double d = double{places_[axis][j]} - places_[axis][i];
    return d * d;
  }
  double squared_distance(std::size_t i, std::size_t j) const {
    return squared_along(0, i, j) + squared_along(1, i, j) + squared_along(2, i, j);
  }

  std::array<std::vector<float>, 3> places_;  // along each axis
};

}  // namespace

RadiusEstimate estimate_radius(const BorrowedParticles& p, std::vector<std::size_t> order,
                               std::size_t samples) {
  const Sorted sorted(p, std::move(order));
  const std::size_t step = std::max<std::size_t>(1, sorted.size() / samples);
  std::vector<double> nearest((sorted.size() + step - 1) / step);
  parallel_for(nearest.size(), 1, [&](std::size_t begin, std::size_t end) {
    for (std::size_t s = begin; s < end; ++s) nearest[s] = std::sqrt(sorted.nearest_of(s * step));
  });
  std::erase(nearest, INFINITY);  // of one position alone
  if (nearest.empty()) return {};
  const double apart = percentile(nearest, 0.5);

  std::array<std::vector<double>, kReaches.size()> held;
  for (std::vector<double>& values : held) values.resize(nearest.size());
  parallel_for(nearest.size(), 1, [&](std::size_t begin, std::size_t end) {
    for (std::size_t s = begin; s < end; ++s) {
      const auto sum = sorted.held_around(s * step, apart);
      for (std::size_t r = 0; r < kReaches.size(); ++r) held[r][s] = sum[r];
    }
  });
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
