// The closed surface of all of the fluid: method fit's implicit function without a camera.
#pragma once

#include <vector>

#include "meniscus/closed.hpp"
#include "methods/extraction.hpp"
#include "stages/frame/relax.hpp"

namespace meniscus {

/// Meshes all particles. Returns mesh, counts and residuals; no image.
///
///   view  make_world_view()
Extraction run_closed(Device& device, const View& view, const WorldParticles& particles,
                      const ClosedParams& closed, const Parameters& params,
                      std::vector<StageTime>* timings);

/// The same of particles whose disorder is known, whatever `params` says of it.
Extraction run_closed(Device& device, const View& view, const WorldParticles& particles,
                      const ClosedParams& closed, const Parameters& params,
                      const Disorder& disorder, std::vector<StageTime>* timings);

}  // namespace meniscus
