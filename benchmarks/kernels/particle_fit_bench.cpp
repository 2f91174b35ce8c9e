#include <algorithm>
#include <bit>

#include "kernels/cases.hpp"
#include "kernels/fit_problems.hpp"
#include "stages/fit/particle_fit.hpp"

namespace meniscus::bench {
namespace {

// How many values differ in their bits; all of them when the sizes do.
std::size_t count_differing(const std::vector<float>& a, const std::vector<float>& b) {
  if (a.size() != b.size()) return std::max(a.size(), b.size());
  std::size_t count = 0;
  for (std::size_t k = 0; k < a.size(); ++k)
    count += std::bit_cast<std::uint32_t>(a[k]) != std::bit_cast<std::uint32_t>(b[k]);
  return count;
}

}  // namespace

Case prepare_fit(Frame& frame) {
  const auto problems = fit_problems(frame);
  Case result{.unit = "fits", .items = problems->fits};
  // A neighbour's index read and its weight written; a fit's particle and support read, eleven
  // values and a normal written.
  result.bytes = 8 * problems->neighbours + 96 * problems->fits;
  // A neighbour: difference 3, square 5, normals 7, parabola 4, height 5, its width 2,
  // its share 3, the weight of all 24; q and d 6, products of two coordinates 6, e 12, o 15,
  // weighted 26; moments of degree 0 to 2: 13, of degree 3: 40, of degree 4: 90; the right-hand
  // side 19. A fit: ridge 21, Cholesky 415, substitution 200, slope 7, scale 14, its normal 17.
  result.operations = (53 + 227) * problems->neighbours + 674 * problems->fits;
  FitParams once = frame.params.fit;
  once.passes = 1;
  const auto fits = std::make_shared<ParticleFits>();
  result.launch = [&frame, once, fits] {
    *fits = fit_particles(frame.device, frame.projected(), frame.rim(), frame.surface(), once);
  };
  result.native = [problems](Workers& workers) { fit(*problems, workers); };
  result.differing = [problems, fits, offset = static_cast<float>(once.offset)] {
    const std::size_t lanes = problems->lists.fit.size();
    std::vector<float> own, device;
    for (std::size_t lane = 0; lane < lanes; ++lane) {
      if (problems->lists.fit[lane] < 0) continue;
      const std::size_t k = static_cast<std::size_t>(problems->lists.fit[lane]);
      own.push_back(problems->residual[lane]);  // 0 for a fit: measure_edges takes it
      device.push_back(std::min(fits->residual[k], 0.0f));
      for (std::size_t row = 0; row < 10; ++row) {
        const bool moved = row == 0 && problems->residual[lane] >= 0;
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
  Case result{.unit = "fits", .items = problems->fits};
  // A neighbour's index and weight read; a fit's particle and quadric read, seven values written.
  result.bytes = 8 * problems->neighbours + 100 * problems->fits;
  // A neighbour: difference 3, square 5, normals 6, distance 3, share 8, parabola 4, weight 23,
  // quadric 18, sums 8; the residual: distance behind 2, exponential 22, sums 4.
  result.operations = 106 * problems->neighbours;
  result.launch = [&frame] {
    fit_particles(frame.device, frame.projected(), frame.rim(), frame.surface(), frame.params.fit);
  };
  return result;
}

}  // namespace meniscus::bench
