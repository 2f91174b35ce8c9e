#include "stages/sample/specks.hpp"

#include <utility>

#include "device/kernels.hpp"

namespace meniscus {
namespace {

// What samples show after a round.
struct Closed {
  Buffer<float> depth, normal;
  Buffer<cl_int> group;
  Buffer<cl_uchar> kind;
};

}  // namespace

void close_specks(Device& device, const SurfaceBuffers& surface, const ListedBlocks& listed,
                  double large_until) {
  constexpr int kRounds = 4;
  constexpr float kJump = 3;  // particle radii
  const SampleGrid& grid = surface.grid;
  const std::size_t n = grid.size();
  const int width = device.state().vector_width;
  const int across = (grid.nx + width - 1) / width;
  const int down = (grid.ny + records::BLOCK_ROWS - 1) / records::BLOCK_ROWS;
  const int run = width == 1 ? 1 : records::BLOCK_RUN;  // blocks that a work-item takes
  const int runs = (across + run - 1) / run;
  const records::Blocks blocks{grid.nx, grid.ny, across, down, runs * run};
  const Range range{static_cast<std::size_t>(runs), static_cast<std::size_t>(down), 16, 1};
  const Closed closed{allocate<float>(device, n), allocate<float>(device, 3 * n),
                      allocate<cl_int>(device, n), allocate<cl_uchar>(device, n)};
  const auto change = allocate<cl_uchar>(device, n);
  auto changed = listed;
  auto changes = allocate<cl_uchar>(device, static_cast<std::size_t>(blocks.stride) * range.ny);
  auto more_changes =
      allocate<cl_uchar>(device, static_cast<std::size_t>(blocks.stride) * range.ny);
  for (int round = 0; round < kRounds; ++round) {
    const records::Closing how{blocks, round, kJump, static_cast<float>(large_until)};
    launch(device, kernels::close_specks, width, range, surface, closed, change, changed, changes,
           how);
    launch(device, kernels::apply_closed, width, range, closed, change, changes, surface, blocks);
    changed = changes;
    std::swap(changes, more_changes);
  }
}

double large_particles_until(const View& view, const SampleGrid& grid) {
  constexpr double kLarge = 2;  // samples
  return depth_of_radius(view, kLarge * static_cast<double>(grid.step));
}

}  // namespace meniscus
