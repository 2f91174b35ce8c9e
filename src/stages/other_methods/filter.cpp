#include "stages/other_methods/filter.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <string>
#include <utility>

#include "device/kernels.hpp"
#include "stages/sample/surface_buffers.hpp"

namespace meniscus {
namespace {

constexpr float kOutside = std::numeric_limits<float>::quiet_NaN();
constexpr double kCut = 2.5;         // a window's radius, sigmas
constexpr int kWidestLine = 1 << 9;  // samples that a one-dimensional window reaches at most

// A map with NaN around it, as the kernels take it (filter.cl), and room for the next one.
struct PaddedMaps {
  SampleGrid grid;
  cl_int4 layout;
  Buffer<float> from, to;
};

Range samples_of(const SampleGrid& grid) {
  return {static_cast<std::size_t>(grid.nx), static_cast<std::size_t>(grid.ny), 8, 8};
}

PaddedMaps pad(Device& device, const Buffer<float>& depth, const SampleGrid& grid, int padding) {
  const int stride = grid.nx + 2 * padding + device.state().vector_width;
  const std::size_t size =
      static_cast<std::size_t>(stride) * static_cast<std::size_t>(grid.ny + 2 * padding);
  require(size < (std::size_t{1} << 31), "filter: the padded map has 2^31 samples or more");
  PaddedMaps maps{grid,
                  {{grid.nx, grid.ny, padding, stride}},
                  filled<float>(device, size, kOutside),
                  filled<float>(device, size, kOutside)};
  for (const Buffer<float>& map : {maps.from, maps.to})
    launch(device, kernels::pad_depth, 1, samples_of(grid), depth, map, maps.layout);
  return maps;
}

Buffer<float> crop(Device& device, const PaddedMaps& maps) {
  auto depth = allocate<float>(device, maps.grid.size());
  launch(device, kernels::crop_depth, 1, samples_of(maps.grid), maps.from, depth, maps.layout);
  return depth;
}

// One pass; the result becomes the input of the next.
template <class... Arguments>
void pass(Device& device, PaddedMaps& maps, const auto& kernel, const Arguments&... arguments) {
  const int width = device.state().vector_width;
  const std::size_t items = static_cast<std::size_t>((maps.grid.nx + width - 1) / width);
  launch(device, kernel, width, {items, static_cast<std::size_t>(maps.grid.ny), 8, 8}, maps.from,
         maps.to, maps.layout, arguments...);
  std::swap(maps.from, maps.to);
}

// The nearest depth of the map, 0 where it has no surface. Waits.
float nearest_depth(Device& device, const Buffer<float>& depth, const SampleGrid& grid) {
  require(depth.size == grid.size(), "filter: the depth map has " + std::to_string(depth.size) +
                                         " values but the grid " + std::to_string(grid.nx) + " x " +
                                         std::to_string(grid.ny) + " samples");
  const std::vector<float> values = download(device, depth);
  float nearest = kNoSurface;
  for (const float t : values) nearest = std::min(nearest, t);
  return nearest < kNoSurface ? nearest : 0;
}

double clip_w(const View& view, double t) { return view.w_row[3] - view.w_row[2] * t; }

// A Gaussian window as the kernels take it.
struct Window {
  cl_float4 spread;
  int reach = 1;  // samples, of the widest
};

// sigma in particle radii.
Window window_of(const View& view, const SampleGrid& grid, double sigma, double nearest,
                 int widest) {
  const double u = sigma * view.u_scale / grid.step, v = sigma * view.v_scale / grid.step;
  const double reach = kCut * std::max(u, v) / clip_w(view, nearest);
  return {{{static_cast<float>(u * u), static_cast<float>(v * v), static_cast<float>(view.w_row[3]),
            static_cast<float>(-view.w_row[2])}},
          static_cast<int>(std::clamp(std::ceil(reach), 1.0, double(widest)))};
}

constexpr cl_int2 kRows{{1, 0}}, kColumns{{0, 1}}, kBoth{{1, 1}};

// All iterations: along rows and then columns, or over both at once.
template <class Params, class Argument>
void passes(Device& device, PaddedMaps& maps, const auto& kernel, const Params& params,
            const cl_float4& spread, const Argument& argument) {
  for (int k = 0; k < params.iterations; ++k) {
    if (params.separable) {
      pass(device, maps, kernel, kRows, spread, argument);
      pass(device, maps, kernel, kColumns, spread, argument);
    } else {
      pass(device, maps, kernel, kBoth, spread, argument);
    }
  }
}

}  // namespace

Buffer<float> filter_bilateral(Device& device, const View& view, const Buffer<float>& depth,
                               const SampleGrid& grid, const BilateralParams& params) {
  const double nearest = nearest_depth(device, depth, grid);
  if (nearest == 0 || params.sigma == 0) return depth;
  const Window window =
      window_of(view, grid, params.sigma, nearest, params.separable ? kWidestLine : kWidestWindow);
  const cl_float falloff = static_cast<cl_float>(0.5 / (params.range * params.range));
  PaddedMaps maps = pad(device, depth, grid, window.reach);
  passes(device, maps, kernels::filter_bilateral, params, window.spread, falloff);
  return crop(device, maps);
}

Buffer<float> filter_narrow_range(Device& device, const View& view, const Buffer<float>& depth,
                                  const SampleGrid& grid, const NarrowRangeParams& params) {
  const double nearest = nearest_depth(device, depth, grid);
  if (nearest == 0) return depth;
  const cl_float2 limits{{static_cast<float>(params.delta), static_cast<float>(params.mu)}};
  PaddedMaps maps = pad(device, depth, grid, std::max(1, params.cleanup));
  if (params.sigma > 0) {
    const Window window = window_of(view, grid, params.sigma, nearest,
                                    params.separable ? kWidestLine : kWidestWindow);
    maps = pad(device, depth, grid, std::max(window.reach, params.cleanup));
    passes(device, maps, kernels::filter_narrow_range, params, window.spread, limits);
  }
  if (params.cleanup > 0) {
    // As wide at every depth: clip w is taken to be 1.
    const double sigma = params.cleanup / kCut;
    const float squared = static_cast<float>(1.0001 * (sigma * sigma));
    const cl_float4 spread{{squared, squared, 1.0f, 0.0f}};
    pass(device, maps, kernels::filter_narrow_range, kBoth, spread, limits);
  }
  return crop(device, maps);
}

Buffer<float> flow_curvature(Device& device, const View& view, const Buffer<float>& depth,
                             const SampleGrid& grid, const CurvatureFlowParams& params) {
  const double nearest = nearest_depth(device, depth, grid);
  if (nearest == 0 || params.time == 0) return depth;
  // t changes by (d^2 t / dx^2 + d^2 t / dy^2) / 2 where the surface faces the camera: explicit
  // steps are stable up to side^2 / 2.
  const double side =
      grid.step * clip_w(view, nearest) / std::max(view.u_scale, view.v_scale);  // radii
  const double longest = 0.5 * params.step * side * side;
  constexpr double kMostSteps = 4000;  // then the camera is so near that the flow ends early
  const double steps = std::clamp(std::ceil(params.time / longest), 1.0, kMostSteps);
  const cl_float2 limits{{static_cast<float>(params.z_max),
                          static_cast<float>(std::min(params.time / steps, longest))}};
  PaddedMaps maps = pad(device, depth, grid, 1);
  for (int k = 0; k < static_cast<int>(steps); ++k)
    pass(device, maps, kernels::flow_step, grid.step, grid.first, limits, kernel_rays(view));
  return crop(device, maps);
}

}  // namespace meniscus
