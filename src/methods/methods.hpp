// One function a method: the stages in order, and nothing else.
#pragma once

#include "pipeline.hpp"
#include "stages/splash.hpp"
#include "stages/triangulate.hpp"

namespace meniscus {

Extraction run_fit(Device& device, const View& view, const WorldParticles& particles,
                   const Parameters& params, std::vector<StageTime>* timings);
Extraction run_paper(Device& device, const View& view, const WorldParticles& particles,
                     const Parameters& params, std::vector<StageTime>* timings);
Extraction run_stable(Device& device, const View& view, const WorldParticles& particles,
                      const Parameters& params, std::vector<StageTime>* timings);

Extraction run_ssm(Device& device, const View& view, const WorldParticles& particles,
                   const Parameters& params, std::vector<StageTime>* timings);

/// How many particles there are, how many of them are where, and the triangles between them.
std::vector<std::pair<std::string, std::int64_t>> count_particles(const WorldParticles& particles,
                                                                  const Projected& projected,
                                                                  const SplashSplit& split,
                                                                  const Visible& visible,
                                                                  const Triangulation& mesh);

}  // namespace meniscus
