// Particles that fill a solid the way a relaxed simulation does.
#pragma once

#include <cstdint>
#include <vector>

#include "accuracy/scene.hpp"
#include "meniscus/types.hpp"

namespace meniscus::accuracy {

/// Particles at a depth of at least s/2: a jittered, rotated lattice of the right mass everywhere,
/// thin parts too, whose outer shell is pushed in, then relaxed. Calm scenes have volume(scene) of
/// them (rounded); in violent ones the mass of each drop is right to a particle or two.
std::vector<Vec3d> fill(const Scene& scene, std::uint64_t seed);

/// How a solid is filled.
enum class Filling {
  relaxed,       // fill
  lattice,       // the cells of a cubic lattice whose centres lie inside: the mass is right
  deep_lattice,  // those whose centres lie s/2 deep: the layer next to the surface is missing
  random,        // at_random
};

/// Corners of a cubic lattice of spacing s that lie at least `depth` (s) inside, unrelaxed and
/// without jitter. The seed decides where the lattice's origin lies; its axes are the world's.
std::vector<Vec3d> lattice(const Scene& scene, double depth, std::uint64_t seed);

/// One particle for each s^3 of the solid, anywhere in it: as FLIP and MPM fill it and keep it.
std::vector<Vec3d> at_random(const Scene& scene, std::uint64_t seed);

/// Adds a Gaussian of standard deviation `sigma` (s) to each coordinate.
void add_noise(std::vector<Vec3d>& points, double sigma, std::uint64_t seed);

/// The filled solid with noise added and the splash as it is, because its truth is made from it, as
/// the library takes particles; particle_radius is s/2.
Particles make_particles(const Scene& scene, double noise, std::uint64_t seed,
                         Filling filling = Filling::relaxed);

/// The particles with a Gaussian of `sigma` (s) added anew in each frame.
Particles jittered(Particles particles, double sigma, std::uint64_t seed, int frame);

}  // namespace meniscus::accuracy
