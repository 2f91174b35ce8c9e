#include "stages/behind.hpp"

#include "device/kernels.hpp"
#include "stages/minima.hpp"

namespace meniscus {

DiscsBehind list_discs(Device& device, const Discs& discs, const SampleLists& samples,
                       const Buffer<float>& behind, double gap) {
  const SampleGrid& grid = samples.grid;
  const BinGrid bins = bins_of(grid);
  const auto bound = allocate<float>(device, bins.size());
  launch(device, kernels::bound_behind, device.state().vector_width, {samples.tiles()}, samples,
         behind, bound, cl_int2{{grid.nx, grid.ny}}, cl_int2{{samples.nx, samples.ny}},
         cl_int2{{bins.nx, bins.ny}}, static_cast<cl_float>(gap));
  DiscsBehind listed{discs, bound, {}};
  if (draws_by_minima(device)) return listed;
  draw_bins(device, discs.outlines, bound, grid,
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
