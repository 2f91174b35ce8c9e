// cast_spheres and sphere_normals: rays against scattered spheres of several sizes.
#include "stages/other_methods/spheres.hpp"

#include "verify/reference/spheres.hpp"
#include "verify/stage_cases/cases.hpp"
#include "verify/stage_cases/inputs.hpp"
#include "verify/stage_cases/worst.hpp"

namespace meniscus::verify {

ReferenceErrors spheres_case(Device& device, int size) {
  constexpr double kFootprint = 1.5;
  const SampleGrid grid{size, size / 2 + 1, 0.5f, 1};
  const View view = make_view(off_centre_camera(grid.nx, grid.ny), 0.5, {0, 0, 0});
  const Projected particles = spheres_around(view, 60, 2);
  const DeviceSpheres spheres = upload_spheres(device, view, particles, kFootprint);
  const auto depth = download(device, cast_spheres(device, view, spheres, grid));
  const auto normal = download(device, sphere_normals(device, view, spheres, grid));
  Worst depths("cast_spheres", "depth"), lengths("sphere_normals", "length");
  const std::size_t n = grid.size(), nx = static_cast<std::size_t>(grid.nx);
  for (std::size_t s = 0; s < n; ++s) {
    const auto hit =
        reference::cast_ray(view, particles, kFootprint, static_cast<double>(s % nx) + 0.5,
                            static_cast<double>(s / nx) + 0.5);
    if (hit.margin < 1e-3) continue;  // rounding may decide whether a rim is met
    // Coordinates are below 64 radii and round some ten times. Across a sphere of radius R at the
    // distance (1 - m) R from its axis, depth changes by less than 1 / sqrt(m) as much, twice that
    // with R's own rounding.
    depths.see(depth[s], hit.depth, 4 * 10 * 64 * kEpsilon / std::sqrt(hit.margin));
    const Vec3d found{normal[s], normal[n + s], normal[2 * n + s]};
    lengths.see(length(found), std::isfinite(hit.depth) ? 1 : 0, 4 * kEpsilon, 1);
  }
  return {depths.error(), lengths.error()};
}

}  // namespace meniscus::verify
