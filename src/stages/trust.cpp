#include "stages/trust.hpp"

#include "base/parallel.hpp"
#include "stages/sheet.hpp"

namespace meniscus {
namespace {

constexpr SheetWeights kSheet{kTrustSheet, 0.4f, 0.6f};

// Where fits' surroundings lie farther from them than this (RMS, particle radii; by the higher one
// in full), a trace less than full trust has every sample compared with the density field
// (settle.cl); see Spreads.
constexpr double kTrace = 0.01;

// Water is thin where the density this far behind the feet (particle radii) is below these.
constexpr double kDeep = 3, kThin = 0.5, kThick = 0.8;

// Thin water is a sheet, as fits are, where it is flat, wide, which the number of a fit's
// neighbours tells, and smooth (Spreads). Else it is arms and drops.
constexpr double kNarrow = 40, kWide = 80;

// How far surroundings lie from fits (RMS, particle radii) where these begin not to be trusted and
// where they are not at all; where samples are compared with the field; and where thin water begins
// not to be a sheet. Irregular particles lie farther from any surface.
struct Spreads {
  explicit Spreads(double disorder)
      : trusted(between(0.45, 0.8, disorder)),
        distrusted(between(0.75, 1.2, disorder)),
        compared_from(between(0.3, 0.6, disorder)),
        compared(between(0.4, 0.8, disorder)),
        smooth(between(0.25, 0.5, disorder)),
        rough(between(0.4, 0.8, disorder)) {}
  double trusted, distrusted, compared_from, compared, smooth, rough;
};

}  // namespace

std::vector<double> measure_trust(Device& device, const ParticleFits& fits,
                                  const DeviceCells& cells, double disorder) {
  const std::size_t n = fits.size();
  const Spreads spreads(disorder);
  if (n == 0) return {};
  std::vector<float> firm(n), spread(n);
  std::vector<std::int32_t> place(2 * n);  // of each point's density among the values of the sheets
  Cells points, around;
  parallel_both(
      [&] {
        std::vector<Vec3d> at = fits.foot;
        at.reserve(2 * n);
        for (std::size_t k = 0; k < n; ++k) at.push_back(fits.foot[k] - fits.normal[k] * kDeep);
        points = make_cells(at, 1 / cells.grid.inverse_cell);
      },
      [&] {
        around = make_cells(fits.position, kSheet.reach);
        for (std::size_t p = 0; p < n; ++p) {
          const std::size_t k = static_cast<std::size_t>(around.item[p]);
          place[k] = static_cast<std::int32_t>(p);
          place[n + k] = static_cast<std::int32_t>(n + p);
        }
        for (std::size_t k = 0; k < n; ++k) {
          firm[k] = fits.residual[k] < 0 ? 0 : static_cast<float>(fits.firmness[k]);
          spread[k] = static_cast<float>(fits.spread[k]);
        }
      });
  // Both densities, which the device measures in their places; how far surroundings lie.
  const SheetFits sheets = upload_sheet(device, around, fits.normal, firm, {{}, {}, spread});
  measure_density(device, cells, points, place, sheets.value);
  const auto mean = allocate<float>(device, 4 * n);
  average_sheet(device, sheets, kSheet, mean);
  const HostView found(device, mean);
  const std::vector<float> dense = by_item(around, found.data()),
                           deep = by_item(around, found.data() + n),
                           apart = by_item(around, found.data() + 2 * n);
  std::vector<double> trust(n, 0.0);
  constexpr std::size_t kGrain = 1024;  // fits that are worth a thread
  parallel_for(n, kGrain, [&](std::size_t begin, std::size_t end) {
    for (std::size_t k = begin; k < end; ++k)
      if (!(fits.residual[k] < 0)) {
        const double sheet = (1 - fits.roundness[k]) *
                             smooth_step(kNarrow, kWide, fits.supporters[k]) *
                             (1 - smooth_step(spreads.smooth, spreads.rough, apart[k]));
        trust[k] = smooth_step(0.24, 0.33, dense[k]) * smooth_step(5, 12, fits.supporters[k]) *
                   (1 - smooth_step(spreads.trusted, spreads.distrusted, apart[k])) *
                   (1 - (1 - smooth_step(kThin, kThick, deep[k])) * (1 - sheet)) *
                   (1 - kTrace * smooth_step(spreads.compared_from, spreads.compared, apart[k]));
      }
  });
  return trust;
}

void distrust_gaps(Device& device, const DeviceCells& cells, const ParticleFits& fits,
                   std::vector<double>& trust) {
  constexpr double kBefore = 1.5;  // particle radii
  std::vector<Vec3d> before(fits.size());
  for (std::size_t k = 0; k < fits.size(); ++k) before[k] = fits.foot[k] + fits.normal[k] * kBefore;
  const std::vector<float> density = measure_density(device, cells, before);
  for (std::size_t k = 0; k < fits.size(); ++k) trust[k] *= 1 - smooth_step(0.55, 0.75, density[k]);
}

}  // namespace meniscus
