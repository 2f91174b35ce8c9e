// splat_depth: the nearest front of scattered discs at every node, between two bounds.
#include "stages/visible.hpp"

#include <numeric>

#include "verify/reference/visible.hpp"
#include "verify/references/cases.hpp"
#include "verify/references/inputs.hpp"
#include "verify/references/worst.hpp"

namespace meniscus::verify {

ReferenceErrors visible_case(Device& device, int size) {
  const SampleGrid grids[] = {{61, 47, 0.5f, 1}, {32, 25, 0, 2}, {1, 1, 20, 1}};
  const Projected p = discs(static_cast<std::size_t>(size), 5, 61, 47);
  std::vector<std::int32_t> all(p.size());
  std::iota(all.begin(), all.end(), 0);
  Worst worst("splat_depth", "depth");
  for (const SampleGrid& grid : grids) {
    if (size < 100 && grid.nx == 61) continue;
    for (const double bulge : {1.0, 0.45}) {
      const auto bounds = reference::splat_depth(p, all, grid, 1.8, bulge, kEpsilon);
      const auto found =
          download(device, splat_depth(device, upload_splats(device, p, all), grid, 1.8, bulge));
      for (std::size_t k = 0; k < found.size(); ++k)
        worst.see_within(found[k], bounds.low[k], bounds.high[k]);
    }
  }
  return {worst.error()};
}

}  // namespace meniscus::verify
