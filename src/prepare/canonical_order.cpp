#include "prepare/canonical_order.hpp"

#include <algorithm>
#include <atomic>
#include <bit>
#include <cmath>
#include <cstdint>
#include <numeric>
#include <utility>

#include "base/parallel.hpp"
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

// Into how many chunks n particles are cut: each has enough work for a thread, and their counts of
// digits stay small.
std::size_t chunks_of(std::size_t n) { return std::clamp<std::size_t>(n >> 13, 1, 256); }

std::size_t begin_of(std::size_t chunk, std::size_t n) { return chunk * n / chunks_of(n); }

// Calls work(chunk, begin, end) for the chunks of [0, n).
template <class Work>
void for_chunks(std::size_t n, const Work& work) {
  parallel_for(chunks_of(n), 1, [&](std::size_t first, std::size_t last) {
    for (std::size_t c = first; c < last; ++c) work(c, begin_of(c, n), begin_of(c + 1, n));
  });
}

// The keys of the particles whose coordinates are finite, and the first other one, or how many
// there are.
std::vector<Key> keys_of(const BorrowedParticles& p, std::size_t& first_bad) {
  std::vector<Key> keys(p.size());
  std::vector<std::size_t> bad(chunks_of(p.size()), p.size());  // the first of each chunk
  const auto is_finite = [&](std::size_t i) {
    return std::isfinite(p.x[i]) && std::isfinite(p.y[i]) && std::isfinite(p.z[i]);
  };
  for_chunks(p.size(), [&](std::size_t c, std::size_t begin, std::size_t end) {
    for (std::size_t i = end; i-- > begin;) {
      keys[i] = {ordered_bits(p.x[i]), static_cast<std::uint32_t>(i)};
      if (!is_finite(i)) bad[c] = i;
    }
  });
  first_bad = p.size();
  for (const std::size_t first : bad) first_bad = std::min(first_bad, first);
  if (first_bad < p.size()) std::erase_if(keys, [&](Key key) { return !is_finite(key.index); });
  return keys;
}

// Sorts by the leading 24 bits in which x differ, those with equal ones in their order: two passes
// of counting. Returns how many bits of x were left out.
int sort_by_leading_bits(std::vector<Key>& keys) {
  constexpr int kBits = 12;
  constexpr std::uint32_t kDigits = 1u << kBits;
  struct Range {
    std::uint32_t least = 0xffffffffu, most = 0;
  };
  const std::size_t n = keys.size(), chunks = chunks_of(n);
  if (n == 0) return 0;
  std::vector<Range> ranges(chunks);
  for_chunks(n, [&](std::size_t c, std::size_t begin, std::size_t end) {
    Range range;
    for (std::size_t k = begin; k < end; ++k) {
      range.least = std::min(range.least, keys[k].x);
      range.most = std::max(range.most, keys[k].x);
    }
    ranges[c] = range;
  });
  const std::uint32_t least = std::ranges::min(ranges, {}, &Range::least).least;
  const std::uint32_t most = std::ranges::max(ranges, {}, &Range::most).most;
  int left_out = 0;
  while (least < most && (most >> left_out) - (least >> left_out) >= kDigits * kDigits) ++left_out;
  const std::uint32_t first = least >> left_out;
  std::vector<Key> sorted(n);
  std::vector<std::uint32_t> next(chunks * kDigits);  // [chunks][digits] counts, then where they go
  for (int pass = 0; pass < 2; ++pass) {
    const auto digit = [&](const Key& key) {
      return (((key.x >> left_out) - first) >> (pass * kBits)) & (kDigits - 1);
    };
    for_chunks(n, [&](std::size_t c, std::size_t begin, std::size_t end) {
      std::uint32_t* const own = next.data() + c * kDigits;
      std::fill_n(own, kDigits, 0u);
      for (std::size_t k = begin; k < end; ++k) ++own[digit(keys[k])];
    });
    // Chunk by chunk: digit by digit the counts lie far apart.
    std::vector<std::uint32_t> first_of(kDigits, 0);
    for (std::size_t c = 0; c < chunks; ++c)
      for (std::uint32_t d = 0; d < kDigits; ++d) first_of[d] += next[c * kDigits + d];
    std::exclusive_scan(first_of.begin(), first_of.end(), first_of.begin(), 0u);
    for (std::size_t c = 0; c < chunks; ++c)
      for (std::uint32_t d = 0; d < kDigits; ++d) {
        const std::uint32_t count = std::exchange(next[c * kDigits + d], first_of[d]);
        first_of[d] += count;
      }
    for_chunks(n, [&](std::size_t c, std::size_t begin, std::size_t end) {
      std::uint32_t* const own = next.data() + c * kDigits;
      for (std::size_t k = begin; k < end; ++k) sorted[own[digit(keys[k])]++] = keys[k];
    });
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
                    const Parameters& params, Notices& notices) {
  if (bad > 0) report_dropped(not_finite(bad, size, first), " and were dropped", params, notices);
}

void report_dropped(Notice notice, const char* dropped, const Parameters& params,
                    Notices& notices) {
  const bool none_left = notice.count == notice.of;
  notice.text += none_left       ? ", and none is left"
                 : params.strict ? "; leave " + setting("strict") + " away to drop them"
                                 : dropped;
  if (none_left || params.strict) throw InputError(notice);
  notices.add(std::move(notice));
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
                                         Notices& notices) {
  std::size_t first_bad = 0;
  std::vector<Key> keys = keys_of(p, first_bad);
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
  // Those with equal leading bits are sorted in the chunk in which they begin.
  const auto leading = [&](const Key& key) { return key.x >> left_out; };
  const auto end_of_run = [&](std::size_t k) {
    const auto later = [&](std::uint32_t own, const Key& key) { return own < leading(key); };
    const auto run = keys.begin() + static_cast<std::ptrdiff_t>(k);
    return static_cast<std::size_t>(std::upper_bound(run, keys.end(), leading(*run), later) -
                                    keys.begin());
  };
  std::vector<std::size_t> from(chunks_of(keys.size()) + 1, 0);
  for (std::size_t c = 1; c < from.size(); ++c)
    if (!keys.empty()) from[c] = end_of_run(begin_of(c, keys.size()) - 1);
  std::atomic<std::size_t> copies = 0;
  for_chunks(keys.size(), [&](std::size_t c, std::size_t, std::size_t) {
    std::size_t found = 0;
    for (std::size_t k = from[c]; k < from[c + 1];) {
      std::size_t last = k + 1;
      while (last < from[c + 1] && leading(keys[last]) == leading(keys[k])) ++last;
      const auto first = keys.begin() + static_cast<std::ptrdiff_t>(k);
      if (last - k > 1) std::sort(first, first + static_cast<std::ptrdiff_t>(last - k), before);
      for (++k; k < last; ++k)
        found += keys[k - 1].x == keys[k].x && at_one_position(p, keys[k - 1].index, keys[k].index);
    }
    copies += found;
  });
  if (copies > 0) notices.add(coinciding(copies, p.size()));
  std::vector<std::size_t> order(keys.size());
  for_chunks(keys.size(), [&](std::size_t, std::size_t begin, std::size_t end) {
    for (std::size_t k = begin; k < end; ++k) order[k] = keys[k].index;
  });
  return order;
}

}  // namespace meniscus
