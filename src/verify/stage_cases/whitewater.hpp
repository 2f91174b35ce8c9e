// The maps of whitewater against a loop over all drops.
#pragma once

#include "meniscus/types.hpp"
#include "verify/reference/whitewater.hpp"
#include "verify/stage_cases/cases.hpp"
#include "verify/stage_cases/worst.hpp"

namespace meniscus::verify {

struct WhitewaterErrors {
  Worst density{"draw_whitewater", "density"}, coverage{"draw_whitewater", "coverage"},
      depth{"draw_whitewater", "depth"}, velocity{"draw_whitewater", "velocity"},
      behind{"draw_whitewater", "behind"};

  /// A pixel that is sure, of particles of this radius (world units).
  void see(const WhitewaterMaps& maps, std::size_t s, const reference::WhitewaterPixel& expected,
           double radius);
  ReferenceErrors all() const {
    return {density.error(), coverage.error(), depth.error(), velocity.error(), behind.error()};
  }
};

}  // namespace meniscus::verify
