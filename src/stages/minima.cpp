#include "stages/minima.hpp"

#include "device/kernels.hpp"

namespace meniscus {

void count_owners(Device& device, const Buffer<cl_int>& owner, const Buffer<cl_int>& owned) {
  const int width = device.state().vector_width;
  const std::size_t run = width == 1 ? 1 : 64;  // RUN in minima.cl
  launch(device, kernels::count_owners, width, {(owner.size + run - 1) / run}, owner, owned,
         static_cast<cl_int>(owner.size));
}

}  // namespace meniscus
