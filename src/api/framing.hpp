// Cameras that frame particles.
#pragma once

#include <vector>

#include "meniscus/camera.hpp"
#include "meniscus/source.hpp"

namespace meniscus {

/// The camera that shows the particles of all sources, obliquely from above and from the right, as
/// large as the image allows; a few that a simulation threw away may be outside. Sources without
/// particles count for nothing. Throws InvalidArgument for a field of view, a size or an `up` that
/// is not valid.
Camera frame_sources(const std::vector<const ParticleSource*>& sources, const Framing& framing);

}  // namespace meniscus
