// collect: all particles of a source in one place.
#pragma once

#include <vector>

#include "meniscus/source.hpp"
#include "meniscus/types.hpp"

namespace meniscus {

/// All particles, in the frame's order, in the first process of the source's team; the others get
/// none.
Particles read_all(const ParticleSource& source);

/// The arrays of numbers that particles have: positions, velocities, radii and attributes, each of
/// which may be empty.
std::vector<std::vector<float>*> arrays_of(Particles& particles);

}  // namespace meniscus
