// smooth_columns, smooth_rows and depth_normals: noise on two layers in irregular patches.
#include "stages/other_methods/ssm.hpp"

#include "verify/reference/ssm.hpp"
#include "verify/stage_cases/cases.hpp"
#include "verify/stage_cases/inputs.hpp"
#include "verify/stage_cases/worst.hpp"

namespace meniscus::verify {

ReferenceErrors ssm_case(Device& device, int size) {
  const SampleGrid grid{size, size / 2 + 1, 0, 1};
  SsmParams params;
  params.z_max = 2;
  params.sigma = 1.1;
  return ssm_errors(
      device,
      make_view(look_at({0, 0, 20}, {0, 0, 0}, {0, 1, 0}, 50, grid.nx, grid.ny), 0.5, {0, 0, 0}),
      grid, patches(grid, 3), params, 2);
}

ReferenceErrors ssm_errors(Device& device, const View& view, const SampleGrid& grid,
                           const std::vector<float>& depth, const SsmParams& params, double cell) {
  const auto half_width = [&](double scale) {
    return [&, scale](double t) {
      if (params.filter > 0) return params.filter * std::pow(cell / grid.step, 2);
      const double w = view.w_row[3] - view.w_row[2] * t;
      return 2 * std::pow(params.sigma * scale / w / grid.step, 2);
    };
  };
  const auto columns = reference::smooth_axis({depth.begin(), depth.end()}, grid.nx, grid.ny, 1,
                                              params.z_max, half_width(view.v_scale));
  const auto expected = reference::smooth_axis(columns.depth, grid.nx, grid.ny, 0, params.z_max,
                                               half_width(view.u_scale));
  // n: three roundings of its constants and of w, squared, and a division; then twice the error of
  // a depth of at least 20.
  const double first = reference::pass_error(columns, params.z_max, 8 * kEpsilon);
  const double bound =
      first + reference::pass_error(expected, params.z_max, 8 * kEpsilon + 2 * first / 20);
  require_decided(std::min(columns.layer_margin, expected.layer_margin) > 0.1 && bound < 1e-2);
  const Buffer<float> smooth =
      smooth_depth(device, view, upload(device, depth), grid, params, cell);
  const std::vector<float> found = download(device, smooth);
  Worst smoothed("smooth_rows", "depth");
  for (std::size_t k = 0; k < found.size(); ++k) smoothed.see(found[k], expected.depth[k], bound);

  const std::vector<float> normal =
      download(device, depth_normals(device, view, smooth, grid, params.z_max));
  const auto normals =
      reference::depth_normals(view, {found.begin(), found.end()}, grid, params.z_max);
  // A coordinate o + t d of at most 64 radii has six roundings, twice with the constants'; the
  // difference of two has twice that. One sample spans `side` radii at least. The differences a =
  // (a_u, 0, a_t), b = (0, b_v, b_t) with |a_t| <= 1.6 <= 1.6 a_u / side: their cross product is at
  // least |a_u b_v| long, and |a| / a_u at most `steep`.
  const double off = 2 * 12 * kEpsilon * 64;
  const double side = grid.step * (view.w_row[3] - 20 * view.w_row[2]) / view.u_scale;
  const double steep = std::sqrt(1 + std::pow(1.6 / side, 2));
  Worst direction("depth_normals", "normal");
  const std::size_t n = grid.size();
  const double tolerance = 2 * off * steep / side;
  require_decided(tolerance < 0.01);
  for (std::size_t k = 0; k < n; ++k) {
    const Vec3d at{normal[k], normal[n + k], normal[2 * n + k]};
    direction.see(length(at - normals[k]), 0, std::isfinite(found[k]) ? tolerance : 0, 1);
  }
  return {smoothed.error(), direction.error()};
}

}  // namespace meniscus::verify
