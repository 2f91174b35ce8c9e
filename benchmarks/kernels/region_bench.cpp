#include <bit>
#include <cmath>
#include <cstring>
#include <memory>

#include "kernels/cases.hpp"
#include "kernels/native/native.hpp"
#include "stages/region.hpp"

namespace meniscus::bench {
namespace {

struct Arrays {
  std::vector<float> corners;
  std::vector<std::uint32_t> depth;
  native::Triangles input{};
  std::size_t count = 0;
};

std::shared_ptr<Arrays> arrays_of(const View& view, const Triangulation& mesh,
                                  const SampleGrid& grid) {
  const auto arrays = std::make_shared<Arrays>();
  std::vector<std::size_t> kept;
  for (std::size_t t = 0; t < mesh.triangle.size(); ++t)
    if (mesh.kind[t] == TriangleKind::kept) kept.push_back(t);
  const std::size_t n = arrays->count = kept.size();
  arrays->corners.resize(9 * n);
  for (std::size_t k = 0; k < n; ++k)
    for (std::size_t c = 0; c < 3; ++c) {
      const std::size_t v = static_cast<std::size_t>(mesh.triangle[kept[k]][c]);
      arrays->corners[3 * c * n + k] = static_cast<float>(mesh.screen[v].u);
      arrays->corners[(3 * c + 1) * n + k] = static_cast<float>(mesh.screen[v].v);
      arrays->corners[(3 * c + 2) * n + k] = static_cast<float>(-mesh.position[v].z);
    }
  arrays->depth.resize(grid.size());
  arrays->input = {
      arrays->corners.data(), arrays->depth.data(), n, grid.nx, grid.ny, grid.first, grid.step,
      !view.orthographic};
  return arrays;
}

// Samples inside the box around each triangle, and those inside the triangle.
struct Counts {
  double tested = 0, covered = 0;
};

Counts count_samples(const Arrays& arrays) {
  const std::size_t n = arrays.count;
  Counts counts;
  for (std::size_t k = 0; k < n; ++k) {
    double low[2] = {1e9, 1e9}, high[2] = {-1e9, -1e9}, corner[2][3];
    for (std::size_t axis = 0; axis < 2; ++axis)
      for (std::size_t c = 0; c < 3; ++c) {
        const double x = corner[axis][c] = arrays.corners[(3 * c + axis) * n + k];
        low[axis] = std::min(low[axis], x);
        high[axis] = std::max(high[axis], x);
      }
    counts.tested += (high[0] - low[0]) * (high[1] - low[1]);
    counts.covered += 0.5 * std::abs((corner[0][1] - corner[0][0]) * (corner[1][2] - corner[1][0]) -
                                     (corner[0][2] - corner[0][0]) * (corner[1][1] - corner[1][0]));
  }
  const double area = static_cast<double>(arrays.input.step) * arrays.input.step;
  return {counts.tested / area, counts.covered / area};
}

}  // namespace

Case prepare_triangles(Frame& frame) {
  const SampleGrid grid = pixel_grid(frame.view);
  const auto arrays = arrays_of(frame.view, frame.mesh(), grid);
  const Counts counts = count_samples(*arrays);
  const double n = static_cast<double>(arrays->count);
  Case result;
  result.unit = "pixels";
  result.items = counts.covered;
  // Nine values a triangle; a depth read and written a sample.
  result.bytes = 36 * n + 8 * counts.covered;
  // A triangle: three inverse depths, its area 5 and inverse 1, box 8 + 8. A sample of the box: its
  // place 2, barycentric coordinates 4, 3 and 2. A sample inside: depth 5 and its inverse 1.
  result.operations = 25 * n + 11 * counts.tested + 6 * counts.covered;
  result.atomics = counts.covered;
  const auto depth = std::make_shared<Buffer<float>>();
  result.launch = [&frame, grid, depth] {
    *depth = draw_triangles(frame.device, frame.view, frame.mesh(), grid);
  };
  result.native = [arrays](Workers& workers) {
    workers.run(arrays->count, 64, [&](std::size_t begin, std::size_t end) {
      native::draw_triangles(arrays->input, begin, end);
    });
  };
  result.reset_native = [arrays] {
    std::fill(arrays->depth.begin(), arrays->depth.end(), std::bit_cast<std::uint32_t>(kNoSurface));
  };
  result.differing = [&frame, arrays, depth] {
    std::vector<float> drawn(arrays->depth.size());
    std::memcpy(drawn.data(), arrays->depth.data(), drawn.size() * sizeof(float));
    return count_differing(drawn, download(frame.device, *depth));
  };
  return result;
}

}  // namespace meniscus::bench
