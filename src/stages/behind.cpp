#include "stages/behind.hpp"

#include "device/kernels.hpp"
#include "stages/minima.hpp"

namespace meniscus {

DiscsBehind list_discs(Device& device, const Discs& discs, const SampleLists& samples,
                       const Buffer<float>& behind, double gap) {
  const SampleGrid& grid = samples.grid;
  const BinGrid bins = bins_of(grid);
  const auto bound = allocate<float>(device, bins.size());
  launch(device, kernels::bound_behind, 1, {samples.tiles()}, samples, behind, bound,
         cl_int2{{grid.nx, grid.ny}}, cl_int2{{samples.nx, samples.ny}},
         cl_int2{{bins.nx, bins.ny}}, static_cast<cl_float>(gap));
  DiscsBehind listed{discs, bound, {}};
  if (draws_by_minima(device)) return listed;
  draw_bins(device, discs.outlines, bound, grid,
            [&](const BinLists& lists) { listed.lists.push_back(lists); });
  return listed;
}

Buffer<float> splat_behind(Device& device, const DiscsBehind& discs, const SampleLists& samples,
                           const Buffer<float>& behind, double gap) {
  const SampleGrid& grid = samples.grid;
  if (draws_by_minima(device)) {
    const auto depth = filled<float>(device, grid.size(), kNoSurface);
    if (discs.discs.outlines.count == 0) return depth;
    draw_minima(device, kernels::lower_discs_behind, discs.discs.records, discs.discs.outlines,
                discs.bound, grid, std::tie(behind, depth), lattice_of(grid),
                static_cast<cl_float>(gap));
    return depth;
  }
  const auto depth = allocate<float>(device, grid.size());
  const int width = device.state().vector_width;
  for (const BinLists& lists : discs.lists)
    launch(device, kernels::splat_behind, width, range_of(samples, width), samples,
           discs.discs.records, lists, behind, depth, lists.bins, lattice_of(grid),
           static_cast<cl_float>(gap));
  return depth;
}

}  // namespace meniscus
