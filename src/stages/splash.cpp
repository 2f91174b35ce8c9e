#include "stages/splash.hpp"

#include <algorithm>

#include "stages/cells.hpp"

namespace meniscus {

SplashSplit split_splash(const Projected& projected, const SplashParams& params) {
  SplashSplit split;
  const std::int32_t n = static_cast<std::int32_t>(projected.size());
  const float link = static_cast<float>(params.link);
  const Cells cells = make_cells(projected.x, projected.y, projected.z, std::max(link, 0.1f));
  const std::size_t largest = static_cast<std::size_t>(params.pieces);

  enum : char { kUnknown, kBody, kSplash };
  std::vector<char> state(projected.size(), kUnknown);
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
  for (std::int32_t i = 0; i < n; ++i)
    (state[i] == kSplash ? split.splash : split.body).push_back(i);
  return split;
}

}  // namespace meniscus
