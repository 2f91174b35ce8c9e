#include "stages/other_methods/ssm.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <string>

#include "device/kernels.hpp"
#include "stages/sample/surface_buffers.hpp"

namespace meniscus {
namespace {

// One work-item per `width` neighbours of a row.
Range vectors(const SampleGrid& grid, int width) {
  return {static_cast<std::size_t>((grid.nx + width - 1) / width),
          static_cast<std::size_t>(grid.ny), 8, 8};
}

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
    return {
        {static_cast<float>(params.filter * ((cell / step) * (cell / step))), 1.0f, 0.0f, 0.0f}};
  const double sigma = params.sigma * scale / step;  // samples, times w
  return {{static_cast<float>(2 * sigma * sigma), static_cast<float>(view.w_row[3]),
           static_cast<float>(-view.w_row[2]), 0.0f}};
}

}  // namespace

Buffer<float> smooth_depth(Device& device, const View& view, const Buffer<float>& depth,
                           const SampleGrid& grid, const SsmParams& params, double cell) {
  check_size(depth, grid);
  const int width = device.state().vector_width;
  const Range items = vectors(grid, width);
  const cl_float z_max = static_cast<cl_float>(params.z_max);
  // Rows that lie a power of two apart share few places of a processor's cache, where a column's
  // window would not find room: 64 bytes more than a multiple of 256.
  const int stride = (grid.nx + 63) / 64 * 64 + 16;
  const auto spaced =
      allocate<float>(device, static_cast<std::size_t>(stride) * static_cast<std::size_t>(grid.ny));
  launch(device, kernels::space_rows, width, items, depth, spaced, cl_int{grid.nx}, cl_int{grid.ny},
         cl_int{stride});
  const auto columns = allocate<float>(device, depth.size + static_cast<std::size_t>(width));
  const auto smoothed = allocate<float>(device, depth.size);
  launch(device, kernels::smooth_columns, width, items, spaced, columns, cl_int{grid.nx},
         cl_int{grid.ny}, cl_int{stride}, z_max,
         spread_of(view, view.v_scale, grid.step, params, cell));
  launch(device, kernels::smooth_rows, width, items, columns, smoothed, cl_int{grid.nx},
         cl_int{grid.ny}, z_max, spread_of(view, view.u_scale, grid.step, params, cell));
  return smoothed;
}

Buffer<float> depth_normals(Device& device, const View& view, const Buffer<float>& depth,
                            const SampleGrid& grid, double z_max) {
  const auto normals = allocate<float>(device, 3 * grid.size());
  const int width = device.state().vector_width;
  launch(device, kernels::depth_normals, width, vectors(grid, width), depth, normals,
         cl_int{grid.nx}, cl_int{grid.ny}, cl_float2{{grid.first, grid.step}},
         static_cast<cl_float>(z_max), kernel_rays(view));
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
