#include "prepare/origin.hpp"

#include <algorithm>
#include <cfloat>
#include <cmath>
#include <cstddef>

#include "base/printed.hpp"

namespace meniscus {

// In floats throughout: where doubles were rounded to floats and back, GCC 12 left the rounding out
// of two axes of three.
std::array<double, 3> origin_of(const std::array<float, 3>& low, const std::array<float, 3>& high,
                                const std::vector<std::array<float, 3>>& sample) {
  // The bulk is all but the twentieth at either end. Floats have 24 bits: with bounds of a hundred
  // times the bulk a particle of a bulk of a thousand still keeps a hundredth of its radius.
  constexpr std::size_t kTail = 20;
  constexpr float kWidened = 100;
  std::array<double, 3> origin;
  std::vector<float> values(sample.size());
  for (std::size_t k = 0; k < 3; ++k) {
    float first = low[k], last = high[k];
    if (!sample.empty()) {
      std::transform(sample.begin(), sample.end(), values.begin(),
                     [k](const std::array<float, 3>& at) { return at[k]; });
      const auto place = [&](std::size_t n) {
        return values.begin() + static_cast<std::ptrdiff_t>(n);
      };
      const std::size_t tail = (sample.size() - 1) / kTail;
      std::nth_element(values.begin(), place(tail), values.end());
      const float from = *place(tail);
      std::nth_element(values.begin(), place(sample.size() - 1 - tail), values.end());
      const float to = *place(sample.size() - 1 - tail);
      // Halves, because bounds may lie as far apart as floats reach.
      if (0.5f * high[k] - 0.5f * low[k] > kWidened * (0.5f * to - 0.5f * from)) {
        first = from;
        last = to;
      }
    }
    origin[k] = 0.5f * first + 0.5f * last;
  }
  return origin;
}

void warn_of_coarse_positions(const View& view, double particle_radius, Notices& notices) {
  // View radii, which representatives have larger; rounding loses up to half of it, as much as the
  // error of `fit`.
  constexpr double kCoarse = 0.1;
  double farthest = 0;
  for (const double x : {view.origin.x, view.origin.y, view.origin.z})
    farthest = std::max(farthest, std::abs(x));
  const double step = farthest * FLT_EPSILON;
  if (!(step > kCoarse * view.radius)) return;
  notices.add(
      {.code = Code::coarse_positions,
       .text = printed("the particles lie %g from the origin, where single precision has steps of "
                       "%.2g, and their radius is %g: positions are rounded (move them to the "
                       "origin where they are written)",
                       farthest, step, particle_radius),
       .found = step,
       .wanted = kCoarse * view.radius});
}

}  // namespace meniscus
