// Particles that crowd where there is room for one. What a frame costs grows with the square of how
// many lie near each other, what it shows does not.
#pragma once

#include <cstddef>
#include <vector>

#include "base/notices.hpp"
#include "meniscus/borrowed.hpp"

namespace meniscus {

/// An order without most of its crowds. More than 16 particles in a cube whose side is their
/// spacing (two radii) are a crowd, of which one stays at each position, and where that is still a
/// crowd 4, drawn by a hash of their positions. Warns of those dropped, and where the particles lie
/// so close everywhere that the radius must be wrong.
///
///   order   canonical
///   radius  of the particles, world units
std::vector<std::size_t> without_crowds(const BorrowedParticles& particles,
                                        std::vector<std::size_t> order, double radius,
                                        Notices& notices);

/// What without_crowds() warns of: that so many of `had` particles were dropped from cubes of up to
/// `largest`; that the particles lie so close together, or so far apart, that another radius would
/// fit, world units.
Notice crowded(std::size_t largest, std::size_t dropped, std::size_t had, double radius);
Notice radius_misfit(double radius, double fitting);

/// With a radius so many times too small the density field falls apart.
inline constexpr double kTooSmall = 1.6;

/// Fewer particles than that may be one drop, and do not tell whether the radius is right.
inline constexpr std::size_t kTelling = 256;

}  // namespace meniscus
