// fair_normals: noisy normals of a rough surface with a layer behind it, holes and a crease, in
// views whose samples lie closer together and farther apart.
#include "stages/sample/fairing.hpp"

#include "verify/reference/fairing.hpp"
#include "verify/stage_cases/cases.hpp"
#include "verify/stage_cases/inputs.hpp"
#include "verify/stage_cases/worst.hpp"

namespace meniscus::verify {
namespace {

SurfaceMap rough(const View& view, const SampleGrid& grid) {
  SurfaceMap map;
  map.grid = grid;
  Random random(static_cast<unsigned>(grid.nx));
  for (int j = 0; j < grid.ny; ++j)
    for (int i = 0; i < grid.nx; ++i) {
      const double patch = std::sin(0.21 * i + 0.13 * j);
      const bool gap = patch < -0.8 || random(0, 1) < 0.03;
      const double deep = patch < 0.4 ? 14 + 0.3 * j : 33 - 0.1 * i;
      const Vec3d ray = ray_direction(view, grid.first + grid.step * i, grid.first + grid.step * j);
      const double side = i < grid.nx / 2 ? 0.5 : -0.5;  // a crease between both
      const Vec3d normal = normalized(
          normalized(-ray) + Vec3d{side + random(-0.15, 0.15), random(-0.2, 0.2), 0.1 * side});
      map.depth.push_back(gap ? kNoSurface : static_cast<float>(deep + random(-0.1, 0.1)));
      map.normal.push_back(gap ? Vec3{} : static_cast<Vec3>(normal));
      map.group.push_back(-1);
      map.kind.push_back(gap ? Kind::none : Kind::surface);
    }
  return map;
}

void compare(Device& device, const View& view, const SampleGrid& grid, Worst& worst) {
  constexpr double kSigma = 1, kFarthest = 40;
  const SurfaceMap map = rough(view, grid);
  const SurfaceBuffers surface = upload(device, map);
  fair_normals(device, view, surface, kSigma);
  const SurfaceMap found = download(device, surface);
  reference::Normals expected = reference::normals_of(view, map);
  expected = reference::fair(view, grid, expected, 1, 0, kSigma);
  expected = reference::fair(view, grid, expected, 0, 1, kSigma);
  for (std::size_t s = 0; s < map.depth.size(); ++s) {
    if (!(map.depth[s] < kNoSurface) || expected.in_doubt[s]) continue;
    const int i = static_cast<int>(s) % grid.nx, j = static_cast<int>(s) / grid.nx;
    const Vec3d ray = ray_direction(view, grid.first + grid.step * i, grid.first + grid.step * j);
    // Places round at 40 radii, three times each, and weights change by at most 4 a radius. A
    // weight's error moves the parabola by at most twice its share of normals that differ by up to
    // .8, six neighbours each time, and again along columns.
    const double bound = 2 * 6 * 2 * 0.8 * 4 * 3 * kEpsilon * kFarthest;
    worst.see(length(Vec3d(found.normal[s]) - reference::facing(expected.normal[s], ray)), 0, bound,
              1);
  }
}

}  // namespace

ReferenceErrors fairing_case(Device& device, int size) {
  Worst worst("fair_normals", "normal");
  const int height = (2 * size + 2) / 3;
  for (const double radius : {0.5, 0.15}) {
    const View perspective = make_view(perspective_camera(size, height), radius, {0, 0, 0});
    compare(device, perspective, pixel_grid(perspective), worst);
    const View flat = make_view(orthographic_camera(size, height), radius, {0, 0, 0});
    compare(device, flat, node_grid(flat, 2), worst);
  }
  return {worst.error()};
}

}  // namespace meniscus::verify
