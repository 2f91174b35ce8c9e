// What trust is told from, in double precision: loops over all particles and fits
// (stages/fit/trust.hpp).
#pragma once

#include <algorithm>
#include <vector>

#include "stages/fit/trust.hpp"
#include "verify/reference/density.hpp"
#include "verify/reference/sheet.hpp"

namespace meniscus::reference {

struct SheetSurroundings {
  SheetMean dense, deep, apart;
};

/// The means of measure_surroundings(), of fits whose feet and normals are known, in the field of
/// `particles`.
inline std::vector<SheetSurroundings> surroundings_of(const Projected& particles,
                                                      const ParticleFits& fits) {
  const std::size_t n = fits.size();
  std::vector<float> share(n), dense(n), deep(n), apart(n);
  double off = 0;  // of a density, at most
  const auto density_at = [&](const Vec3d& at) {
    const double value = density(particles, at);
    // A point is good to three epsilon along each axis; no density rises by more than one a radius.
    const double moved = 3 * kEpsilon * (std::abs(at.x) + std::abs(at.y) + std::abs(at.z));
    off = std::max(off, density_error(particles, at, value) + moved);
    return static_cast<float>(value);
  };
  for (std::size_t k = 0; k < n; ++k) {
    share[k] = fits.residual[k] < 0 ? 0 : static_cast<float>(fits.firmness[k]);
    dense[k] = density_at(fits.foot[k]);
    deep[k] = density_at(fits.foot[k] - fits.normal[k] * 3);
    apart[k] = static_cast<float>(fits.spread[k]);
  }
  std::vector<SheetSurroundings> result;
  for (std::size_t k = 0; k < n; ++k) {
    const auto mean = [&](const std::vector<float>& value, double value_off) {
      SheetMean of = sheet_mean(fits.position, fits.normal, share, value, k, {5, 0.4f, 0.6f});
      of.error += value_off;
      return of;
    };
    result.push_back({mean(dense, off), mean(deep, off), mean(apart, 0)});
  }
  return result;
}

}  // namespace meniscus::reference
