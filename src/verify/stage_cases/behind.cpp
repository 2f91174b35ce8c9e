// splat_behind: what lies behind the nearest fronts of scattered discs, and behind patches.
#include "stages/sample/behind.hpp"

#include <numeric>

#include "verify/reference/visible.hpp"
#include "verify/stage_cases/cases.hpp"
#include "verify/stage_cases/inputs.hpp"
#include "verify/stage_cases/into_new.hpp"
#include "verify/stage_cases/worst.hpp"

namespace meniscus::verify {

ReferenceErrors behind_case(Device& device, int size) {
  constexpr double kFootprint = 1.8, kGap = 3;
  Worst worst("splat_behind", "depth");
  for (const SampleGrid& grid : {SampleGrid{61, 47, 0.5f, 1}, SampleGrid{32, 25, 0, 2}}) {
    const Projected p = discs(static_cast<std::size_t>(size), 6, 61, 47);
    std::vector<std::int32_t> all(p.size());
    std::iota(all.begin(), all.end(), 0);
    const SplatParticles splats = upload_splats(device, p, all);
    // Every third sample of the nearest fronts is not asked for; patches lie anywhere.
    std::vector<float> fronts(grid.size());
    const auto nearest = reference::splat_depth(p, all, grid, kFootprint, 1, kEpsilon);
    for (std::size_t s = 0; s < fronts.size(); ++s)
      fronts[s] = s % 3 == 2 ? kNoSurface : static_cast<float>(nearest.low[s]);
    for (const std::vector<float>& before : {fronts, patches(grid, 3)}) {
      const Buffer<float> behind = upload(device, before);
      const GapLists gaps = list_gaps(device, grid, behind, kGap);
      const DiscsBehind discs =
          list_discs(device, splats, {{static_cast<float>(kFootprint), 1.0f}}, gaps);
      const auto found = download(device, splat_behind(device, discs, gaps.lists, behind, kGap));
      const auto bounds = reference::splat_behind(p, grid, kFootprint, before, kGap, kEpsilon);
      for (std::size_t s = 0; s < found.size(); ++s)
        if (before[s] < kNoSurface) worst.see_within(found[s], bounds.low[s], bounds.high[s]);
    }
  }
  return {worst.error()};
}

}  // namespace meniscus::verify
