#include "canonical_order.hpp"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstdint>

#include "meniscus/error.hpp"

namespace meniscus {
namespace {

// A particle with its x as an integer that is ordered as x is.
struct Key {
  std::uint32_t x, index;
};

// -0 and 0 are one value: the sum with 0 makes both 0.
std::uint32_t ordered_bits(float value) {
  const std::uint32_t bits = std::bit_cast<std::uint32_t>(value + 0.0f);
  return bits & 0x80000000u ? ~bits : bits | 0x80000000u;
}

// Sorts by x, equal ones in their order: three passes of counting, eleven bits each.
void sort_by_x(std::vector<Key>& keys) {
  constexpr int kBits = 11;
  constexpr std::uint32_t kDigits = 1u << kBits;
  std::vector<Key> sorted(keys.size());
  for (int shift = 0; shift < 32; shift += kBits) {
    std::array<std::uint32_t, kDigits + 1> start{};
    for (const Key& key : keys) ++start[((key.x >> shift) & (kDigits - 1)) + 1];
    for (std::uint32_t d = 0; d < kDigits; ++d) start[d + 1] += start[d];
    for (const Key& key : keys) sorted[start[(key.x >> shift) & (kDigits - 1)]++] = key;
    keys.swap(sorted);
  }
}

}  // namespace

std::vector<std::size_t> canonical_order(const Particles& p, const Parameters& params,
                                         std::vector<std::string>& warnings) {
  std::vector<Key> keys;
  keys.reserve(p.size());
  std::size_t first_bad = p.size();
  for (std::size_t i = 0; i < p.size(); ++i) {
    if (std::isfinite(p.x[i]) && std::isfinite(p.y[i]) && std::isfinite(p.z[i]))
      keys.push_back({ordered_bits(p.x[i]), static_cast<std::uint32_t>(i)});
    else
      first_bad = std::min(first_bad, i);
  }
  const std::size_t bad = p.size() - keys.size();
  if (bad > 0) {
    const std::string what = std::to_string(bad) + " of " + std::to_string(p.size()) +
                             " particles have NaN or infinite coordinates (the first is particle " +
                             std::to_string(first_bad) + ")";
    if (params.strict) throw InputError(what + "; leave --strict away to drop them");
    warnings.push_back(what + " and were dropped");
  }

  sort_by_x(keys);
  const auto before = [&](const Key& a, const Key& b) {
    if (p.y[a.index] != p.y[b.index]) return p.y[a.index] < p.y[b.index];
    if (p.z[a.index] != p.z[b.index]) return p.z[a.index] < p.z[b.index];
    if (!p.radius.empty() && p.radius[a.index] != p.radius[b.index])
      return p.radius[a.index] < p.radius[b.index];
    if (p.vx.empty()) return false;
    for (const std::vector<float>* v : {&p.vx, &p.vy, &p.vz}) {  // by their bits: they may be NaN
      const std::uint32_t va = ordered_bits((*v)[a.index]), vb = ordered_bits((*v)[b.index]);
      if (va != vb) return va < vb;
    }
    return false;
  };
  for (auto first = keys.begin(); first != keys.end();) {
    auto last = first + 1;
    while (last != keys.end() && last->x == first->x) ++last;
    if (last - first > 1) std::sort(first, last, before);
    first = last;
  }
  std::vector<std::size_t> order(keys.size());
  for (std::size_t k = 0; k < keys.size(); ++k) order[k] = keys[k].index;
  return order;
}

}  // namespace meniscus
