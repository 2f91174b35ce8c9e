// The closed surface of all of the fluid: method fit's implicit function without a camera.
#pragma once

#include <vector>

#include "api/pipeline.hpp"
#include "meniscus/closed.hpp"
#include "stages/layers.hpp"

namespace meniscus {

/// Meshes all particles. Returns mesh, counts and residuals; no image.
///
///   view  make_world_view()
Extraction run_closed(Device& device, const View& view, const WorldParticles& particles,
                      const ClosedParams& closed, const Parameters& params,
                      std::vector<StageTime>* timings);

/// The layers along the rays of a view, from the closed surface of the particles in view.
///
///   front  [pixels] depths that the view's pixels show, world units; kNoSurface
Layers run_layers(Device& device, const View& view, const WorldParticles& particles,
                  const std::vector<float>& front, const Parameters& params,
                  std::vector<StageTime>* timings);

}  // namespace meniscus
