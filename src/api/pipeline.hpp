// A method, and the motion of what it makes. The stages in order are in methods/.
#pragma once

#include <vector>

#include "meniscus/meniscus.hpp"
#include "stages/project.hpp"
#include "stages/surface_buffers.hpp"

namespace meniscus {

/// What the pipeline makes of one frame, in eye space and particle radii.
struct Extraction {
  SurfaceBuffers image;               // at pixel centres, on the device; empty unless params.image
  std::vector<Vec3> velocity;         // [pixels] world axes, world units per second; empty: unknown
  std::vector<Attribute> attributes;  // [pixels] each
  Layers layers;                      // empty unless params.layers
  Mesh mesh;                          // world space; empty unless params.mesh
  std::vector<float> residual;        // [groups] RMS fit residual, particle radii
  Counts counts;                      // of the method
  double disorder = 0;                // of the particles (relax.hpp)
};

/// Runs the method of `params` on particles in canonical order.
Extraction run_pipeline(Device& device, const View& view, const WorldParticles& particles,
                        const Parameters& params, std::vector<StageTime>* timings);

/// Carries what particles have to what was made of them: velocities and attributes, to samples and
/// vertices.
///
///   projected  the particles within kMotionMargin
void carry_values(Device& device, const View& view, const Projected& projected,
                  const WorldParticles& particles, const Parameters& params, Extraction& made);

}  // namespace meniscus
