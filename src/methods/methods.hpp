// One function a method: the stages in order, and nothing else.
#pragma once

#include "pipeline.hpp"

namespace meniscus {

Extraction run_fit(Device& device, const View& view, const WorldParticles& particles,
                   const Parameters& params, std::vector<StageTime>* timings);
Extraction run_paper(Device& device, const View& view, const WorldParticles& particles,
                     const Parameters& params, std::vector<StageTime>* timings);
Extraction run_stable(Device& device, const View& view, const WorldParticles& particles,
                      const Parameters& params, std::vector<StageTime>* timings);

Extraction run_ssm(Device& device, const View& view, const WorldParticles& particles,
                   const Parameters& params, std::vector<StageTime>* timings);

}  // namespace meniscus
