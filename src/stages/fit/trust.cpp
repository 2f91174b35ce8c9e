#include "stages/fit/trust.hpp"

#include "base/parallel.hpp"
#include "stages/sheet/sheet.hpp"

namespace meniscus {
namespace {

constexpr SheetWeights kSheet{kTrustSheet, 0.4f, 0.6f};
static_assert(kTrustSheet <= kResidualReach);

// Where fits' surroundings lie farther from them than this (RMS, particle radii; by the higher one
// in full), a trace less than full trust has every sample compared with the density field
// (settle.cl); see Spreads.
constexpr double kTrace = 0.01;

// Water is thin where the density kDeep behind the feet is below these.
constexpr double kThin = 0.5, kThick = 0.8;

// A fit that hardly any neighbour is firm with and that lies so much farther from its own
// surroundings than any is trusted in the mean is a bevel of a corner.
constexpr double kBevel = 0.1;  // particle radii

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

void measure_surroundings(Device& device, const DeviceCells& cells, DeviceFits& fits) {
  if (fits.parts.empty()) return;
  const auto& [toward, share, value, none] = fits.around->found.parts;
  measure_density(device, cells, fits.feet, value, 2);  // at the feet, and behind them
  average_sheet(device, {fits.around->cells->cells, toward, share, value}, kSheet,
                fits.parts[0].mean);
  fits.knows_surroundings = true;
}

std::vector<double> trust_of(const ParticleFits& fits, double disorder) {
  const std::size_t n = fits.size();
  const Spreads spreads(disorder);
  std::vector<double> trust(n, 0.0);
  constexpr std::size_t kGrain = 1024;  // fits that are worth a thread
  parallel_for(n, kGrain, [&](std::size_t begin, std::size_t end) {
    for (std::size_t k = begin; k < end; ++k)
      if (!(fits.residual[k] < 0)) {
        const double sheet = (1 - fits.roundness[k]) *
                             smooth_step(kNarrow, kWide, fits.supporters[k]) *
                             (1 - smooth_step(spreads.smooth, spreads.rough, fits.apart[k]));
        trust[k] =
            smooth_step(0.24, 0.33, fits.dense[k]) * smooth_step(5, 12, fits.supporters[k]) *
            (1 - smooth_step(spreads.trusted, spreads.distrusted, fits.apart[k])) *
            (1 - (1 - smooth_step(kThin, kThick, fits.deep[k])) * (1 - sheet)) *
            (1 - (1 - fits.firmness[k]) *
                     smooth_step(spreads.distrusted, spreads.distrusted + kBevel, fits.spread[k])) *
            (1 - kTrace * smooth_step(spreads.compared_from, spreads.compared, fits.apart[k]));
      }
  });
  return trust;
}

void distrust_gaps(Device& device, const DeviceCells& cells, const ParticleFits& fits,
                   const std::vector<std::uint32_t>& listed, double disorder,
                   std::vector<double>& trust) {
  constexpr double kBefore = 1.5;  // particle radii
  if (listed.empty()) return;
  std::vector<Vec3d> before;
  before.reserve(listed.size());
  for (const std::uint32_t k : listed) before.push_back(fits.foot[k] + fits.normal[k] * kBefore);
  const std::vector<float> density = measure_density(device, cells, before);
  const double low = 0.55 - 0.175 * disorder;
  for (std::size_t a = 0; a < listed.size(); ++a)
    trust[listed[a]] *= 1 - smooth_step(low, low + 0.2, density[a]);
}

}  // namespace meniscus
