#include "stages/minima.hpp"

#include "device/kernels.hpp"

namespace meniscus {

void count_owners(Device& device, const Buffer<cl_int>& owner, const Buffer<cl_int>& owned) {
  const int width = device.state().vector_width;
  const std::size_t run = width == 1 ? 1 : 64;  // RUN in minima.cl
  launch(device, kernels::count_owners, width, {(owner.size + run - 1) / run}, owner, owned,
         static_cast<cl_int>(owner.size));
}

void count_finite(Device& device, const SampleGrid& grid, const Buffer<float>& depth,
                  const OccupiedBlocks& occupied) {
  const BinGrid bins = bins_of(grid);
  launch(device, kernels::count_finite_depths, 1,
         {static_cast<std::size_t>(bins.nx), static_cast<std::size_t>(bins.ny), 8, 8}, depth,
         occupied, cl_int2{{grid.nx, grid.ny}});
}

}  // namespace meniscus
