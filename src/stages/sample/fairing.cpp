#include "stages/sample/fairing.hpp"

#include "device/kernels.hpp"

namespace meniscus {

void fair_normals(Device& device, const View& view, const SurfaceBuffers& surface, double sigma) {
  const SampleGrid& grid = surface.grid;
  const auto rows = allocate<float>(device, 3 * grid.size());
  const int width = device.state().wide_width();
  const std::size_t rows_of_grid = static_cast<std::size_t>(grid.ny);
  const Range range = width == 1 ? Range{static_cast<std::size_t>(grid.nx), rows_of_grid, 16, 1}
                                 : Range{1, rows_of_grid, 1, 1};
  const records::Screen screen = screen_of(view, grid);
  const float reach = static_cast<float>(sigma);
  launch(device, kernels::fair_normals, width, range, surface.depth, surface.normal, rows, screen,
         reach, 0);
  launch(device, kernels::fair_normals, width, range, surface.depth, rows, surface.normal, screen,
         reach, 1);
}

}  // namespace meniscus
