#include "stages/frame/visible.hpp"

#include <algorithm>
#include <array>
#include <climits>
#include <cmath>
#include <numbers>
#include <span>
#include <tuple>

#include "base/order_statistics.hpp"
#include "base/parallel.hpp"
#include "base/rounded_up.hpp"
#include "device/kernels.hpp"
#include "device/together.hpp"
#include "stages/frame/bins.hpp"
#include "stages/frame/minima.hpp"

namespace meniscus {
namespace {

cl_int2 nodes_of(const SampleGrid& grid) { return {{grid.nx, grid.ny}}; }
cl_float2 origin_of(const SampleGrid& grid) { return {{grid.first, 1.0f / grid.step}}; }
cl_float2 sphere_of(double footprint) { return {{static_cast<float>(footprint), 1.0f}}; }

Range vectors(Device& device, std::size_t n) {
  return {n / static_cast<std::size_t>(device.state().vector_width)};
}

Discs room_for_discs(Device& device, const SplatParticles& particles, cl_float2 sphere) {
  const std::size_t stride = static_cast<std::size_t>(particles.stride);
  return {allocate<float>(device, 8 * stride),
          sphere,
          {allocate<cl_int>(device, 4 * stride), allocate<float>(device, stride), particles.count,
           particles.stride}};
}

// Discs by their nearest depths, the deepest front that each bin's map can have, and blank maps of
// depths and owners, where the device draws by minima.
struct BoundDiscs {
  Discs discs;
  Buffer<float> bound;
  Buffer<float> depth;
  Buffer<cl_int> owner;
};

// The first of `owned`, as many as there are particles, become 0.
BoundDiscs bound_discs(Device& device, const SplatParticles& particles, const SampleGrid& grid,
                       cl_float2 sphere, const Buffer<cl_int>& owned) {
  const Discs discs = room_for_discs(device, particles, sphere);
  const std::size_t stride = static_cast<std::size_t>(particles.stride);
  const int shift = cover_shift(double{sphere.s[0]} * particles.pixels / grid.step);
  const Covers covers{allocate<cl_int>(device, 4 * stride), allocate<float>(device, stride),
                      particles.count, particles.stride};
  const BoundCells cells = room_for_cells(device, particles.count, grid, shift);
  const std::size_t nodes = draws_by_minima(device) ? grid.size() : 0;
  const auto depth = allocate<float>(device, nodes);
  const auto owner = allocate<cl_int>(device, nodes);
  struct Blanks {
    const Buffer<float>&cell, &depth;
    const Buffer<cl_int>&owner, &owned;
  };
  const records::Covering how{particles.stride,
                              lattice_of(grid),
                              1.0f / grid.step,
                              shift,
                              sphere.s[0],
                              sphere.s[1],
                              static_cast<int>(cells.blank),
                              static_cast<int>(nodes),
                              owned.size > 0 ? particles.count : 0};
  launch(device, kernels::cover_discs, device.state().vector_width, vectors(device, stride),
         particles.values, discs.records, discs.outlines, covers,
         Blanks{cells.bound, depth, owner, owned}, how);
  return {discs, bound_bins(device, covers, grid, cells), depth, owner};
}

BoundDiscs bound_discs(Device& device, const SplatParticles& particles, const SampleGrid& grid,
                       cl_float2 sphere) {
  return bound_discs(device, particles, grid, sphere, allocate<cl_int>(device, 0));
}

// The nearest front of all discs at every node, by atomic minima.
void lower_discs(Device& device, const BoundDiscs& bound, const SampleGrid& grid) {
  draw_minima(device, kernels::lower_discs, bound.discs.records, bound.discs.outlines, bound.bound,
              grid, std::tie(bound.depth), lattice_of(grid));
}

// Particles that are drawn as spheres, and where their fronts or extents go.
template <class Maps>
struct Drawing {
  const SplatParticles& particles;
  cl_float2 sphere;  // footprint; bulge over footprint
  const Maps& into;
};

// Both by atomic minima, in one launch.
void lower_fronts_and_extents(Device& device, const SampleGrid& grid, const Drawing<Fronts>& fronts,
                              const Drawing<Extent>& extents) {
  const int width = device.state().vector_width;
  const auto spheres_of = [&](const auto& drawing) {
    return drawn_spheres(grid, drawing.particles, drawing.sphere, Drawn::every);
  };
  launch(device, kernels::lower_fronts_and_extents, width,
         disc_items(fronts.particles.count + extents.particles.count, width),
         fronts.particles.values, extents.particles.values, no_bound(device, grid), fronts.into,
         extents.into, spheres_of(fronts), spheres_of(extents), lattice_of(grid));
}

// Draws all bins with a kernel of visible.cl.
template <class T>
void draw(Device& device, const auto& kernel, const Discs& discs, const Buffer<float>& bound,
          const SampleGrid& grid, const Buffer<T>& result) {
  draw_bins(device, discs.outlines, bound, grid, [&](const BinLists& lists) {
    launch(device, kernel, device.state().vector_width,
           bin_items(lists, device.state().vector_width), discs.records, lists, result, lists.bins,
           lattice_of(grid));
  });
}

// The same for several maps of all discs, whatever lies before them.
template <class... Maps>
void draw_all(Device& device, const auto& kernel, const Discs& discs, const SampleGrid& grid,
              const std::tuple<Maps&...>& maps) {
  draw_bins(device, discs.outlines, no_bound(device, grid), grid, [&](const BinLists& lists) {
    std::apply(
        [&](Maps&... all) {
          launch(device, kernel, device.state().vector_width,
                 bin_items(lists, device.state().vector_width), discs.records, lists, all...,
                 lists.bins, lattice_of(grid));
        },
        maps);
  });
}

// Cell size of the visibility grid: a quarter of the median particle radius on the screen, so that
// a footprint has some 160 nodes; bounded by two pixels and by 2^24 nodes.
SampleGrid visibility_grid(const View& view, const Projected& projected,
                           const std::vector<std::int32_t>& candidates) {
  std::vector<float> radii(candidates.size());
  std::ranges::transform(candidates, radii.begin(), [&](std::int32_t i) {
    return std::min(projected.ku[i], projected.kv[i]);
  });
  const double middle = median_of(std::move(radii));
  const double pixels = static_cast<double>(view.width) * view.height;
  const double least = std::max(0.125, std::sqrt(pixels / (1 << 24)));
  return node_grid(view, std::clamp(middle / 4, least, std::max(least, 2.0)));
}

}  // namespace

Discs outline_discs(Device& device, const SplatParticles& particles, const SampleGrid& grid,
                    cl_float2 sphere, Drawn drawn) {
  const std::size_t stride = static_cast<std::size_t>(particles.stride);
  const Discs discs = room_for_discs(device, particles, sphere);
  launch(device, kernels::outline_discs, device.state().vector_width, vectors(device, stride),
         particles.values, discs.records, discs.outlines, particles.stride, nodes_of(grid),
         origin_of(grid), sphere, static_cast<cl_int>(drawn));
  return discs;
}

SplatParticles upload_splats(Device& device, const Projected& projected,
                             const std::vector<std::int32_t>& indices, float largest) {
  const std::size_t n = indices.size(), stride = rounded_up(n, 64);
  Upload<float> values(device, 6 * stride);
  constexpr std::size_t kGrain = 4096;  // particles that are worth a thread
  parallel_for(n, kGrain, [&](std::size_t begin, std::size_t end) {
    for (std::size_t k = begin; k < end; ++k) {
      const std::size_t i = static_cast<std::size_t>(indices[k]);
      const float scale = std::min(projected.scale[i], largest),
                  less = scale == projected.scale[i] ? 1.0f : scale / projected.scale[i];
      const float row[6] = {-projected.z[i],        projected.u[i],         projected.v[i],
                            less * projected.ku[i], less * projected.kv[i], scale};
      for (std::size_t r = 0; r < 6; ++r) values[r * stride + k] = row[r];
    }
  });
  for (std::size_t r = 0; r < 6; ++r)
    std::fill(values.data() + r * stride + n, values.data() + (r + 1) * stride, 0.0f);
  // Four sums: one after the other would wait for each.
  std::array<double, 4> sums{};
  for (std::size_t k = 0; k < n; ++k) {
    const std::size_t i = static_cast<std::size_t>(indices[k]);
    sums[k % 4] += std::min(projected.ku[i], projected.kv[i]);
  }
  const double pixels = sums[0] + sums[1] + sums[2] + sums[3];
  return {values.done(), static_cast<int>(n), static_cast<int>(stride),
          n > 0 ? pixels / static_cast<double>(n) : 0};
}

Buffer<float> splat_depth(Device& device, const SplatParticles& particles, const SampleGrid& grid,
                          double footprint, double bulge) {
  if (particles.count == 0) return filled<float>(device, grid.size(), kNoSurface);
  const cl_float2 sphere{{static_cast<float>(footprint), static_cast<float>(bulge)}};
  const BoundDiscs bound = bound_discs(device, particles, grid, sphere);
  if (draws_by_minima(device)) {
    lower_discs(device, bound, grid);
    return bound.depth;
  }
  const auto depth = allocate<float>(device, grid.size());
  draw(device, kernels::splat_depth, bound.discs, bound.bound, grid, depth);
  return depth;
}

Buffer<cl_int> splat_owner(Device& device, const SplatParticles& particles, const SampleGrid& grid,
                           double footprint) {
  if (particles.count == 0) return filled<cl_int>(device, grid.size(), INT_MAX);
  const BoundDiscs bound = bound_discs(device, particles, grid, sphere_of(footprint));
  if (draws_by_minima(device)) {
    lower_discs(device, bound, grid);
    draw_minima(device, kernels::own_discs, bound.discs.records, bound.discs.outlines, bound.bound,
                grid, std::tie(bound.depth, bound.owner), lattice_of(grid));
    return bound.owner;
  }
  const auto owner = allocate<cl_int>(device, grid.size());
  draw(device, kernels::splat_owner, bound.discs, bound.bound, grid, owner);
  return owner;
}

void splat_fronts(Device& device, const SplatParticles& particles, const SampleGrid& grid,
                  double footprint, double bulge, const Fronts& into) {
  if (particles.count == 0) return;
  const cl_float2 sphere{{static_cast<float>(footprint), static_cast<float>(bulge)}};
  if (draws_by_minima(device)) {
    const SplatParticles none{particles.values, 0, particles.stride};
    return lower_fronts_and_extents(device, grid, {particles, sphere, into},
                                    {none, sphere, {into.depth, into.depth, into.occupied}});
  }
  draw_all(device, kernels::splat_fronts,
           outline_discs(device, particles, grid, sphere, Drawn::every), grid,
           std::tie(into.depth, into.occupied));
}

void splat_extent(Device& device, const SplatParticles& particles, const SampleGrid& grid,
                  double footprint, const OccupiedBlocks& needed, const Extent& into) {
  const bool by_minima = draws_by_minima(device);
  if (particles.count == 0) {
    if (!by_minima) fill(device, into.from, kNoSurface);
    return;
  }
  const cl_float2 sphere = sphere_of(footprint);
  if (by_minima) {
    const SplatParticles none{particles.values, 0, particles.stride};
    return lower_fronts_and_extents(device, grid, {none, sphere, {into.from, into.occupied}},
                                    {particles, sphere, into});
  }
  draw_all(device, kernels::splat_extent,
           outline_discs(device, particles, grid, sphere, Drawn::every), grid,
           std::tie(into, into.occupied, needed));
}

void splat_fronts_and_extent(Device& device, const SampleGrid& grid, const SplatParticles& seen,
                             double footprint, double bulge, const Fronts& fronts,
                             const SplatParticles& others, double radius, const Extent& extent) {
  if (!draws_by_minima(device)) {
    splat_fronts(device, seen, grid, footprint, bulge, fronts);
    return splat_extent(device, others, grid, radius, fronts.occupied, extent);
  }
  const cl_float2 sphere{{static_cast<float>(footprint), static_cast<float>(bulge)}};
  lower_fronts_and_extents(device, grid, {seen, sphere, fronts},
                           {others, sphere_of(radius), extent});
}

SampleGrid count_owned(Device& device, const View& view, const Projected& projected,
                       const std::vector<std::int32_t>& candidates, const SplatParticles& splats,
                       const VisibleParams& params, const Buffer<cl_int>& owned) {
  const SampleGrid grid = visibility_grid(view, projected, candidates);
  const BoundDiscs bound = bound_discs(device, splats, grid, sphere_of(params.footprint), owned);
  if (draws_by_minima(device)) {
    lower_discs(device, bound, grid);
    draw_minima(device, kernels::count_discs, bound.discs.records, bound.discs.outlines,
                bound.bound, grid, std::tie(bound.depth, bound.owner, owned), lattice_of(grid));
  } else {
    draw(device, kernels::count_owned, bound.discs, bound.bound, grid, owned);
  }
  return grid;
}

Visible visible_among(const Projected& projected, const std::vector<std::int32_t>& candidates,
                      const SampleGrid& grid, const cl_int* counts, const VisibleParams& params,
                      double least_owned) {
  constexpr std::size_t kGrain = 4096;  // candidates that are worth a thread
  std::vector<Visible> parts((candidates.size() + kGrain - 1) / kGrain);
  parallel_for(parts.size(), 1, [&](std::size_t begin, std::size_t end) {
    for (std::size_t part = begin; part < end; ++part) {
      // Without branches, which would be mispredicted: few own anything.
      std::array<std::size_t, kGrain> owners;
      std::size_t number = 0;
      for (std::size_t k = part * kGrain; k < std::min(candidates.size(), (part + 1) * kGrain);
           ++k) {
        owners[number] = k;
        number += counts[k] != 0;
      }
      for (const std::size_t k : std::span(owners).first(number)) {
        const std::size_t i = static_cast<std::size_t>(candidates[k]);
        const double nodes = std::numbers::pi * params.footprint * params.footprint *
                             projected.ku[i] * projected.kv[i] / (grid.step * grid.step);
        // A footprint may be larger than the image.
        const double share = counts[k] / std::min(nodes, static_cast<double>(grid.size()));
        if (share < least_owned) continue;
        parts[part].index.push_back(candidates[k]);
        parts[part].owned.push_back(static_cast<float>(share));
      }
    }
  });
  Visible visible;
  for (const Visible& part : parts) {
    visible.index.insert(visible.index.end(), part.index.begin(), part.index.end());
    visible.owned.insert(visible.owned.end(), part.owned.begin(), part.owned.end());
  }
  return visible;
}

Visible find_visible(Device& device, const View& view, const Projected& projected,
                     const std::vector<std::int32_t>& candidates, const VisibleParams& params,
                     double least_owned) {
  if (candidates.empty()) return {};
  const auto owned = allocate<cl_int>(device, candidates.size());
  const SampleGrid grid = count_owned(device, view, projected, candidates,
                                      upload_splats(device, projected, candidates), params, owned);
  const HostView counts(device, owned);
  return visible_among(projected, candidates, grid, counts.data(), params, least_owned);
}

}  // namespace meniscus
