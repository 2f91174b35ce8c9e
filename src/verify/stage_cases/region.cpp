// draw_triangles: a wavy surface with a jump, by perspective and orthographic cameras.
#include "stages/sample/region.hpp"

#include "verify/reference/region.hpp"
#include "verify/stage_cases/cases.hpp"
#include "verify/stage_cases/into_new.hpp"
#include "verify/stage_cases/mesh_by_hand.hpp"
#include "verify/stage_cases/worst.hpp"

namespace meniscus::verify {
namespace {

// Visible particles of a wavy field, farther away beyond u = 40. Every fourth row of them lies a
// hair, 2e-5 pixels, to the right of samples or below them: triangles that begin there do not reach
// those samples, though their barycentric coordinates would let them.
Projected wavy(const View& view, int across, int down) {
  Random random(3);
  Projected p;
  for (int j = 0; j < down; ++j)
    for (int i = 0; i < across; ++i) {
      double u = 6 + 5 * i + random(-1.5, 1.5), v = 5 + 5 * j + random(-1.5, 1.5);
      if (i % 4 == 0 || j % 4 == 0) {
        u = std::floor(u) + 0.5 + (i % 4 == 0 ? 2e-5 : 0);
        v = std::floor(v) + 0.5 + (j % 4 == 0 ? 2e-5 : 0);
      }
      const Vec3d eye = point_at(view, u, v, 30 + std::sin(0.1 * u) + (u > 40 ? 9 : 0));
      add_particle(p, eye, u, v, 2.5, 2.5);
    }
  return p;
}

}  // namespace

ReferenceErrors region_case(Device& device, int size) {
  Worst worst("draw_triangles", "depth");
  const int width = 5 * size + 6, height = 5 * (size - 1) + 6;
  for (const Camera& camera :
       {perspective_camera(width, height), orthographic_camera(width, height)})
    for (const SampleGrid& grid :
         {SampleGrid{width, height, 0.5f, 1}, SampleGrid{(width + 1) / 2, (height + 1) / 2, 0, 2},
          SampleGrid{1, 1, 20.25f, 1}}) {
      const View view = make_view(camera, 0.1, {0, 0, 0});
      const Projected p = wavy(view, size, size - 1);
      const Triangulation mesh = triangulate(view, p, all_visible(p), {});
      const auto found =
          download(device, draw_triangles(device, view, mesh, grid, any_blocks(device, grid)));
      for (int j = 0; j < grid.ny; ++j)
        for (int i = 0; i < grid.nx; ++i) {
          const auto bounds = reference::triangle_depth(view, mesh, grid.first + grid.step * i,
                                                        grid.first + grid.step * j);
          worst.see_within(found[static_cast<std::size_t>(j * grid.nx + i)], bounds.low,
                           bounds.high);
        }
    }
  return {worst.error()};
}

}  // namespace meniscus::verify
