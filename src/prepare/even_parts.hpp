// even_parts: evens out the irregular particles of a frame that passes in parts (relax.hpp), before
// any part is meshed. Where a particle goes depends on all within 75 radii. So parts are evened out
// with these around them, once, rather than meshed with as much more around them.
#pragma once

#include <vector>

#include "prepare/parts.hpp"
#include "stages/frame/relax.hpp"

namespace meniscus {

/// Evens out all particles of a frame, a part of space after another. All processes of the source's
/// team call this.
///
///   block    side of a block of cells, particle radii
///   tallies  gets what the parts had
///
/// Returns where the particles of this process's share go, with the bits of even_out() of all of
/// them together.
EvenedPlaces even_out_in_parts(const Filling& filling, const ParticleSource& source,
                               const PartedFrame& frame, const Disorder& disorder, double block,
                               std::vector<PartTally>& tallies);

}  // namespace meniscus
