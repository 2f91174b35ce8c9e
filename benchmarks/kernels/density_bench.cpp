#include <memory>

#include "kernels/cases.hpp"
#include "stages/frame/density.hpp"

namespace meniscus::bench {
namespace {

// Particles within the support of those that are measured, `gradients` of which are not 0.
double count_pairs(const Cells& cells, const std::vector<float>& gradients) {
  double pairs = 0;
  const std::size_t n = cells.x.size();
  for (std::size_t k = 0; k < n; ++k) {
    if (gradients[k] == 0 && gradients[n + k] == 0 && gradients[2 * n + k] == 0) continue;
    visit_near(cells, cells.x[k], cells.y[k], cells.z[k], [&](std::int32_t p) {
      const float dx = cells.x[p] - cells.x[k], dy = cells.y[p] - cells.y[k],
                  dz = cells.z[p] - cells.z[k];
      pairs += dx * dx + dy * dy + dz * dz < kDensitySupport * kDensitySupport;
      return true;
    });
  }
  return pairs;
}

}  // namespace

Case prepare_gradients(Frame& frame) {
  const Cells& cells = frame.cells();
  const auto device_cells = std::make_shared<DeviceCells>(upload_cells(frame.device, cells));
  const double n = static_cast<double>(cells.x.size());
  Case result{.unit = "particles", .items = n};
  // Position and weight read; gradient, density and the levelled field's weight written.
  result.bytes = 36 * n;
  // A pair: difference 3, v 7, its powers and weight 3, kernel 6, its sum 2, its derivative 7,
  // gradient 6. A particle: 4, its weight 19.
  result.operations =
      34 * count_pairs(cells, download(frame.device, measure_gradients(frame.device, *device_cells,
                                                                       Measured::near_air))) +
      23 * n;
  const RegionParams params;
  const auto field =
      std::make_shared<Buffer<float>>(allocate<float>(frame.device, 4 * cells.x.size()));
  const auto weight = std::make_shared<Buffer<float>>();
  result.launch = [&frame, device_cells, params, field, weight] {
    *weight = level_cells(frame.device, *device_cells, Measured::near_air, params, *field).weight;
  };
  return result;
}

}  // namespace meniscus::bench
