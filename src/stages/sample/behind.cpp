#include "stages/sample/behind.hpp"

#include "device/kernels.hpp"
#include "stages/frame/minima.hpp"

namespace meniscus {

DiscsBehind list_discs(Device& device, const SplatParticles& particles, cl_float2 sphere,
                       const GapLists& gaps) {
  const SampleGrid& grid = gaps.lists.grid;
  DiscsBehind listed{particles, sphere, gaps.bound, {}, {}};
  if (draws_by_minima(device)) return listed;
  listed.discs = outline_discs(device, particles, grid, sphere, Drawn::behind);
  draw_bins(device, listed.discs.outlines, gaps.bound, grid,
            [&](const BinLists& lists) { listed.lists.push_back(lists); });
  return listed;
}

void splat_behind(Device& device, const DiscsBehind& discs, const SampleLists& samples,
                  const Buffer<float>& behind, double gap, const Buffer<float>& into) {
  const SampleGrid& grid = samples.grid;
  if (draws_by_minima(device)) {
    if (discs.particles.count > 0)
      draw_minima(device, kernels::lower_discs_behind, discs.particles, discs.sphere, Drawn::behind,
                  discs.bound, grid, std::tie(behind, into), static_cast<cl_float>(gap));
    return;
  }
  const int width = device.state().vector_width;
  for (const BinLists& lists : discs.lists)
    launch(device, kernels::splat_behind, width, range_of(samples, width), samples,
           discs.discs.records, lists, behind, into, lists.bins, lattice_of(grid),
           static_cast<cl_float>(gap));
}

}  // namespace meniscus
