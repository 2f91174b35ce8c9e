// The closed surface of all of the fluid: method fit's implicit function without a camera.
#pragma once

#include <vector>

#include "meniscus/closed.hpp"
#include "methods/extraction.hpp"

namespace meniscus {

/// Meshes all particles. Returns mesh, counts and residuals; no image.
///
///   view  make_world_view()
Extraction run_closed(Device& device, const View& view, const WorldParticles& particles,
                      const ClosedParams& closed, const Parameters& params,
                      std::vector<StageTime>* timings);

}  // namespace meniscus
