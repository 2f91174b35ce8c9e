// Peers that make a mesh of all particles, as programs of their own (benchmarks/peers).
#pragma once

#include <string>

#include "meniscus/types.hpp"

namespace meniscus::accuracy {

/// splashsurf (Loeschner, Boettcher, Jeske, Bender: Weighted Laplacian Smoothing for Surface
/// Reconstruction of Particle-based Fluids, 2023). Runs `program reconstruct` with the smooth
/// settings of its authors: smoothing length 2 and cubes of 0.5 particle radii, threshold 0.6, 25
/// rounds of weighted smoothing, clean-up, normals smoothed 10 times. `program` is a path or a name
/// to be found in PATH. Throws Error when it is not found or fails, with the last line that it
/// wrote.
Mesh reconstruct_with_splashsurf(const std::string& program, const Particles& particles,
                                 double particle_radius);

/// OpenVDB's spheres as a level set, smoothed by mean curvature, by the program that
/// benchmarks/peers/openvdb.sh builds, with the settings that it has found best. Throws as above.
Mesh reconstruct_with_openvdb(const std::string& program, const Particles& particles,
                              double particle_radius);

}  // namespace meniscus::accuracy
