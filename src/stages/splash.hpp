// splash: particles that no sheet supports (paper, end of 3).
#pragma once

#include <vector>

#include "meniscus/parameters.hpp"
#include "stages/cells.hpp"
#include "stages/density.hpp"
#include "stages/project.hpp"
#include "stages/relax.hpp"

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

/// Raises the weights with which splash of irregular particles is drawn in the levelled field,
/// whose level for these is too high for lone ones: from a disorder of 1 on each is drawn as large
/// as it is, and drops of several about as large as so many. Without disorder nothing is done. Else
/// waits.
///
///   cells  of all particles, of which `levelled` was made, of side kDensitySupport
///   level  of the field, RegionParams::blob_density for this disorder
void raise_splash(Device& device, const Cells& cells, const SplashSplit& split,
                  const Disorder& disorder, double level, DeviceCells& levelled);

}  // namespace meniscus
