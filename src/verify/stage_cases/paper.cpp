// fit_heights: a height field over one group, against its normal equations; and blend_printed:
// groups whose surfaces bend.
#include "stages/other_methods/paper.hpp"

#include "verify/reference/paper.hpp"
#include "verify/stage_cases/cases.hpp"
#include "verify/stage_cases/mesh_by_hand.hpp"
#include "verify/stage_cases/worst.hpp"

namespace meniscus::verify {

ReferenceErrors paper_case(Device& device, int size) {
  const FitParams params;
  const Triangulation mesh = bumps(static_cast<std::size_t>(size), static_cast<unsigned>(size));
  const Groups groups = one_group(mesh);
  const Quadrics quadrics = fit_heights(device, mesh, groups, params);
  const auto left = reference::height_residuals(mesh.position, groups.centre[0], groups.radius[0],
                                                quadrics.coefficient[0], params);
  Worst equation("fit_heights", "normal equations"), residual("fit_heights", "residual");
  for (int k = 0; k < left.terms; ++k) equation.see(left.error[k], 0, left.bound[k], left.size[k]);
  residual.see(quadrics.residual[0], left.rms, left.rms_bound, groups.radius[0]);
  return {equation.error(), residual.error()};
}

ReferenceErrors printed_case(Device& device, int size) {
  const View view = make_view(perspective_camera(size, (3 * size + 3) / 4), 0.25, {0, 0, 0});
  const SampleGrid grid = pixel_grid(view);
  constexpr float kReference = 38;
  constexpr int kGroups = 24;
  Random random(9);
  Groups groups;
  Quadrics quadrics;
  for (int k = 0; k < kGroups; ++k) {
    const double depth = random(37, 39), v = random(0.1, 0.9) * grid.ny,
                 u = random(0.1, 0.9) * grid.nx;
    groups.centre.push_back(point_at(view, u, v, depth));
    groups.normal.push_back(normalized({random(-0.5, 0.5), random(-0.5, 0.5), 1}));
    groups.radius.push_back(random(3, 6));
    // Curvatures of up to 1/25 a radius in every direction, and as much twist.
    const Vec3d& n = groups.normal.back();
    std::array<float, 10> c{static_cast<float>(random(-0.5, 0.5)), static_cast<float>(n.x),
                            static_cast<float>(n.y), static_cast<float>(n.z)};
    for (int q = 4; q < 10; ++q) c[q] = static_cast<float>(random(-0.02, 0.02));
    quadrics.coefficient.push_back(c);
    quadrics.residual.push_back(0);
  }
  const BlendParams params;
  std::vector<int> owner;
  for (std::size_t s = 0; s < grid.size(); ++s)
    owner.push_back(static_cast<int>(s % (kGroups + 1)) - 1);
  const PaperRegion region{grid, upload(device, owner),
                           filled<float>(device, grid.size(), kReference)};
  const SurfaceMap map =
      download(device, blend_printed(device, view, region,
                                     printed_records(view, groups, quadrics, params), params, {}));
  Worst depths("blend_printed", "depth");
  const auto nx = static_cast<std::size_t>(grid.nx);
  for (std::size_t s = 0; s < grid.size(); ++s) {
    if (owner[s] < 0) {
      depths.see(map.depth[s], kNoSurface, 0);
      continue;
    }
    const auto expected = reference::blend_printed(
        view, groups, quadrics.coefficient, owner[s], kReference, static_cast<double>(s % nx) + 0.5,
        static_cast<double>(s / nx) + 0.5, params.reach, params.d_max);
    if (expected.margin > 1e-3) depths.see(map.depth[s], expected.depth, expected.error);
  }
  return {depths.error()};
}

}  // namespace meniscus::verify
