// Particles where a method works on them: placed by a view, evened out where they lie irregularly
// (relax.hpp), and in the unit of length that their disorder wants.
#pragma once

#include <cstddef>
#include <functional>

#include "device/stage_clock.hpp"
#include "meniscus/parameters.hpp"
#include "stages/cells.hpp"
#include "stages/project.hpp"
#include "stages/relax.hpp"
#include "stages/view.hpp"

namespace meniscus {

struct PlacedFluid {
  View view;  // in the disorder's unit of length, as all that follows
  Disorder disorder;
  Projected particles;  // where they lie irregularly, evened out
  Cells host_cells;     // of them, side kDensitySupport
};

/// Places particles by a view, as `place` does it: a second time where their disorder wants another
/// unit of length than the view's.
PlacedFluid place_fluid(const View& view, const Parameters& params, StageClock& clock,
                        const std::function<Projected(const View& view)>& place);

/// The same of particles that have been evened out in the unit of their disorder.
PlacedFluid evened_fluid(const View& view, const Disorder& disorder, Projected particles);

/// Puts particles into the voids of a fluid whose particles lie anywhere (voids.hpp), behind all
/// others; without a camera. Returns how many there were before.
std::size_t fill_voids(PlacedFluid& fluid);

/// Takes all but the first `count` particles away; the cells keep them.
void keep_first(std::size_t count, PlacedFluid& fluid);

/// How far around a particle others bear on whether fill_voids() puts one there; in the disorder's
/// unit of length.
double filling_influence(const Disorder& disorder);

}  // namespace meniscus
