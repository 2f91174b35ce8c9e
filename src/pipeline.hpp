// The stages in order.
#pragma once

#include <vector>

#include "meniscus/meniscus.hpp"
#include "stages/project.hpp"
#include "stages/stage_data.hpp"

namespace meniscus {

/// What the pipeline makes of one frame, in eye space and particle radii.
struct Extraction {
  SurfaceMap image;             // at pixel centres; empty unless params.image
  Mesh mesh;                    // world space; empty unless params.mesh
  std::vector<float> residual;  // [groups] RMS fit residual, particle radii
  std::vector<std::pair<std::string, std::int64_t>> counts;
};

/// Runs the method of `params` on particles in canonical order.
Extraction run_pipeline(Device& device, const View& view, const WorldParticles& particles,
                        const Parameters& params, std::vector<StageTime>* timings);

}  // namespace meniscus
