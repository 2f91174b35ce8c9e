#include <algorithm>
#include <cmath>

#include "kernels/cases.hpp"
#include "stages/sample/region.hpp"
#include "verify/stage_cases/into_new.hpp"

namespace meniscus::bench {
namespace {

// Kept triangles, samples inside the box around each, and those inside the triangle.
struct Counts {
  double kept = 0, tested = 0, covered = 0;
};

Counts count_samples(const Triangulation& mesh, const SampleGrid& grid) {
  Counts counts;
  for (std::size_t t = 0; t < mesh.triangle.size(); ++t) {
    if (mesh.kind[t] != TriangleKind::kept) continue;
    const auto& corners = mesh.triangle[t];
    const ScreenPoint &a = mesh.screen[corners[0]], &b = mesh.screen[corners[1]],
                      &c = mesh.screen[corners[2]];
    const auto [low_u, high_u] = std::minmax({a.u, b.u, c.u});
    const auto [low_v, high_v] = std::minmax({a.v, b.v, c.v});
    ++counts.kept;
    counts.tested += (high_u - low_u) * (high_v - low_v);
    counts.covered += 0.5 * std::abs((b.u - a.u) * (c.v - a.v) - (c.u - a.u) * (b.v - a.v));
  }
  const double area = static_cast<double>(grid.step) * grid.step;
  return {counts.kept, counts.tested / area, counts.covered / area};
}

}  // namespace

Case prepare_triangles(Frame& frame) {
  const SampleGrid grid = pixel_grid(frame.view);
  const Counts counts = count_samples(frame.mesh(), grid);
  Case result{.unit = "pixels", .items = static_cast<double>(grid.size())};
  // Ten values a triangle; a depth written a pixel.
  result.bytes = 40 * counts.kept + 4 * result.items;
  // A sample of the box: place 1, barycentric coordinates 3, 3 and 2. A sample inside: depth 5, its
  // inverse 1, minimum 1.
  result.operations = 9 * counts.tested + 7 * counts.covered;
  result.launch = [&frame, grid] {
    draw_triangles(frame.device, frame.view, frame.mesh(), grid, any_blocks(frame.device, grid));
  };
  return result;
}

}  // namespace meniscus::bench
