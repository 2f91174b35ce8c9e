// The layers along rays: the fits of the front, few more on the surface that the camera does not
// see, and a closed mesh of both (docs/layers.md).
#pragma once

#include <vector>

#include "device/stage_clock.hpp"
#include "methods/extraction.hpp"
#include "stages/extras/layers.hpp"
#include "stages/fit/particle_fit.hpp"
#include "stages/frame/density.hpp"

namespace meniscus {

/// What is known of a fluid once its front is made.
struct KnownFluid {
  const Projected& particles;
  const DeviceCells &cells, &levelled;  // of all of them, side kDensitySupport
  const SurfaceParticles& around;       // the surface's particles
  ParticleFits fits;                    // of the front
  std::vector<double> trust;            // [fits]
  std::vector<std::int32_t> fitted;     // [fits] the particles of these
};

/// The layers along the rays of a view.
///
///   front  [pixels] depths that the view's pixels show, world units; kNoSurface
Layers find_layers(Device& device, const View& view, KnownFluid known, std::vector<float> front,
                   const Parameters& params, StageClock& clock);

/// The same of particles whose front was made from others.
Layers run_layers(Device& device, const View& view, const WorldParticles& particles,
                  std::vector<float> front, const Parameters& params,
                  std::vector<StageTime>* timings);

/// The depths that pixels show, world units, with room for so many layers of them.
std::vector<float> front_of(Device& device, const View& view, const SurfaceBuffers& image,
                            int layers);

}  // namespace meniscus
