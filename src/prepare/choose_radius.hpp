// The radius of a frame's particles, wherever they come from.
#pragma once

#include <functional>
#include <vector>

#include "base/notices.hpp"
#include "meniscus/borrowed.hpp"
#include "meniscus/parameters.hpp"
#include "meniscus/source.hpp"
#include "prepare/radius_estimate.hpp"

namespace meniscus {

/// What tells how large a frame's particles are, world units; 0: nothing does.
struct RadiusClues {
  double least = 0, middle = 0, most = 0;  // of the particles' own radii
  double stated = 0;                       // by the file, or by who made the particles
};

/// What a source and a survey of it tell.
RadiusClues clues_of(const Survey& survey, const ParticleSource& source);

/// Whether particles with radii of their own are drawn in their own sizes. Methods that draw
/// spheres do so with any radii. The others take neighbours for as large as each other: with them
/// all radii must be within a factor of 1.5 of the frame's `radius` (world units), else all
/// particles have it.
bool draws_own_sizes(const Parameters& params, const RadiusClues& clues, double radius);

/// The particle radius (world units): the parameters', else the middle of the particles' own, with
/// a notice where they are not drawn in their own sizes, else the one stated, else an estimate from
/// the spacing, with a notice.
///
///   estimate  is called where nothing else tells; empty: there are no particles, any radius does
double choose_radius(const Parameters& params, const RadiusClues& clues,
                     const std::function<RadiusEstimate()>& estimate, Notices& notices);

/// The same of all particles of a source, in every process of its team. Throws InputError as
/// survey_of(), and where nothing tells and the particles are too many to estimate it.
double choose_radius(const ParticleSource& source, const Parameters& params, Notices& notices);

}  // namespace meniscus
