// The way back to world space.
#pragma once

#include "pipeline.hpp"

namespace meniscus {

/// What the pipeline made, in world units. `surface` has camera, particle radius and warnings.
Surface to_world(const View& view, Extraction extraction, Surface surface,
                 const Parameters& params);

}  // namespace meniscus
