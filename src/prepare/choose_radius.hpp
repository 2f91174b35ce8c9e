// The radius of a frame's particles, wherever they come from.
#pragma once

#include <cstdint>
#include <functional>
#include <string>
#include <vector>

#include "meniscus/borrowed.hpp"
#include "meniscus/notice.hpp"
#include "meniscus/parameters.hpp"
#include "meniscus/source.hpp"
#include "prepare/radius_estimate.hpp"

namespace meniscus {

/// What tells how large a frame's particles are, world units; 0: nothing does.
struct RadiusClues {
  double middle = 0;  // of the particles' own radii
  double stated = 0;  // by the file, or by who made the particles
};

/// The particle radius (world units): the parameters', else the middle of the particles' own, else
/// the one stated, else an estimate from the spacing, with a notice.
///
///   estimate  is called where nothing else tells; empty: there are no particles, any radius does
double choose_radius(const Parameters& params, const RadiusClues& clues,
                     const std::function<RadiusEstimate()>& estimate, std::vector<Notice>& notices);

/// The same of all particles of a source, in every process of its team. Throws InputError as
/// survey_of(), and where nothing tells and the particles are too many to estimate it.
double choose_radius(const ParticleSource& source, const Parameters& params,
                     std::vector<Notice>& notices);

}  // namespace meniscus
