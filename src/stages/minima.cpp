#include "stages/minima.hpp"

namespace meniscus {

void count_owners(Device& device, const Buffer<cl_int>& owner, const Buffer<cl_int>& owned) {
  const int width = device.state().vector_width;
  const std::size_t run = width == 1 ? 1 : 64;  // RUN in minima.cl
  launch(device, "minima.cl", "count_owners", {(owner.size + run - 1) / run}, width_option(width),
         owner, owned, static_cast<cl_int>(owner.size));
}

void count_finite(Device& device, const SampleGrid& grid, const Buffer<float>& depth,
                  const OccupiedBlocks& occupied) {
  const BinGrid bins = bins_of(grid);
  launch(device, "minima.cl", "count_finite_depths",
         {static_cast<std::size_t>(bins.nx), static_cast<std::size_t>(bins.ny), 8, 8}, "", depth,
         occupied, cl_int2{{grid.nx, grid.ny}});
}

Buffer<float> ask_behind(Device& device, const SampleLists& samples, const Buffer<float>& behind,
                         double gap) {
  const auto least = filled<float>(device, samples.grid.size(), kNoSurface);
  const int width = device.state().vector_width;
  launch(device, "minima.cl", "ask_behind", range_of(samples, width), width_option(width),
         samples.sample, samples.count, behind, least, static_cast<cl_float>(gap));
  return least;
}

}  // namespace meniscus
