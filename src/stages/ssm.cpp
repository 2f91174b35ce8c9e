#include "stages/ssm.hpp"

#include <algorithm>
#include <array>
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

std::vector<SilhouetteEdge> place_circle_cuts(const SurfaceMap& nodes,
                                              std::vector<SilhouetteEdge> edges,
                                              const Projected& particles, double footprint,
                                              double z_max) {
  const SampleGrid& grid = nodes.grid;
  // The silhouette edge from each node to the right (axis 0) and down (axis 1), or -1.
  std::array<std::vector<int>, 2> edge_after;
  for (auto& axis : edge_after) axis.assign(grid.size(), -1);
  for (std::size_t e = 0; e < edges.size(); ++e) {
    const int first = std::min(edges[e].front, edges[e].back);
    const int axis = std::abs(edges[e].front - edges[e].back) == 1 ? 0 : 1;
    edge_after[axis][first] = static_cast<int>(e);
  }
  std::vector<double> farthest(edges.size(), -1);

  for (std::size_t p = 0; p < particles.size(); ++p) {
    const double surface = -double{particles.z[p]} - particles.scale[p];
    const double centre[2] = {particles.u[p], particles.v[p]};
    const double radius[2] = {footprint * particles.ku[p], footprint * particles.kv[p]};
    // The circle crosses each grid line of an axis twice: at the centre -+ half.
    for (int axis = 0; axis < 2; ++axis) {
      const int other = 1 - axis;
      const int along = axis == 0 ? grid.nx : grid.ny, lines = axis == 0 ? grid.ny : grid.nx;
      const auto line_at = [&](double pixel) {
        return std::clamp((pixel - grid.first) / grid.step, -1.0, double(lines));
      };
      const int begin = static_cast<int>(std::ceil(line_at(centre[other] - radius[other])));
      const int end = static_cast<int>(std::floor(line_at(centre[other] + radius[other])));
      for (int line = std::max(0, begin); line <= std::min(lines - 1, end); ++line) {
        const double d = (grid.first + double{grid.step} * line - centre[other]) / radius[other];
        const double half = radius[axis] * std::sqrt(std::max(0.0, 1 - d * d));
        for (const int sign : {-1, 1}) {
          const double crossing = (centre[axis] + sign * half - grid.first) / grid.step;
          if (!(crossing >= 0 && crossing < along - 1)) continue;
          const int cell = static_cast<int>(crossing);
          const int node = axis == 0 ? line * grid.nx + cell : cell * grid.nx + line;
          const int e = edge_after[axis][node];
          // The circle ends towards the back node, or it is not what ends here.
          if (e < 0 || (edges[e].front == node) != (sign > 0)) continue;
          const double behind = surface - nodes.depth[edges[e].front];
          if (behind > z_max || std::abs(behind) >= std::abs(surface - nodes.depth[edges[e].back]))
            continue;
          const double share = sign > 0 ? crossing - cell : 1 - (crossing - cell);
          farthest[e] = std::max(farthest[e], share);
        }
      }
    }
  }
  for (std::size_t e = 0; e < edges.size(); ++e)
    if (farthest[e] >= 0) edges[e].cut = static_cast<float>(farthest[e]);
  return edges;
}

}  // namespace meniscus
