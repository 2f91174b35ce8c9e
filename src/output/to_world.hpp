// The way back to world space.
#pragma once

#include "methods/extraction.hpp"

namespace meniscus {

/// What the pipeline made, on the host and in world units. `surface` has camera, particle radius
/// and warnings. Waits.
Surface to_world(Device& device, const View& view, Extraction extraction, Surface surface,
                 const Parameters& params, std::vector<StageTime>* timings);

}  // namespace meniscus
