#include "stages/trust.hpp"

#include "stages/sheet.hpp"

namespace meniscus {
namespace {

constexpr SheetWeights kSheet{5, 0.4f, 0.6f};

}  // namespace

std::vector<double> measure_trust(Device& device, const ParticleFits& fits,
                                  const DeviceCells& cells) {
  const std::size_t n = fits.size();
  std::vector<float> edge(n), spread(n);
  for (std::size_t k = 0; k < n; ++k) {
    edge[k] = fits.residual[k] < 0 ? 0 : static_cast<float>(fits.edge[k]);
    spread[k] = static_cast<float>(fits.spread[k]);
  }
  const auto [dense, apart] =
      average_on_sheets(device, fits.position, fits.normal, edge,
                        {measure_density(device, cells, fits.foot), spread}, kSheet);
  std::vector<double> trust(n, 0.0);
  for (std::size_t k = 0; k < n; ++k)
    if (!(fits.residual[k] < 0))
      trust[k] = smooth_step(0.24, 0.33, dense[k]) * smooth_step(5, 12, fits.supporters[k]) *
                 (1 - smooth_step(0.45, 0.75, apart[k]));
  return trust;
}

}  // namespace meniscus
