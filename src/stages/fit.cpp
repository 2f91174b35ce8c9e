#include "stages/fit.hpp"

#include <algorithm>
#include <numeric>

namespace meniscus {
namespace {

constexpr std::size_t kLanes = 8;  // fits of a batch, whatever the device's WIDTH

}  // namespace

std::vector<FitBatches> make_batches(const std::vector<std::size_t>& points,
                                     std::size_t most_slots) {
  // Problems of like size share a batch; the order does not touch the result of any of them.
  std::vector<std::int32_t> order(points.size());
  std::iota(order.begin(), order.end(), 0);
  std::stable_sort(order.begin(), order.end(),
                   [&](std::int32_t a, std::int32_t b) { return points[a] < points[b]; });
  std::vector<FitBatches> parts(1);
  for (auto begin = order.begin(); begin != order.end();) {
    const auto end = begin + std::min<std::ptrdiff_t>(kLanes, order.end() - begin);
    const std::size_t longest = points[*(end - 1)], slots = longest * kLanes;
    require(slots < kMostSlots,
            "fit: too many points for 32-bit indices (use a smaller --support)");
    if (parts.back().lanes > 0 && parts.back().slots + slots > std::min(most_slots, kMostSlots))
      parts.emplace_back();
    FitBatches& batches = parts.back();
    batches.order.insert(batches.order.end(), begin, end);
    batches.first.push_back(static_cast<cl_int>(batches.slots));
    batches.length.push_back(static_cast<cl_int>(longest));
    batches.lanes += kLanes;
    batches.slots += slots;
    begin = end;
  }
  return parts;
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
