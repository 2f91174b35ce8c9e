#include "stages/visible.hpp"

#include <algorithm>
#include <climits>
#include <cmath>
#include <numbers>

namespace meniscus {
namespace {

cl_int2 nodes_of(const SampleGrid& grid) { return {{grid.nx, grid.ny}}; }
cl_float2 origin_of(const SampleGrid& grid) { return {{grid.first, 1.0f / grid.step}}; }

// Cell size of the visibility grid: a quarter of the median particle radius on the screen, so that
// a footprint has some 160 nodes; bounded by two pixels and by 2^24 nodes.
SampleGrid visibility_grid(const View& view, const Projected& projected,
                           const std::vector<std::int32_t>& candidates) {
  std::vector<float> radii;
  radii.reserve(candidates.size());
  for (const std::int32_t i : candidates)
    radii.push_back(std::min(projected.ku[i], projected.kv[i]));
  const auto middle = radii.begin() + static_cast<std::ptrdiff_t>(radii.size() / 2);
  std::nth_element(radii.begin(), middle, radii.end());
  const double pixels = static_cast<double>(view.width) * view.height;
  const double least = std::max(0.125, std::sqrt(pixels / (1 << 24)));
  return node_grid(view, std::clamp(static_cast<double>(*middle) / 4, least, std::max(least, 2.0)));
}

}  // namespace

SplatParticles upload_splats(Device& device, const Projected& projected,
                             const std::vector<std::int32_t>& indices) {
  const std::size_t n = indices.size(), stride = (n + 63) / 64 * 64;
  std::vector<float> values(6 * stride, 0.0f);
  for (std::size_t k = 0; k < n; ++k) {
    const std::size_t i = static_cast<std::size_t>(indices[k]);
    const float row[6] = {-projected.z[i], projected.u[i],  projected.v[i],
                          projected.ku[i], projected.kv[i], projected.scale[i]};
    for (std::size_t r = 0; r < 6; ++r) values[r * stride + k] = row[r];
  }
  return {upload(device, values), static_cast<int>(n), static_cast<int>(stride)};
}

Buffer<float> splat_depth(Device& device, const SplatParticles& particles, const SampleGrid& grid,
                          double footprint, double bulge, const Buffer<float>* behind, double gap) {
  const auto depth = filled<float>(device, grid.size(), kNoSurface);
  const auto nothing = behind ? *behind : filled<float>(device, grid.size(), 0.0f);
  launch(device, "visible.cl", "splat_depth", {static_cast<std::size_t>(particles.count)}, "",
         particles.values, nothing, depth, particles.count, particles.stride, nodes_of(grid),
         origin_of(grid), grid.step,
         cl_float2{{static_cast<float>(footprint), static_cast<float>(bulge)}},
         static_cast<cl_float>(gap));
  return depth;
}

Buffer<cl_int> splat_owner(Device& device, const SplatParticles& particles,
                           const Buffer<float>& depth, const SampleGrid& grid, double footprint) {
  const auto owner = filled<cl_int>(device, grid.size(), INT_MAX);
  launch(device, "visible.cl", "splat_index", {static_cast<std::size_t>(particles.count)}, "",
         particles.values, depth, owner, particles.count, particles.stride, nodes_of(grid),
         origin_of(grid), grid.step, cl_float2{{static_cast<float>(footprint), 1.0f}});
  return owner;
}

Buffer<float> splat_far(Device& device, const SplatParticles& particles, const SampleGrid& grid,
                        double footprint) {
  const auto depth = filled<float>(device, grid.size(), 0.0f);
  launch(device, "visible.cl", "splat_far", {static_cast<std::size_t>(particles.count)}, "",
         particles.values, depth, particles.count, particles.stride, nodes_of(grid),
         origin_of(grid), grid.step, cl_float2{{static_cast<float>(footprint), 1.0f}});
  return depth;
}

Visible find_visible(Device& device, const View& view, const Projected& projected,
                     const std::vector<std::int32_t>& candidates, const VisibleParams& params,
                     double least_owned) {
  Visible visible;
  if (candidates.empty()) return visible;
  const SampleGrid grid = visibility_grid(view, projected, candidates);
  const SplatParticles splats = upload_splats(device, projected, candidates);
  const Buffer<float> depth = splat_depth(device, splats, grid, params.footprint);
  const Buffer<cl_int> owner = splat_owner(device, splats, depth, grid, params.footprint);
  const auto owned = allocate<cl_int>(device, candidates.size());
  launch(device, "visible.cl", "count_owned", {candidates.size()}, "", splats.values, owner, owned,
         splats.count, splats.stride, nodes_of(grid), origin_of(grid),
         cl_float2{{static_cast<float>(params.footprint), 1.0f}});

  const std::vector<cl_int> counts = download(device, owned);
  for (std::size_t k = 0; k < candidates.size(); ++k) {
    const std::size_t i = static_cast<std::size_t>(candidates[k]);
    const double nodes = std::numbers::pi * params.footprint * params.footprint * projected.ku[i] *
                         projected.kv[i] / (grid.step * grid.step);
    const double share = counts[k] / nodes;
    if (counts[k] > 0 && share >= least_owned) {
      visible.index.push_back(candidates[k]);
      visible.owned.push_back(static_cast<float>(share));
    }
  }
  return visible;
}

}  // namespace meniscus
