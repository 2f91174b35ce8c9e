// The way back to world space.
#pragma once

#include "base/notices.hpp"
#include "methods/extraction.hpp"

namespace meniscus {

/// What the pipeline made, on the host and in world units. `surface` has camera and particle
/// radius. Warns where nothing is in view or shown. Waits.
Surface to_world(Device& device, const View& view, Extraction extraction, Surface surface,
                 const Parameters& params, Notices& notices, std::vector<StageTime>* timings);

}  // namespace meniscus
