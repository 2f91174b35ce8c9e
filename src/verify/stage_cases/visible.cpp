// splat_depth: the nearest front of scattered discs at every node, between two bounds.
#include "stages/frame/visible.hpp"

#include <numeric>

#include "verify/reference/visible.hpp"
#include "verify/stage_cases/cases.hpp"
#include "verify/stage_cases/inputs.hpp"
#include "verify/stage_cases/worst.hpp"

namespace meniscus::verify {

void see_splats(Device& device, const Projected& discs, const SampleGrid& grid, double footprint,
                double bulge, Worst& worst) {
  std::vector<std::int32_t> all(discs.size());
  std::iota(all.begin(), all.end(), 0);
  const auto bounds = reference::splat_depth(discs, all, grid, footprint, bulge, kEpsilon);
  const auto found = download(
      device, splat_depth(device, upload_splats(device, discs, all), grid, footprint, bulge));
  for (std::size_t k = 0; k < found.size(); ++k)
    worst.see_within(found[k], bounds.low[k], bounds.high[k]);
}

ReferenceErrors visible_case(Device& device, int size) {
  const SampleGrid grids[] = {{61, 47, 0.5f, 1}, {32, 25, 0, 2}, {1, 1, 20, 1}};
  const Projected p = discs(static_cast<std::size_t>(size), 5, 61, 47);
  Worst worst("splat_depth", "depth");
  for (const SampleGrid& grid : grids) {
    if (size < 100 && grid.nx == 61) continue;
    for (const double bulge : {1.0, 0.45}) see_splats(device, p, grid, 1.8, bulge, worst);
  }
  return {worst.error()};
}

}  // namespace meniscus::verify
