#include "stages/trust.hpp"

#include <utility>

#include "base/parallel.hpp"
#include "stages/sheet.hpp"

namespace meniscus {
namespace {

constexpr SheetWeights kSheet{5, 0.4f, 0.6f};

// Where fits' surroundings lie farther from them than this (RMS, particle radii; by the higher one
// in full), a trace less than full trust has every sample compared with the density field
// (settle.cl).
constexpr double kComparedFrom = 0.3, kCompared = 0.4, kTrace = 0.01;

// Water is thin where the density this far behind the feet (particle radii) is below these.
constexpr double kDeep = 3, kThin = 0.5, kThick = 0.8;

// Thin water is a sheet, as fits are, where it is flat, wide, which the number of a fit's
// neighbours tells, and smooth: its surroundings lie no farther from it than this. Else it is arms
// and drops.
constexpr double kNarrow = 40, kWide = 80, kSmooth = 0.25, kRough = 0.4;

}  // namespace

std::vector<double> measure_trust(Device& device, const ParticleFits& fits,
                                  const DeviceCells& cells) {
  const std::size_t n = fits.size();
  std::vector<float> firm(n), spread(n), density, behind;
  Cells around;
  parallel_both(
      [&] {
        std::vector<Vec3d> points = fits.foot;
        points.reserve(2 * n);
        for (std::size_t k = 0; k < n; ++k) points.push_back(fits.foot[k] - fits.normal[k] * kDeep);
        density = measure_density(device, cells, points);
        behind.assign(density.begin() + static_cast<std::ptrdiff_t>(n), density.end());
        density.resize(n);
      },
      [&] {
        around = make_cells(fits.position, kSheet.reach);
        for (std::size_t k = 0; k < n; ++k) {
          firm[k] = fits.residual[k] < 0 ? 0 : static_cast<float>(fits.firmness[k]);
          spread[k] = static_cast<float>(fits.spread[k]);
        }
      });
  const std::vector<std::vector<float>> means =
      average_in_cells(device, around, fits.normal, firm,
                       {std::move(density), std::move(spread), std::move(behind)}, kSheet);
  const std::vector<float>&dense = means[0], &apart = means[1], &deep = means[2];
  std::vector<double> trust(n, 0.0);
  constexpr std::size_t kGrain = 1024;  // fits that are worth a thread
  parallel_for(n, kGrain, [&](std::size_t begin, std::size_t end) {
    for (std::size_t k = begin; k < end; ++k)
      if (!(fits.residual[k] < 0)) {
        const double sheet = (1 - fits.roundness[k]) *
                             smooth_step(kNarrow, kWide, fits.supporters[k]) *
                             (1 - smooth_step(kSmooth, kRough, apart[k]));
        trust[k] = smooth_step(0.24, 0.33, dense[k]) * smooth_step(5, 12, fits.supporters[k]) *
                   (1 - smooth_step(0.45, 0.75, apart[k])) *
                   (1 - (1 - smooth_step(kThin, kThick, deep[k])) * (1 - sheet)) *
                   (1 - kTrace * smooth_step(kComparedFrom, kCompared, apart[k]));
      }
  });
  return trust;
}

}  // namespace meniscus
