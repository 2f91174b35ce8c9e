#include "stages/trust.hpp"

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
  if (n == 0) return {};
  std::vector<float> firm(n), spread(n);
  std::vector<std::int32_t> place(n);  // of each fit in the sheets' cells
  Cells feet, around;
  parallel_both([&] { feet = make_cells(fits.foot, 1 / cells.grid.inverse_cell); },
                [&] {
                  around = make_cells(fits.position, kSheet.reach);
                  for (std::size_t p = 0; p < n; ++p)
                    place[static_cast<std::size_t>(around.item[p])] = static_cast<std::int32_t>(p);
                  for (std::size_t k = 0; k < n; ++k) {
                    firm[k] = fits.residual[k] < 0 ? 0 : static_cast<float>(fits.firmness[k]);
                    spread[k] = static_cast<float>(fits.spread[k]);
                  }
                });
  // The density, which the device measures in its place; how far surroundings lie.
  const SheetFits sheet = upload_sheet(device, around, fits.normal, firm, {{}, spread});
  measure_density(device, cells, feet, place, sheet.value);
  const auto mean = allocate<float>(device, 2 * n);
  average_sheet(device, sheet, kSheet, mean);
  const HostView found(device, mean);
  const std::vector<float> density = by_item(around, found.data()),
                           apart = by_item(around, found.data() + n);
  std::vector<double> trust(n, 0.0);
  constexpr std::size_t kGrain = 1024;  // fits that are worth a thread
  parallel_for(n, kGrain, [&](std::size_t begin, std::size_t end) {
    for (std::size_t k = begin; k < end; ++k)
      if (!(fits.residual[k] < 0))
        trust[k] = smooth_step(0.24, 0.33, density[k]) * smooth_step(5, 12, fits.supporters[k]) *
                   (1 - smooth_step(0.45, 0.75, apart[k])) *
                   (1 - kTrace * smooth_step(kComparedFrom, kCompared, apart[k]));
  });
  return trust;
}

}  // namespace meniscus
