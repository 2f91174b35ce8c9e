#include "stages/specks.hpp"

#include <utility>

#include "device/kernels.hpp"

namespace meniscus {

void close_specks(Device& device, const SurfaceBuffers& surface, const ListedBlocks& listed,
                  double least_radius) {
  constexpr int kRounds = 4;
  constexpr float kJump = 3;    // particle radii
  constexpr double kLarge = 2;  // samples of a particle's radius: its droplet is not one sample
  const SampleGrid& grid = surface.grid;
  const std::size_t n = grid.size();
  constexpr int kBlockRows = 8;  // as in specks.cl
  const int width = device.state().vector_width;
  const int across = (grid.nx + width - 1) / width, down = (grid.ny + kBlockRows - 1) / kBlockRows;
  const cl_int2 blocks{{across, down}};
  const int run = width == 1 ? 1 : 8;  // blocks that a work-item takes, as in specks.cl
  const int runs = (across + run - 1) / run;
  const cl_int stride = runs * run;
  const Range range{static_cast<std::size_t>(runs), static_cast<std::size_t>(down), 16, 1};
  const auto depth = allocate<float>(device, n), normal = allocate<float>(device, 3 * n);
  const auto group = allocate<cl_int>(device, n);
  const auto kind = allocate<cl_uchar>(device, n), change = allocate<cl_uchar>(device, n);
  auto changed = listed;
  auto changes = allocate<cl_uchar>(device, static_cast<std::size_t>(stride) * range.ny);
  auto more_changes = allocate<cl_uchar>(device, static_cast<std::size_t>(stride) * range.ny);
  for (int round = 0; round < kRounds; ++round) {
    launch(device, kernels::close_specks, width, range, surface.depth, surface.normal,
           surface.group, surface.kind, depth, normal, group, kind, change, changed, changes,
           cl_int2{{grid.nx, grid.ny}}, blocks, stride, round, kJump,
           cl_int{least_radius >= kLarge * grid.step});
    launch(device, kernels::apply_closed, width, range, depth, normal, group, kind, change, changes,
           surface.depth, surface.normal, surface.group, surface.kind, cl_int2{{grid.nx, grid.ny}},
           blocks, stride);
    changed = changes;
    std::swap(changes, more_changes);
  }
}

}  // namespace meniscus
