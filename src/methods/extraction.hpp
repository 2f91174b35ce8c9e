// What a method makes of a frame, and what all methods fill in alike.
#pragma once

#include <vector>

#include "meniscus/extract.hpp"
#include "stages/frame/project.hpp"
#include "stages/frame/relax.hpp"
#include "stages/frame/splash.hpp"
#include "stages/sample/surface_buffers.hpp"
#include "stages/sheet/triangulate.hpp"
#include "stages/view.hpp"

namespace meniscus {

/// What a method makes of one frame.
struct Extraction {
  SurfaceBuffers image;               // at pixel centres, on the device, in eye space and the
                                      // disorder's unit of length; empty unless params.image
  std::vector<Vec3> velocity;         // [pixels] world axes, world units per second; empty: unknown
  std::vector<Attribute> attributes;  // [pixels] each
  Layers layers;                      // empty unless params.layers
  Mesh mesh;                          // world space; empty unless params.mesh
  std::vector<float> residual;        // [groups] RMS fit residual, particle radii
  Counts counts;                      // of the method
  Disorder disorder;                  // of the particles
  View view;                          // in its unit of length; set by run_pipeline()
};

/// How many particles there are and how many of them are in view; with more, how many of them are
/// where, and the triangles between them.
Counts count_particles(const WorldParticles& particles, const Projected& projected);
Counts count_particles(const WorldParticles& particles, const Projected& projected,
                       const SplashSplit& split, const Visible& visible, const Triangulation& mesh);

/// Carries what particles have to what was made of them: velocities and attributes, to samples and
/// vertices.
///
///   projected  the particles within kMotionMargin
void carry_values(Device& device, const View& view, const Projected& projected,
                  const WorldParticles& particles, const Parameters& params, Extraction& made);

}  // namespace meniscus
