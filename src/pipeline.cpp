// The way into the methods; each is a table of contents of its own in methods/.
#include "pipeline.hpp"

#include "methods/methods.hpp"

namespace meniscus {

Extraction run_pipeline(Device& device, const View& view, const WorldParticles& particles,
                        const Parameters& params, std::vector<StageTime>* timings) {
  switch (params.method) {
    case Method::paper:
      return run_paper(device, view, particles, params, timings);
    case Method::ssm:
      return run_ssm(device, view, particles, params, timings);
    case Method::stable:
      return run_stable(device, view, particles, params, timings);
    default:
      return run_fit(device, view, particles, params, timings);
  }
}

}  // namespace meniscus
