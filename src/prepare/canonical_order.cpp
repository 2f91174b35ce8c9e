#include "prepare/canonical_order.hpp"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstdint>
#include <utility>

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

// Sorts by the leading 24 bits in which x differ, those with equal ones in their order: two passes
// of counting. Returns how many bits of x were left out.
int sort_by_leading_bits(std::vector<Key>& keys) {
  constexpr int kBits = 12;
  constexpr std::uint32_t kDigits = 1u << kBits;
  std::uint32_t least = 0xffffffffu, most = 0;
  for (const Key& key : keys) {
    least = std::min(least, key.x);
    most = std::max(most, key.x);
  }
  int left_out = 0;
  while (least < most && (most >> left_out) - (least >> left_out) >= kDigits * kDigits) ++left_out;
  const std::uint32_t first = least >> left_out;
  const auto digit = [&](const Key& key, int pass) {
    return (((key.x >> left_out) - first) >> (pass * kBits)) & (kDigits - 1);
  };
  std::array<std::vector<std::uint32_t>, 2> start;
  for (auto& of_pass : start) of_pass.assign(kDigits + 1, 0);
  for (const Key& key : keys)
    for (int pass = 0; pass < 2; ++pass) ++start[pass][digit(key, pass) + 1];
  std::vector<Key> sorted(keys.size());
  for (int pass = 0; pass < 2; ++pass) {
    for (std::uint32_t d = 0; d < kDigits; ++d) start[pass][d + 1] += start[pass][d];
    for (const Key& key : keys) sorted[start[pass][digit(key, pass)]++] = key;
    keys.swap(sorted);
  }
  return left_out;
}

}  // namespace

Notice not_finite(std::int64_t bad, std::int64_t size, std::int64_t first) {
  return {.code = Code::not_finite,
          .text = std::to_string(bad) + " of " + std::to_string(size) +
                  " particles have NaN or infinite coordinates (the first is particle " +
                  std::to_string(first) + ")",
          .place = first,
          .count = bad,
          .of = size};
}

void report_dropped(std::int64_t bad, std::int64_t size, std::int64_t first,
                    const Parameters& params, std::vector<Notice>& notices) {
  if (bad == 0) return;
  Notice notice = not_finite(bad, size, first);
  const bool none_left = bad == size;
  notice.text += none_left       ? ", and none is left"
                 : params.strict ? "; leave " + setting("strict") + " away to drop them"
                                 : " and were dropped";
  if (none_left || params.strict) throw InputError(notice);
  notices.push_back(std::move(notice));
}

Notice coinciding(std::size_t copies, std::size_t size) {
  return {.code = Code::coinciding,
          .text = "of " + std::to_string(size) + " particles " + std::to_string(copies) +
                  " lie exactly where another one does, which counts them twice (do parts of the "
                  "frame overlap?)",
          .count = static_cast<std::int64_t>(copies),
          .of = static_cast<std::int64_t>(size)};
}

std::vector<std::size_t> canonical_order(const BorrowedParticles& p, const Parameters& params,
                                         std::vector<Notice>& notices) {
  std::vector<Key> keys;
  keys.reserve(p.size());
  std::size_t first_bad = p.size();
  for (std::size_t i = 0; i < p.size(); ++i) {
    if (std::isfinite(p.x[i]) && std::isfinite(p.y[i]) && std::isfinite(p.z[i]))
      keys.push_back({ordered_bits(p.x[i]), static_cast<std::uint32_t>(i)});
    else
      first_bad = std::min(first_bad, i);
  }
  report_dropped(static_cast<std::int64_t>(p.size() - keys.size()),
                 static_cast<std::int64_t>(p.size()), static_cast<std::int64_t>(first_bad), params,
                 notices);

  const int left_out = sort_by_leading_bits(keys);
  const auto before = [&](const Key& a, const Key& b) {
    if (a.x != b.x) return a.x < b.x;
    if (p.y[a.index] != p.y[b.index]) return p.y[a.index] < p.y[b.index];
    if (p.z[a.index] != p.z[b.index]) return p.z[a.index] < p.z[b.index];
    if (!p.radius.empty() && p.radius[a.index] != p.radius[b.index])
      return p.radius[a.index] < p.radius[b.index];
    if (p.vx.empty()) return false;
    for (const Column* v : {&p.vx, &p.vy, &p.vz}) {  // by their bits: they may be NaN
      const std::uint32_t va = ordered_bits((*v)[a.index]), vb = ordered_bits((*v)[b.index]);
      if (va != vb) return va < vb;
    }
    return false;
  };
  std::size_t copies = 0;
  for (auto first = keys.begin(); first != keys.end();) {
    auto last = first + 1;
    while (last != keys.end() && last->x >> left_out == first->x >> left_out) ++last;
    if (last - first > 1) std::sort(first, last, before);
    for (auto key = first + 1; key != last; ++key) {
      const Key& before_it = *(key - 1);
      copies += before_it.x == key->x && at_one_position(p, before_it.index, key->index);
    }
    first = last;
  }
  if (copies > 0) notices.push_back(coinciding(copies, p.size()));
  std::vector<std::size_t> order(keys.size());
  for (std::size_t k = 0; k < keys.size(); ++k) order[k] = keys[k].index;
  return order;
}

}  // namespace meniscus
