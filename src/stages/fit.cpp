#include "stages/fit.hpp"

#include <algorithm>
#include <numeric>

namespace meniscus {
namespace {

constexpr std::size_t kLanes = 8;  // fits of a batch, whatever the device's WIDTH

}  // namespace

FitBatches make_batches(const std::vector<std::size_t>& points) {
  const std::size_t n = points.size();
  FitBatches batches;
  // Problems of like size share a batch; the order does not touch the result of any of them.
  batches.order.resize(n);
  std::iota(batches.order.begin(), batches.order.end(), 0);
  std::stable_sort(batches.order.begin(), batches.order.end(),
                   [&](std::int32_t a, std::int32_t b) { return points[a] < points[b]; });
  const std::size_t count = (n + kLanes - 1) / kLanes;
  batches.lanes = count * kLanes;
  for (std::size_t b = 0; b < count; ++b) {
    const std::size_t longest = points[batches.order[std::min(n, (b + 1) * kLanes) - 1]];
    batches.first.push_back(static_cast<cl_int>(batches.slots));
    batches.length.push_back(static_cast<cl_int>(longest));
    batches.slots += longest * kLanes;
    require(batches.slots < (std::size_t{1} << 28),
            "fit: too many points for 32-bit indices (use a smaller --support)");
  }
  return batches;
}

void fit_batches(Device& device, const DeviceFits& fits, const FitParams& params) {
  const cl_float4 options{{static_cast<float>(params.off_surface), static_cast<float>(params.tau),
                           static_cast<float>(params.ridge), 0.0f}};
  const int width = device.state().vector_width;
  // Few items of much work: small work-groups spread them over the compute units.
  launch(device, "fit.cl", "fit_groups", {fits.lanes / static_cast<std::size_t>(width), 1, 8, 1},
         width_option(width), fits.points, fits.first, fits.length, fits.scale, fits.quadric,
         fits.quality, static_cast<cl_int>(fits.slots), static_cast<cl_int>(fits.lanes), options);
}

}  // namespace meniscus
