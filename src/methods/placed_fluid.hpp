// Particles where a method works on them: placed by a view, evened out where they lie irregularly
// (relax.hpp), and in the unit of length that their disorder wants.
#pragma once

#include <functional>
#include <optional>

#include "device/stage_clock.hpp"
#include "meniscus/parameters.hpp"
#include "stages/frame/cells.hpp"
#include "stages/frame/project.hpp"
#include "stages/frame/relax.hpp"
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

/// The fluid with particles in its voids (voids.hpp), behind all others; without a camera. Nothing
/// where it has none, as where particles do not lie anywhere.
std::optional<PlacedFluid> with_voids(const PlacedFluid& fluid);

/// How far around a particle others bear on whether with_voids() puts one there; in the disorder's
/// unit of length.
double filling_influence(const Disorder& disorder);

}  // namespace meniscus
