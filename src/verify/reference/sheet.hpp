// Means over the fits of a sheet, in double precision: a loop over all fits
// (stages/sheet/sheet.hpp).
#pragma once

#include <algorithm>
#include <vector>

#include "stages/sheet/sheet.hpp"
#include "verify/reference/epsilon.hpp"

namespace meniscus::reference {

struct SheetMean {
  double weight = 0;  // in all
  double mean = 0, error = 0;
};

/// The mean of `value` [n] around fit k, weights share (1 - l / reach) alike(j), which is 0 to 1 and
/// good to `off_alike` epsilon.
template <class Alike>
SheetMean mean_around(const std::vector<Vec3d>& position, const std::vector<float>& share,
                      const std::vector<float>& value, std::size_t k, double reach,
                      double off_alike, const Alike& alike) {
  SheetMean result;
  double sum = 0, off = 0;
  // The distance, of numbers near 30, is good to four epsilon and its quotient; a weight rounds ten
  // times.
  for (std::size_t j = 0; j < position.size(); ++j) {
    const double l = length(position[j] - position[k]);
    if (l >= reach + 1e-3) continue;
    off += (off_alike + 20) * kEpsilon * std::abs(value[j]);
    const double w = share[j] * std::max(0.0, 1 - l / reach) * alike(j);
    sum += w * value[j];
    result.weight += w;
  }
  if (result.weight == 0) return result;
  result.mean = sum / result.weight;
  const double rounding =
      static_cast<double>(position.size() + 4) * kEpsilon * std::abs(result.mean);
  result.error = 2 * off / result.weight + 2 * rounding;
  return result;
}

/// Whatever the normals are.
inline SheetMean mean_around(const std::vector<Vec3d>& position, const std::vector<float>& share,
                             const std::vector<float>& value, std::size_t k, double reach) {
  return mean_around(position, share, value, k, reach, 0, [](std::size_t) { return 1.0; });
}

/// Over the sheet: alike is smoothstep(low, high, n.n').
inline SheetMean sheet_mean(const std::vector<Vec3d>& position, const std::vector<Vec3d>& normal,
                            const std::vector<float>& share, const std::vector<float>& value,
                            std::size_t k, const SheetWeights& weights) {
  // n.n' is good to four epsilon, which the smoothstep passes on by its steepest slope.
  const double slope = 1.5 / (static_cast<double>(weights.high) - weights.low);
  return mean_around(position, share, value, k, weights.reach, 4 * slope, [&](std::size_t j) {
    return smooth_step(weights.low, weights.high, dot(normal[j], normal[k]));
  });
}

}  // namespace meniscus::reference
