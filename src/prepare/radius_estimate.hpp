// The particle radius that the particles' spacing tells.
#pragma once

#include <cstddef>
#include <vector>

#include "meniscus/borrowed.hpp"

namespace meniscus {

/// Half the particles' spacing s.
struct RadiusEstimate {
  double radius = 0;           // world units; 0: there are no two particles apart
  double least = 0, most = 0;  // what narrower and wider surroundings tell, world units
  /// Whether neighbours keep their distance, as those of a fluid do: no gas, no drops.
  bool is_dense = false;
};

/// From how many particles a sphere inside the fluid holds: for up to `samples` particles spread
/// over the order, the sum of 1 - (d/R)^2 over all particles within R is 8 pi R^3 / (15 s^3)
/// inside, less at the surface; the 95th percentile is taken as inside. R is 2.5 times the median
/// distance to the nearest neighbour: a wider sphere does not fit into a jet of three particles'
/// width, and a narrower one holds few. (That distance alone says little: it is s on a lattice and
/// 0.79 s in a splashing fluid.) Where such spheres hold less than of any fluid there are drops and
/// no inside: then s is that median. Particles at one position count once: a solver that has failed
/// may leave most of them there.
///
///   order  of the particles with finite coordinates, canonical
RadiusEstimate estimate_radius(const BorrowedParticles& particles, std::vector<std::size_t> order,
                               std::size_t samples = 512);

}  // namespace meniscus
