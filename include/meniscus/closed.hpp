// All of the fluid's surface as one closed mesh, without a camera.
#pragma once

#include <cstddef>
#include <vector>

#include "meniscus/borrowed.hpp"
#include "meniscus/export.hpp"
#include "meniscus/extract.hpp"
#include "meniscus/parameters.hpp"
#include "meniscus/source.hpp"
#include "meniscus/types.hpp"

namespace meniscus MENISCUS_API {

/// What ClosedParams::adaptive is for a mesh whose errors are those of the full one.
inline constexpr double kAdaptive = 0.05;  // particle radii

/// Parameters of closed meshes, beside Parameters.
struct ClosedParams {
  double cell = 1;  // side of the cells that are contoured, particle radii, .1 to 4
  /// How far the mesh may be from the vertices of the full one, particle radii, up to 1; fewer
  /// triangles where it is flat. 0: the full mesh.
  double adaptive = 0;
  /// What a frame of 2^18 particles and more may take beside its mesh, about; bytes. One that takes
  /// more is made in parts of space, as far as that saves memory. The mesh is the same.
  std::size_t memory = std::size_t{1} << 30;
};

/// Meshes all of the fluid: method fit's implicit function with a quadric around every particle of
/// the surface, contoured by dual contouring, so that creases stay sharp, and edges straightened
/// where faces beside them are flat.
///
///   particles   any order; the result does not depend on it. Of a source that is read in parts no
///               more are held than closed.memory has room for
///   parameters  of method fit; what concerns cameras and maps has no effect
///   timings     when given, receives an entry each time a stage runs, in order
///
/// Returns a surface without camera and maps. Its mesh is closed (every edge has two triangles),
/// manifold, and counter-clockwise seen from outside; normals point outward; velocities and
/// attributes are there where the particles carry them. Empty, with a warning, where there are no
/// particles. The same particles give the same mesh on every device, with any number of threads.
///
/// Throws InvalidArgument for bad parameters or arrays, for a method other than fit, and where
/// cells are so small that the mesh would be too large; InputError for values that are not finite
/// where parameters.strict is set; DeviceError when the device fails.
Surface extract_closed(Device& device, const Particles& particles, const ClosedParams& closed = {},
                       const Parameters& parameters = {},
                       std::vector<StageTime>* timings = nullptr);
Surface extract_closed(Device& device, const BorrowedParticles& particles,
                       const ClosedParams& closed = {}, const Parameters& parameters = {},
                       std::vector<StageTime>* timings = nullptr);
Surface extract_closed(Device& device, const ParticleSource& source,
                       const ClosedParams& closed = {}, const Parameters& parameters = {},
                       std::vector<StageTime>* timings = nullptr);

/// Throws InvalidArgument where a cell or a tolerance is out of its range.
void check(const ClosedParams& closed);

}  // namespace MENISCUS_API
