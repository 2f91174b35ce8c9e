#include "kernels/cases.hpp"
#include "kernels/fit_problems.hpp"
#include "stages/particle_fit.hpp"

namespace meniscus::bench {

Case prepare_weigh(Frame& frame) {
  const auto problems = fit_problems(frame);
  Case result;
  result.unit = "fits";
  result.items = problems->fits;
  // A neighbour's index read, seven values of its slot written; a fit's particle read.
  result.bytes = 32 * problems->neighbours + 32 * problems->fits;
  // A neighbour: difference 3, square 5, normals 7, distance 3, spline 4, weight 24, height 5, its
  // width 2, the weight of both 26, slot 4.
  result.operations = 83 * problems->neighbours;
  FitParams once = frame.params.fit;
  once.passes = 1;
  const auto fits = std::make_shared<ParticleFits>();
  result.launch = [&frame, once, fits] {
    *fits = fit_particles(frame.device, frame.projected(), frame.rim(), frame.surface(), once);
  };
  result.native = [problems](Workers& workers) { weigh(*problems, workers); };
  // What comes back from the device is what fit_groups makes of the weights.
  result.differing = [problems, fits, offset = static_cast<float>(once.offset)] {
    Workers alone(1);
    fit(*problems, alone);
    const std::size_t lanes = problems->batches.lanes;
    std::vector<float> own, device;
    for (std::size_t lane = 0; lane < fits->size(); ++lane) {
      const std::size_t k = static_cast<std::size_t>(problems->batches.order[lane]);
      own.push_back(problems->quality[lane]);
      device.push_back(fits->residual[k]);
      for (std::size_t row = 0; row < 10; ++row) {
        const bool moved = row == 0 && problems->quality[lane] >= 0;
        own.push_back(problems->quadric[row * lanes + lane] - (moved ? offset : 0.0f));
        device.push_back(fits->quadric[k][row]);
      }
    }
    return count_differing(own, device);
  };
  return result;
}

Case prepare_edges(Frame& frame) {
  const auto problems = fit_problems(frame);
  Case result;
  result.unit = "fits";
  result.items = problems->fits;
  // A neighbour's index read; a fit's particle and quadric read, three values written.
  result.bytes = 4 * problems->neighbours + 84 * problems->fits;
  // A neighbour: difference 3, square 5, normals 6, distance 3, share 8, spline 4, weight 23,
  // quadric 18, sums 8.
  result.operations = 78 * problems->neighbours;
  result.launch = [&frame] {
    fit_particles(frame.device, frame.projected(), frame.rim(), frame.surface(), frame.params.fit);
  };
  return result;
}

}  // namespace meniscus::bench
