#include "stages/closed/implicit.hpp"

#include <algorithm>

#include "base/rounded_up.hpp"
#include "device/kernels.hpp"
#include "device/together.hpp"
#include "stages/frame/relax.hpp"

namespace meniscus {
namespace {

// Points a launch takes: bounds the device memory for any number of points.
constexpr std::size_t kChunk = std::size_t{1} << 20;

}  // namespace

bool counts(const BlendRecords& of, std::size_t k) {
  return of.foot[4 * k + 3] > 0 && of.record[kFitRecord * k + records::FIT_WEIGHT] > 0;
}

ImplicitFunction make_implicit(Device& device, const BlendRecords& records,
                               const DeviceCells& levelled, const Parameters& params,
                               double reach) {
  std::vector<std::size_t> counting;
  std::vector<Vec3d> foot;
  for (std::size_t k = 0; k < records.size(); ++k) {
    if (!counts(records, k)) continue;
    const float* const at = &records.foot[4 * k];
    counting.push_back(k);
    foot.emplace_back(at[0], at[1], at[2]);
    reach = std::max(reach, double{at[3]});
  }
  ImplicitFunction function;
  function.reach = static_cast<float>(reach);
  const Cells cells = make_cells(foot, function.reach);
  std::vector<float> ordered(kFitRecord * counting.size());
  for (std::size_t p = 0; p < counting.size(); ++p)
    std::copy_n(&records.record[kFitRecord * counting[static_cast<std::size_t>(cells.item[p])]],
                kFitRecord, &ordered[kFitRecord * p]);
  function.records = upload(device, ordered);
  function.feet = upload_cells(device, cells);
  function.levelled = levelled;
  function.limits = {{static_cast<float>(params.region.contour_density),
                      static_cast<float>(params.region.blob_density)}};
  function.sheets = {
      {static_cast<float>(params.blend.same_low), static_cast<float>(params.blend.same_high)}};
  const Disorder disorder{.amount = std::max(params.disorder, 0.0)};
  function.mass = disorder.mass();
  function.disorder = static_cast<float>(disorder.within_cubes());
  return function;
}

void Points::reserve(std::size_t n) {
  for (std::vector<float>* const axis : {&x, &y, &z}) axis->reserve(n);
}

void Points::clear() {
  for (std::vector<float>* const axis : {&x, &y, &z}) axis->clear();
}

void Points::pad(std::size_t together) {
  if (size() == 0) return;
  const std::size_t padded = rounded_up(size(), together);
  for (std::vector<float>* const axis : {&x, &y, &z}) axis->resize(padded, axis->back());
}

std::size_t points_together(Device& device) {
  return static_cast<std::size_t>(device.state().wide_width());
}

Levels measure_implicit(Device& device, const ImplicitFunction& function, const Points& points) {
  const std::size_t n = points.size();
  Levels levels{std::vector<float>(n), std::vector<Vec3>(function.alone ? 0 : n)};
  const int width = device.state().wide_width();
  const DeviceCells &feet = function.feet, &cells = function.levelled;
  for (std::size_t first = 0; first < n; first += kChunk) {
    const std::size_t count = std::min(kChunk, n - first), stride = rounded_up(count, 64);
    UploadTogether<float, float, float> arrays(device, {count, count, count});
    std::copy_n(points.x.data() + first, count, arrays.data<0>());
    std::copy_n(points.y.data() + first, count, arrays.data<1>());
    std::copy_n(points.z.data() + first, count, arrays.data<2>());
    const auto [x, y, z] = arrays.done();
    const float reach = function.alone ? -1.0f : function.reach;
    const meniscus::records::Implicit of{static_cast<int>(count),
                                         static_cast<int>(stride),
                                         reach,
                                         function.limits.s[0],
                                         function.limits.s[1],
                                         function.sheets.s[0],
                                         function.sheets.s[1],
                                         function.mass,
                                         function.disorder};
    const auto result = allocate<float>(device, 4 * stride);
    launch(device, kernels::measure_implicit, width,
           {(count + static_cast<std::size_t>(width) - 1) / static_cast<std::size_t>(width)},
           DevicePoints{x, y, z}, result, function.records, feet, cells_with(cells, cells.weight),
           of);
    const HostView found(device, result);
    std::copy_n(found.data(), count, levels.value.data() + first);
    for (std::size_t k = 0; k < count && !function.alone; ++k)
      levels.gradient[first + k] = {found[stride + k], found[2 * stride + k],
                                    found[3 * stride + k]};
  }
  return levels;
}

}  // namespace meniscus
