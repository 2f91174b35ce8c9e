#include "stages/frame/splash.hpp"

#include <algorithm>
#include <array>

#include "base/parallel.hpp"

namespace meniscus {
namespace {

enum : char { kUnknown, kBody, kSplash };

// States of the particles: body for those whose piece is seen at a glance to be larger than
// `largest`, because enough particles are near or one that is near is body. Inside the fluid that
// is nearly always so after a look at those before it in the cells' order, which lie near.
std::vector<char> mark_body(const Cells& cells, float link, std::size_t largest) {
  if (largest == 0) return std::vector<char>(cells.item.size(), kBody);
  std::vector<char> state(cells.item.size(), kUnknown);
  NearFinder* const find = near_finders()[0];
  NearBefore* const find_before = before_finders()[0];
  constexpr std::size_t kGrain = 2048;  // particles that are worth a thread
  parallel_for(state.size(), kGrain, [&](std::size_t begin, std::size_t end) {
    std::vector<std::uint16_t> near_before(end - begin);
    find_before(cells, static_cast<std::int32_t>(begin), static_cast<std::int32_t>(end),
                link * link, near_before.data());
    std::uint32_t before = 0;  // which of those before are known to be body
    std::vector<std::int32_t> found;
    for (std::size_t p = begin; p < end; ++p) {
      const std::array at{cells.x[p], cells.y[p], cells.z[p]};
      bool body = (near_before[p - begin] & before) != 0;
      std::size_t near = 0;  // itself among them
      if (!body)
        visit_ranges_near(
            cells, at[0], at[1], at[2],
            [&](std::int32_t first, std::int32_t last, std::uint32_t tag) {
              const std::size_t most = static_cast<std::size_t>(last - first) + kNearRoom;
              if (found.size() < most) found.resize(most);
              near += find(cells, first, last, tag, at, link * link, found.data());
              return near <= largest;
            },
            kNearRowsFirst);
      body |= near > largest;
      if (body) state[cells.item[p]] = kBody;
      before = (before >> 1) | (body ? 1u << (kBefore - 1) : 0);
    }
  });
  return state;
}

}  // namespace

SplashSplit split_splash(const Projected& projected, const Cells& given,
                         const SplashParams& params) {
  SplashSplit split;
  const std::int32_t n = static_cast<std::int32_t>(projected.size());
  const float link = static_cast<float>(params.link);
  const bool wide = link * given.inverse_cell <= 1;  // a search finds all within a link
  const Cells own = wide ? Cells{} : make_cells(projected.x, projected.y, projected.z, link);
  const Cells& cells = wide ? given : own;
  const std::size_t largest = static_cast<std::size_t>(params.pieces);
  std::vector<char> state = mark_body(cells, link, largest);

  std::vector<std::int32_t> piece;
  for (std::int32_t seed = 0; seed < n; ++seed) {
    if (state[seed] != kUnknown) continue;
    // Grow the piece until it is complete, too large, or touches a body particle.
    piece.assign(1, seed);
    bool small = largest > 0;
    for (std::size_t k = 0; small && k < piece.size(); ++k) {
      const std::int32_t i = piece[k];
      visit_near(cells, projected.x[i], projected.y[i], projected.z[i], [&](std::int32_t p) {
        const float dx = cells.x[p] - projected.x[i], dy = cells.y[p] - projected.y[i],
                    dz = cells.z[p] - projected.z[i];
        if (dx * dx + dy * dy + dz * dz >= link * link) return true;
        const std::int32_t j = cells.item[p];
        if (std::find(piece.begin(), piece.end(), j) == piece.end()) piece.push_back(j);
        small = piece.size() <= largest && state[j] != kBody;
        return small;
      });
    }
    for (const std::int32_t i : piece)
      if (state[i] == kUnknown) state[i] = small ? kSplash : kBody;
  }
  split.body.reserve(projected.size());
  for (std::int32_t i = 0; i < n; ++i)
    (state[i] == kSplash ? split.splash : split.body).push_back(i);
  return split;
}

}  // namespace meniscus
