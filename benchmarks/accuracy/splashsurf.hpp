// splashsurf (Loeschner, Boettcher, Jeske, Bender: Weighted Laplacian Smoothing for Surface
// Reconstruction of Particle-based Fluids, 2023), a mesh reconstruction that sees all particles.
#pragma once

#include <string>

#include "meniscus/types.hpp"

namespace meniscus::accuracy {

/// Runs `program reconstruct` with the smooth settings of its authors: smoothing length 2 and cubes
/// of 0.5 particle radii, threshold 0.6, 25 rounds of weighted smoothing, clean-up, normals
/// smoothed 10 times. `program` is a path or a name to be found in PATH. Throws Error when it is
/// not found or fails, with the last line that it wrote.
Mesh reconstruct_with_splashsurf(const std::string& program, const Particles& particles,
                                 double particle_radius);

}  // namespace meniscus::accuracy
