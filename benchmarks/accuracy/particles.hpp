// Particles that fill a solid the way a relaxed simulation does.
#pragma once

#include <cstdint>
#include <vector>

#include "accuracy/scene.hpp"
#include "meniscus/types.hpp"

namespace meniscus::accuracy {

/// volume(scene) particles (rounded) at a depth of at least s/2: a jittered, rotated lattice,
/// filled up at random where the shell next to the surface has taken room away, then relaxed.
std::vector<Vec3d> fill(const Scene& scene, std::uint64_t seed);

/// Adds a Gaussian of standard deviation `sigma` (s) to each coordinate.
void add_noise(std::vector<Vec3d>& points, double sigma, std::uint64_t seed);

/// fill and add_noise, as the library takes particles; particle_radius is s/2.
Particles make_particles(const Scene& scene, double noise, std::uint64_t seed);

}  // namespace meniscus::accuracy
