// Whether a frame's radius fits the spacing of particles that stream past.
#pragma once

#include <vector>

#include "base/notices.hpp"
#include "meniscus/source.hpp"
#include "prepare/survey.hpp"

namespace meniscus {

/// Warns as radius_misfit() where the particles of a source lie less than 1/1.6 or more than 1.6
/// times as far apart as their radius (world units) says. The survey's sample tells about how far
/// that is. Only where it contradicts the radius are the particles read once more, to look at all
/// of those in some places. Particles that keep no distance, as those of rain, tell nothing. All
/// processes of the source's team call this. Returns whether it has warned. Throws InputError.
bool check_radius(const ParticleSource& source, const Survey& survey, double radius,
                  Notices& notices);

}  // namespace meniscus
