#include "stages/particle_fit.hpp"

#include <algorithm>
#include <cmath>

#include "parallel.hpp"
#include "stages/fit.hpp"

namespace meniscus {
namespace {

constexpr float kEdgeReach = 4;          // particle radii
constexpr float kHeight = 0.6f;          // h_0 of weigh_neighbours, particle radii
constexpr float kHeightGrowth = 0.075f;  // h_1, 1 / particle radii

// Where supports are narrowed: what residual noise alone explains (particle radii, and against the
// frame's least), and how far around a particle residuals are averaged.
constexpr double kNoise = 0.14, kOverLeast = 1.5, kSheetReach = 6;

constexpr std::size_t kGrain = 256;  // fits that a processor takes at a time

// The places in `around` within `reach` of each of `centre` (CSR).
struct Neighbours {
  std::vector<std::size_t> start;
  std::vector<std::int32_t> index;
};

Neighbours find_neighbours(const Projected& projected, const std::vector<std::int32_t>& centre,
                           const std::vector<std::int32_t>& around, double reach) {
  const Cells cells = cells_of(projected, around, reach);
  const float squared = static_cast<float>(reach * reach);
  const std::size_t n = centre.size();
  // Each block of fits into a list of its own, then all into one.
  const std::size_t blocks = (n + kGrain - 1) / kGrain;
  std::vector<std::vector<std::int32_t>> found(blocks);
  Neighbours near{std::vector<std::size_t>(n + 1, 0), {}};
  parallel_for(blocks, 1, [&](std::size_t begin, std::size_t end) {
    std::vector<std::int32_t> own(around.size() + 1);
    for (std::size_t block = begin; block < end; ++block)
      for (std::size_t k = block * kGrain; k < std::min(n, (block + 1) * kGrain); ++k) {
        const std::int32_t i = centre[k];
        const float x = projected.x[i], y = projected.y[i], z = projected.z[i];
        std::size_t count = 0;
        visit_near(cells, x, y, z, [&](std::int32_t p) {
          const float dx = cells.x[p] - x, dy = cells.y[p] - y, dz = cells.z[p] - z;
          own[count] = cells.item[p];  // kept if it is near: a branch would be foretold badly
          count += dx * dx + dy * dy + dz * dz < squared;
          return true;
        });
        found[block].insert(found[block].end(), own.begin(),
                            own.begin() + static_cast<std::ptrdiff_t>(count));
        near.start[k + 1] = count;
      }
  });
  for (std::size_t k = 0; k < n; ++k) near.start[k + 1] += near.start[k];
  near.index.resize(near.start[n]);
  parallel_for(blocks, 1, [&](std::size_t begin, std::size_t end) {
    for (std::size_t block = begin; block < end; ++block)
      std::copy(found[block].begin(), found[block].end(),
                near.index.begin() + static_cast<std::ptrdiff_t>(near.start[block * kGrain]));
  });
  return near;
}

// Lanes of kernel fit_groups: a fit each.
struct Lanes {
  FitBatches batches;
  std::vector<cl_int> particle;   // [lanes] centre of the lane's fit in the surface, -1: unused
  std::vector<cl_int> neighbour;  // [slots] in the surface, -1: unused
};

Lanes make_lanes(const Neighbours& near, const std::vector<std::int32_t>& place) {
  std::vector<std::size_t> sizes;
  for (std::size_t k = 0; k < place.size(); ++k) sizes.push_back(near.start[k + 1] - near.start[k]);
  Lanes lanes{make_batches(sizes), {}, {}};
  lanes.particle.assign(lanes.batches.lanes, -1);
  lanes.neighbour.assign(lanes.batches.slots, -1);
  parallel_for(place.size(), kGrain, [&](std::size_t begin, std::size_t end) {
    for (std::size_t l = begin; l < end; ++l) {
      const std::size_t k = static_cast<std::size_t>(lanes.batches.order[l]);
      lanes.particle[l] = place[k];
      std::size_t slot = lanes.batches.first_slot(l);
      for (std::size_t p = near.start[k]; p < near.start[k + 1]; ++p, slot += 8)
        lanes.neighbour[slot] = near.index[p];
    }
  });
  return lanes;
}

// The lanes' supports for the last pass, see fit_particles.
std::vector<float> narrow_supports(const Lanes& lanes, const Neighbours& near,
                                   const std::vector<float>& particles,
                                   const std::vector<float>& normal,
                                   const std::vector<float>& residual, const FitParams& params) {
  const std::size_t n = normal.size() / 3, fits = near.start.size() - 1;
  const auto vector_at = [n](const std::vector<float>& values, std::size_t k) {
    return Vec3d{values[k], values[n + k], values[2 * n + k]};
  };
  std::vector<float> rho(lanes.batches.lanes, static_cast<float>(params.support));
  std::vector<float> own(n, -1.0f), sorted;
  for (std::size_t l = 0; l < fits; ++l) {
    own[lanes.particle[l]] = residual[l];
    if (residual[l] > 0) sorted.push_back(residual[l]);
  }
  if (sorted.empty()) return rho;
  const auto least = sorted.begin() + static_cast<std::ptrdiff_t>(sorted.size() / 20);
  std::nth_element(sorted.begin(), least, sorted.end());
  const double noise = std::max(kOverLeast * *least, kNoise);
  parallel_for(fits, kGrain, [&](std::size_t begin, std::size_t end) {
    for (std::size_t l = begin; l < end; ++l) {
      const std::size_t k = static_cast<std::size_t>(lanes.batches.order[l]);
      const std::size_t i = static_cast<std::size_t>(lanes.particle[l]);
      double sum = 0, weight = 0;
      for (std::size_t p = near.start[k]; p < near.start[k + 1]; ++p) {
        const std::size_t j = static_cast<std::size_t>(near.index[p]);
        const Vec3d apart = vector_at(particles, j) - vector_at(particles, i);
        if (!(own[j] > 0) || dot(apart, apart) >= kSheetReach * kSheetReach) continue;
        const double w = (1 - length(apart) / kSheetReach) *
                         smooth_step(0.8, 0.95, dot(vector_at(normal, i), vector_at(normal, j)));
        sum += w * own[j];
        weight += w;
      }
      if (!(weight > 0)) continue;
      const double share = noise * weight / sum;
      rho[l] =
          static_cast<float>(params.support * std::clamp(share * share, params.least_support, 1.0));
    }
  });
  return rho;
}

}  // namespace

ParticleFits fit_particles(Device& device, const Projected& projected, const Visible& seen,
                           const SurfaceParticles& around, const FitParams& params) {
  const std::size_t count = seen.index.size(), n = around.index.size();
  ParticleFits fits;
  if (count == 0) return fits;
  std::vector<float> particles(4 * n), normal(3 * n);
  for (std::size_t k = 0; k < n; ++k) {
    const std::size_t i = static_cast<std::size_t>(around.index[k]);
    particles[k] = projected.x[i];
    particles[n + k] = projected.y[i];
    particles[2 * n + k] = projected.z[i];
    particles[3 * n + k] = static_cast<float>(around.weight[k]);
    normal[k] = static_cast<float>(around.normal[k].x);
    normal[n + k] = static_cast<float>(around.normal[k].y);
    normal[2 * n + k] = static_cast<float>(around.normal[k].z);
  }
  const std::vector<std::int32_t> place = places_in(around.index, seen.index);
  const Neighbours near = find_neighbours(projected, seen.index, around.index, params.support);
  const Lanes host = make_lanes(near, place);
  const std::size_t lanes = host.batches.lanes, slots = host.batches.slots;
  std::vector<float> rho(lanes, static_cast<float>(params.support));

  DeviceFits device_fits{allocate<float>(device, 7 * slots),
                         upload(device, host.batches.first),
                         upload(device, host.batches.length),
                         upload(device, rho),
                         allocate<float>(device, 10 * lanes),
                         filled<float>(device, 2 * lanes, -1.0f),
                         lanes,
                         slots};
  const auto device_particles = upload(device, particles);
  const auto device_normal = upload(device, normal);
  const auto device_particle = upload(device, host.particle);
  const auto device_neighbour = upload(device, host.neighbour);
  const cl_int surface_count = static_cast<cl_int>(n), lane_count = static_cast<cl_int>(lanes);
  const float falloff = static_cast<float>(2 / (params.normal_sigma * params.normal_sigma));
  // Few items of much work: small work-groups spread them over the compute units.
  const int width = device.state().vector_width;
  const Range items{lanes / static_cast<std::size_t>(width), 1, 8, 1};
  for (int pass = 0; pass < params.passes; ++pass) {
    if (pass > 0 && pass + 1 == params.passes && params.least_support < 1) {
      rho = narrow_supports(host, near, particles, download(device, device_normal),
                            download(device, device_fits.quality), params);
      device_fits.scale = upload(device, rho);
    }
    launch(device, "particle_fit.cl", "weigh_neighbours", items, width_option(width),
           device_particles, device_normal, device_particle, device_neighbour, device_fits.first,
           device_fits.length, device_fits.scale, device_fits.quadric, device_fits.quality,
           device_fits.points, surface_count, static_cast<cl_int>(slots), lane_count, cl_int{pass},
           cl_float4{{falloff, static_cast<float>(params.tau), kHeight, kHeightGrowth}});
    fit_batches(device, device_fits, params);
    launch(device, "particle_fit.cl", "turn_normals", {lanes}, "", device_particle,
           device_fits.quadric, device_fits.quality, device_normal, surface_count, lane_count);
  }
  const auto device_rows = allocate<float>(device, 3 * lanes);
  launch(device, "particle_fit.cl", "measure_edges", items, width_option(width), device_particles,
         device_normal, device_particle, device_neighbour, device_fits.first, device_fits.length,
         device_fits.scale, device_fits.quadric, device_rows, surface_count, lane_count, falloff,
         kEdgeReach);

  const std::vector<float> c = download(device, device_fits.quadric);
  const std::vector<float> quality = download(device, device_fits.quality);
  const std::vector<float> rows = download(device, device_rows);
  normal = download(device, device_normal);
  std::vector<std::size_t> lane_of(count);
  for (std::size_t l = 0; l < count; ++l)
    lane_of[static_cast<std::size_t>(host.batches.order[l])] = l;
  for (std::size_t k = 0; k < count; ++k) {
    const std::size_t l = lane_of[k], i = static_cast<std::size_t>(place[k]);
    fits.position.push_back(projected.eye(static_cast<std::size_t>(seen.index[k])));
    fits.normal.push_back({normal[i], normal[n + i], normal[2 * n + i]});
    fits.visible.push_back(visibility(seen.owned[k]));
    fits.surface.push_back(around.weight[i]);
    fits.support.push_back(rho[l]);
    fits.edge.push_back(rows[l]);
    fits.spread.push_back(rows[lanes + l]);
    fits.supporters.push_back(rows[2 * lanes + l]);
    fits.residual.push_back(quality[l]);
    std::array<float, 10> quadric;
    for (std::size_t r = 0; r < 10; ++r) quadric[r] = c[r * lanes + l];
    fits.foot.push_back(fits.position[k]);
    if (quality[l] >= 0) {
      const double behind = std::clamp(-double{quadric[0]}, -1.0, 1.0);
      fits.foot[k] += fits.normal[k] * (params.offset + behind);
      quadric[0] -= static_cast<float>(params.offset);
    }
    fits.quadric.push_back(quadric);
  }
  return fits;
}

}  // namespace meniscus
