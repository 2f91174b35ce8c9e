// Bins of 8 x 8 samples, each drawn into a map of its own, as prelude.cl and bins.cl have them.
// Everything has internal linkage.
#pragma once

#include <limits>

#include "kernels/native/lanes.hpp"
#include "kernels/native/native.hpp"

namespace meniscus::bench::native {
namespace {

constexpr int kBin = 8;
constexpr int kAhead = 16;  // entries whose records are on their way

struct Map {
  Floats row[kBin];

  Map() {
    for (Floats& r : row) r = all(std::numeric_limits<float>::infinity());
  }
  float deepest() const {
    Floats deepest = row[0];
    for (int j = 1; j < kBin; ++j) deepest = larger(deepest, row[j]);
    return most_lane(deepest);
  }
};

/// Draws the entries of bins [begin, end): set_up(i, j) for the first sample of each bin, then
/// nearest(particle), less than the map's deepest value where the particle may show, and for each
/// row of its box front(particle, row, inside), the depths there. `inside` are the lanes in its
/// box.
template <class SetUp, class Nearest, class Front>
[[gnu::always_inline]] inline void draw_bins(const Bins& bins, std::size_t begin, std::size_t end,
                                             const SetUp& set_up, const Nearest& nearest,
                                             const Front& front) {
  const std::int32_t last = bins.end[end - 1];
  for (std::size_t bin = begin; bin < end; ++bin) {
    const int i = static_cast<int>(bin) % bins.bins_x * kBin,
              j = static_cast<int>(bin) / bins.bins_x * kBin;
    set_up(i, j);
    Map map;
    float deepest = std::numeric_limits<float>::infinity();
    const std::int32_t first = bin > 0 ? bins.end[bin - 1] : 0;
    for (std::int32_t e = first; e < bins.end[bin]; ++e) {
      // Records lie anywhere; a large frame would wait for them half of the time.
      if (e + kAhead < last)
        __builtin_prefetch(bins.records + bins.values * bins.entry[2 * (e + kAhead)]);
      // Long lists are mostly of what lies behind the rest.
      if ((e - first) % 8 == 7) deepest = map.deepest();
      const std::int32_t particle = bins.entry[2 * e], box = bins.entry[2 * e + 1];
      if (nearest(particle) > deepest) continue;
      const Ints inside = (kPlaces >= (box & 15)) & (kPlaces <= (box >> 4 & 15));
      for (int row = box >> 8 & 15; row <= (box >> 12 & 15); ++row)
        front(particle, row, inside, map.row[row]);
    }
    for (int row = 0; row < kBin && j + row < bins.ny; ++row)
      store_first(map.row[row], bins.depth + std::ptrdiff_t{j + row} * bins.nx + i, bins.nx - i);
  }
}

/// The same where depths depend on the samples' places alone: front(record, u, v, inside, map),
/// with the places of a row's samples, pixels.
template <class Nearest, class Front>
[[gnu::always_inline]] inline void draw_bins(const Bins& bins, std::size_t begin, std::size_t end,
                                             const Nearest& nearest, const Front& front) {
  Floats u{};
  int top = 0;
  draw_bins(
      bins, begin, end,
      [&](int i, int j) {
        u = bins.first + bins.step * (static_cast<float>(i) + kLanes);
        top = j;
      },
      nearest,
      [&](int particle, int row, const Ints& inside, Floats& map) {
        front(bins.records + bins.values * particle, u,
              bins.first + bins.step * static_cast<float>(top + row), inside, map);
      });
}

}  // namespace
}  // namespace meniscus::bench::native
