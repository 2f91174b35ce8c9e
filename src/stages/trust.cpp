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

}  // namespace

std::vector<double> measure_trust(Device& device, const ParticleFits& fits,
                                  const DeviceCells& cells) {
  const std::size_t n = fits.size();
  std::vector<float> firm(n), spread(n), density;
  Cells around;
  parallel_both([&] { density = measure_density(device, cells, fits.foot); },
                [&] {
                  around = make_cells(fits.position, kSheet.reach);
                  for (std::size_t k = 0; k < n; ++k) {
                    firm[k] = fits.residual[k] < 0 ? 0 : static_cast<float>(fits.firmness[k]);
                    spread[k] = static_cast<float>(fits.spread[k]);
                  }
                });
  const std::vector<std::vector<float>> means = average_in_cells(
      device, around, fits.normal, firm, {std::move(density), std::move(spread)}, kSheet);
  std::vector<double> trust(n, 0.0);
  constexpr std::size_t kGrain = 1024;  // fits that are worth a thread
  parallel_for(n, kGrain, [&](std::size_t begin, std::size_t end) {
    for (std::size_t k = begin; k < end; ++k)
      if (!(fits.residual[k] < 0))
        trust[k] = smooth_step(0.24, 0.33, means[0][k]) * smooth_step(5, 12, fits.supporters[k]) *
                   (1 - smooth_step(0.45, 0.75, means[1][k])) *
                   (1 - kTrace * smooth_step(kComparedFrom, kCompared, means[1][k]));
  });
  return trust;
}

}  // namespace meniscus
