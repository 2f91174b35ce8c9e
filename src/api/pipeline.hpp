// A method, and the motion of what it makes. The stages in order are in methods/.
#pragma once

#include <vector>

#include "methods/extraction.hpp"

namespace meniscus {

/// Runs the method of `params` on particles in canonical order.
Extraction run_pipeline(Device& device, const View& view, const WorldParticles& particles,
                        const Parameters& params, std::vector<StageTime>* timings);

}  // namespace meniscus
