// voids: places inside an irregular fluid where by chance no particle lies.
//
// Particles anywhere leave gaps that are as large as several of them, also after they were evened
// out (relax.hpp). The density field takes a gap for air, and where gaps near the surface hang
// together, the surface has a pit (docs/mesh.md). What is fluid nearly all around is fluid, too.
#pragma once

#include <vector>

#include "stages/frame/cells.hpp"
#include "stages/frame/relax.hpp"
#include "stages/vec.hpp"

namespace meniscus {

/// Places of a cubic lattice that are voids: no particle lies within a spacing, but within
/// kDensitySupport there are three fifths or more of as many as there are inside the fluid, and in
/// all directions: what lies on two sides alone leaves a slit. Of voids within a spacing of each
/// other the one that is farthest from all particles. By z, then y, then x, whatever the order of
/// the particles.
///
///   cells     of the particles, side kDensitySupport
///   disorder  whose spacing and unit of length the particles have
std::vector<Vec3d> find_voids(const Cells& cells, const Disorder& disorder);

/// What lies farther away from a place than this does not change whether it is a void; in the
/// disorder's unit of length.
double void_influence(const Disorder& disorder);

}  // namespace meniscus
