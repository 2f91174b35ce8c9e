#include "stages/trust.hpp"

#include <cmath>

#include "parallel.hpp"

namespace meniscus {

std::vector<double> measure_trust(Device& device, const ParticleFits& fits,
                                  const DeviceCells& cells) {
  constexpr float kReach = 5;  // particle radii
  const std::vector<float> density = measure_density(device, cells, fits.foot);
  std::vector<float> x(fits.size()), y(fits.size()), z(fits.size());
  for (std::size_t k = 0; k < fits.size(); ++k) {
    x[k] = static_cast<float>(fits.position[k].x);
    y[k] = static_cast<float>(fits.position[k].y);
    z[k] = static_cast<float>(fits.position[k].z);
  }
  const Cells near = make_cells(x, y, z, kReach);
  // What sums take of each fit, in the order in which they find it.
  struct Near {
    Vec3d normal;
    double edge;  // 0: no fit
    double density, spread;
  };
  std::vector<Near> found;
  found.reserve(fits.size());
  for (const std::int32_t item : near.item) {
    const std::size_t j = static_cast<std::size_t>(item);
    const double edge = fits.residual[j] < 0 ? 0 : fits.edge[j];
    found.push_back({fits.normal[j], edge, density[j], fits.spread[j]});
  }
  std::vector<double> trust(fits.size(), 0.0);
  constexpr std::size_t kGrain = 128;  // fits that are worth a thread
  parallel_for(fits.size(), kGrain, [&](std::size_t begin, std::size_t end) {
    for (std::size_t k = begin; k < end; ++k) {
      if (fits.residual[k] < 0) continue;
      double weight = 0, dense = 0, apart = 0;
      visit_near(near, x[k], y[k], z[k], [&](std::int32_t p) {
        const Vec3d apart_by = Vec3d{near.x[p], near.y[p], near.z[p]} - fits.position[k];
        const double squared = dot(apart_by, apart_by);
        if (squared >= kReach * kReach) return true;  // most of them, without the root
        const Near& other = found[static_cast<std::size_t>(p)];
        if (!(other.edge > 0) || dot(other.normal, fits.normal[k]) < 0.5) return true;
        const double w = (1 - std::sqrt(squared) / kReach) * other.edge;
        weight += w;
        dense += w * other.density;
        apart += w * other.spread;
        return true;
      });
      trust[k] = smooth_step(0.24, 0.33, dense / weight) * smooth_step(5, 12, fits.supporters[k]) *
                 (1 - smooth_step(0.45, 0.75, apart / weight));
    }
  });
  return trust;
}

}  // namespace meniscus
