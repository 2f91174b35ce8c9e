#include "stages/ssm.hpp"

#include <algorithm>
#include <cmath>
#include <string>

namespace meniscus {
namespace {

constexpr std::size_t kGroupSide = 8;

void check_size(const Buffer<float>& depth, const SampleGrid& grid) {
  require(depth.size == grid.size(), "ssm: the depth map has " + std::to_string(depth.size) +
                                         " values but the grid " + std::to_string(grid.nx) + " x " +
                                         std::to_string(grid.ny) + " samples");
}

// The filter's half width n = x / (y + z t)^2 along an axis on which a length
// l at clip w spans l * scale / w pixels.
cl_float4 spread_of(const View& view, double scale, double step, const SsmParams& params,
                    double cell) {
  if (params.filter > 0)
    return {{static_cast<float>(params.filter * std::pow(cell / step, 2)), 1.0f, 0.0f, 0.0f}};
  const double sigma = params.sigma * scale / step;  // samples, times w
  return {{static_cast<float>(2 * sigma * sigma), static_cast<float>(view.w_row[3]),
           static_cast<float>(-view.w_row[2]), 0.0f}};
}

}  // namespace

Buffer<float> smooth_depth(Device& device, const View& view, const Buffer<float>& depth,
                           const SampleGrid& grid, const SsmParams& params, double cell) {
  check_size(depth, grid);
  const auto down_columns = [&](const Buffer<float>& from, int nx, int ny, double scale) {
    const auto to = allocate<float>(device, from.size);
    const int width = device.state().vector_width;
    const std::size_t items = static_cast<std::size_t>((nx + width - 1) / width);
    launch(device, "ssm.cl", "smooth_columns",
           {items, static_cast<std::size_t>(ny), kGroupSide, kGroupSide}, width_option(width), from,
           to, cl_int{nx}, cl_int{ny}, static_cast<cl_float>(params.z_max),
           spread_of(view, scale, grid.step, params, cell));
    return to;
  };
  const auto columns = down_columns(depth, grid.nx, grid.ny, view.v_scale);
  return down_columns(columns, grid.ny, grid.nx, view.u_scale);
}

Buffer<float> depth_normals(Device& device, const View& view, const Buffer<float>& depth,
                            const SampleGrid& grid, double z_max) {
  const auto normals = allocate<float>(device, 3 * grid.size());
  cl_float16 ray{};
  for (std::size_t k = 0; k < view.ray.size(); ++k) ray.s[k] = static_cast<float>(view.ray[k]);
  launch(device, "ssm.cl", "depth_normals",
         {static_cast<std::size_t>(grid.nx), static_cast<std::size_t>(grid.ny), kGroupSide,
          kGroupSide},
         "", depth, normals, cl_int{grid.nx}, cl_int{grid.ny}, cl_float2{{grid.first, grid.step}},
         static_cast<cl_float>(z_max), ray);
  return normals;
}

SurfaceMap ssm_surface(Device& device, const View& view, const Buffer<float>& spheres,
                       const SampleGrid& grid, const SsmParams& params, double cell) {
  const auto depth = smooth_depth(device, view, spheres, grid, params, cell);
  const auto normals = depth_normals(device, view, depth, grid, params.z_max);

  SurfaceMap map;
  map.grid = grid;
  map.depth = download(device, depth);
  const std::vector<float> n = download(device, normals);
  const std::size_t size = grid.size();
  map.group.assign(size, -1);
  for (std::size_t k = 0; k < size; ++k) {
    map.normal.push_back({n[k], n[size + k], n[2 * size + k]});
    map.kind.push_back(std::isfinite(map.depth[k]) ? Kind::surface : Kind::none);
  }
  return map;
}

}  // namespace meniscus
