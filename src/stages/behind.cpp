#include "stages/behind.hpp"

#include "device/kernels.hpp"
#include "stages/minima.hpp"

namespace meniscus {

DiscsBehind list_discs(Device& device, const Discs& discs, const GapLists& gaps) {
  DiscsBehind listed{discs, gaps.bound, {}};
  if (draws_by_minima(device)) return listed;
  draw_bins(device, discs.outlines, gaps.bound, gaps.lists.grid,
            [&](const BinLists& lists) { listed.lists.push_back(lists); });
  return listed;
}

void splat_behind(Device& device, const DiscsBehind& discs, const SampleLists& samples,
                  const Buffer<float>& behind, double gap, const Buffer<float>& into) {
  const SampleGrid& grid = samples.grid;
  if (draws_by_minima(device)) {
    if (discs.discs.outlines.count > 0)
      draw_minima(device, kernels::lower_discs_behind, discs.discs.records, discs.discs.outlines,
                  discs.bound, grid, std::tie(behind, into), lattice_of(grid),
                  static_cast<cl_float>(gap));
    return;
  }
  const int width = device.state().vector_width;
  for (const BinLists& lists : discs.lists)
    launch(device, kernels::splat_behind, width, range_of(samples, width), samples,
           discs.discs.records, lists, behind, into, lists.bins, lattice_of(grid),
           static_cast<cl_float>(gap));
}

Buffer<float> splat_behind(Device& device, const DiscsBehind& discs, const SampleLists& samples,
                           const Buffer<float>& behind, double gap) {
  const Buffer<float> depth = map_to_draw(device, samples.grid, kNoSurface);
  splat_behind(device, discs, samples, behind, gap, depth);
  return depth;
}

}  // namespace meniscus
