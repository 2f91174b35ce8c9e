// splash: particles that no sheet supports (paper, end of 3).
#pragma once

#include <vector>

#include "meniscus/parameters.hpp"
#include "stages/frame/cells.hpp"
#include "stages/frame/project.hpp"

namespace meniscus {

/// Projected particles, split.
struct SplashSplit {
  std::vector<std::int32_t> body;    // ascending: to be fitted
  std::vector<std::int32_t> splash;  // ascending: connected pieces of at most params.pieces
};

/// As large as a drop is drawn, particle radii, whatever its own radius: the density field, which
/// draws it, reaches a quarter as far, and rays that look for it farther out take their time.
inline constexpr float kLargestDrop = 16;

/// Finds the small connected pieces over links shorter than params.link. (The paper takes
/// particles with fewer than three neighbours; pieces keep thin sheets whole, docs/method.md.)
///
///   cells  of all projected particles, of any side; used where it is no shorter than the link
SplashSplit split_splash(const Projected& projected, const Cells& cells,
                         const SplashParams& params);

}  // namespace meniscus
