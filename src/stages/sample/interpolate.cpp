#include "stages/sample/interpolate.hpp"

#include <algorithm>

#include "device/kernels.hpp"

namespace meniscus {
namespace {

// Within cells up to this side, in radii of the smallest particle, normals may turn farther: 41
// degrees instead of 35.
constexpr double kFineCell = 2.0 / 3;
constexpr float kAgreeing = 0.82f, kAgreeingFine = 0.75f;  // cosines

// By how much depths of the corners' planes may differ, as a part of the tolerance: this over the
// cell's side, kMostSpread at most.
constexpr double kSpread = 0.8, kMostSpread = 2;

}  // namespace

LayerSamples interpolate_samples(Device& device, const View& view, const FrontMaps& fronts,
                                 const Buffer<float>& open, const SurfaceBuffers& surface,
                                 double tolerance, double least_radius, const ListedBlocks& blocks,
                                 int every) {
  const SampleGrid& grid = surface.grid;
  const int cell = 2 * every;
  const int nx = (grid.nx + cell - 1) / cell, ny = (grid.ny + cell - 1) / cell;
  const int width = device.state().vector_width;
  // Rows as long as can be: the arrays are read ahead along them.
  const Range range{static_cast<std::size_t>((nx + width - 1) / width),
                    static_cast<std::size_t>(ny), 64, 1};
  // In radii of the smallest particle.
  const double side = 2 * every * static_cast<double>(grid.step) / least_radius;
  // Padded to whole tiles of samples, and to what a work-item takes.
  const auto padded = [](int n) { return (n + 7) / 8 * 8; };
  const records::LatticeCells cells{
      nx,
      ny,
      padded(nx),
      padded(ny),
      every,
      static_cast<float>(tolerance),
      side <= kFineCell ? kAgreeingFine : kAgreeing,
      static_cast<float>(std::min(kSpread / side, kMostSpread) * tolerance),
      side <= kWidestCell,
      !view.orthographic};
  records::Screen fine = screen_of(view, grid);
  fine.step *= static_cast<float>(every);
  const Range padded_range{static_cast<std::size_t>(cells.stride / width),
                           static_cast<std::size_t>(cells.rows), 64, 1};
  const std::size_t size =
      static_cast<std::size_t>(cells.stride) * static_cast<std::size_t>(cells.rows);
  const auto shows = allocate<cl_uchar>(device, size), wanted = allocate<cl_uchar>(device, size);
  launch(device, kernels::compare_corners, width, range, surface, open, fronts.occupied,
         fronts.splash_occupied, shows, fine, cells);
  launch(device, kernels::interpolate_samples, width, padded_range, shows, fronts, surface, wanted,
         open, fine, cells);
  return list_between(device, grid, wanted, cells.stride, every, blocks);
}

}  // namespace meniscus
