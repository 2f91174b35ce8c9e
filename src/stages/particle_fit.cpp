#include "stages/particle_fit.hpp"

#include <algorithm>
#include <cmath>

#include "parallel.hpp"
#include "stages/fit.hpp"
#include "stages/sheet.hpp"

namespace meniscus {
namespace {

constexpr float kEdgeReach = 4;          // particle radii
constexpr float kHeight = 0.6f;          // h_0 of weigh_neighbours, particle radii
constexpr float kHeightGrowth = 0.075f;  // h_1, 1 / particle radii

// Where supports are narrowed: what residual noise alone explains (particle radii, and against the
// frame's least), and over which fits residuals are averaged.
constexpr double kNoise = 0.14, kOverLeast = 1.5;
constexpr SheetWeights kSheet{6, 0.8f, 0.95f};

constexpr std::size_t kRecord = 8, kNormal = 4;  // a particle's record, see particle_fit.cl

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

// Lanes of kernel fit_groups, a fit each: as many as the device takes at a time.
struct Lanes {
  FitBatches batches;
  Buffer<cl_int> particle;   // [lanes] centre of the lane's fit in the surface, -1: unused
  Buffer<cl_int> neighbour;  // [slots] in the surface, -1: unused
  DeviceFits fits;           // they share the points, which matter only from kernel to kernel
};

std::vector<Lanes> make_lanes(Device& device, const Neighbours& near,
                              const std::vector<std::int32_t>& place) {
  std::vector<std::size_t> sizes;
  for (std::size_t k = 0; k < place.size(); ++k) sizes.push_back(near.start[k + 1] - near.start[k]);
  std::vector<FitBatches> parts = make_batches(sizes, most_values<float>(device) / 7);
  std::size_t most_slots = 0;
  for (const FitBatches& batches : parts) most_slots = std::max(most_slots, batches.slots);
  const auto points = allocate<float>(device, 7 * most_slots);
  std::vector<Lanes> lanes;
  for (FitBatches& batches : parts) {
    std::vector<cl_int> particle(batches.lanes, -1), neighbour(batches.slots, -1);
    parallel_for(batches.order.size(), kGrain, [&](std::size_t begin, std::size_t end) {
      for (std::size_t l = begin; l < end; ++l) {
        const std::size_t k = static_cast<std::size_t>(batches.order[l]);
        particle[l] = place[k];
        std::size_t slot = batches.first_slot(l);
        for (std::size_t p = near.start[k]; p < near.start[k + 1]; ++p, slot += 8)
          neighbour[slot] = near.index[p];
      }
    });
    DeviceFits fits{points,
                    upload(device, batches.first),
                    upload(device, batches.length),
                    allocate<float>(device, batches.lanes),
                    allocate<float>(device, 10 * batches.lanes),
                    filled<float>(device, 2 * batches.lanes, -1.0f),
                    batches.lanes,
                    batches.slots};
    lanes.push_back({std::move(batches), upload(device, particle), upload(device, neighbour),
                     std::move(fits)});
  }
  return lanes;
}

// Sets the lanes' supports to those of their fits.
void set_supports(Device& device, std::vector<Lanes>& parts, const std::vector<float>& rho) {
  for (Lanes& lanes : parts) {
    std::vector<float> scale(lanes.batches.lanes, 1.0f);
    for (std::size_t l = 0; l < lanes.batches.order.size(); ++l)
      scale[l] = rho[lanes.batches.order[l]];
    lanes.fits.scale = upload(device, scale);
  }
}

// The residual of each fit; negative: no fit.
std::vector<float> residuals(Device& device, const std::vector<Lanes>& parts, std::size_t fits) {
  std::vector<float> residual(fits);
  for (const Lanes& lanes : parts) {
    const std::vector<float> quality = download(device, lanes.fits.quality);
    for (std::size_t l = 0; l < lanes.batches.order.size(); ++l)
      residual[lanes.batches.order[l]] = quality[l];
  }
  return residual;
}

// The normals in records at some places.
std::vector<Vec3d> normals_of(const std::vector<float>& record,
                              const std::vector<std::int32_t>& place) {
  std::vector<Vec3d> normals;
  for (const std::int32_t i : place) {
    const float* const n = record.data() + kRecord * static_cast<std::size_t>(i) + kNormal;
    normals.push_back({n[0], n[1], n[2]});
  }
  return normals;
}

// The fits' supports for the last pass, see fit_particles.
std::vector<float> narrow_supports(Device& device, const std::vector<Vec3d>& position,
                                   const std::vector<Vec3d>& normal,
                                   const std::vector<float>& residual, const FitParams& params) {
  const std::size_t fits = position.size();
  std::vector<float> rho(fits, static_cast<float>(params.support));
  std::vector<float> fitted(fits), sorted;
  for (std::size_t k = 0; k < fits; ++k) {
    fitted[k] = residual[k] > 0 ? 1 : 0;
    if (residual[k] > 0) sorted.push_back(residual[k]);
  }
  if (sorted.empty()) return rho;
  const auto least = sorted.begin() + static_cast<std::ptrdiff_t>(sorted.size() / 20);
  std::nth_element(sorted.begin(), least, sorted.end());
  const double noise = std::max(kOverLeast * *least, kNoise);
  const std::vector<float> mean =  // of one value: the second is not needed
      average_on_sheets(device, position, normal, fitted, {residual, residual}, kSheet)[0];
  for (std::size_t k = 0; k < fits; ++k) {
    if (!(mean[k] > 0)) continue;
    const double share = noise / mean[k];
    rho[k] =
        static_cast<float>(params.support * std::clamp(share * share, params.least_support, 1.0));
  }
  return rho;
}

}  // namespace

std::vector<float> particle_records(const Projected& projected, const SurfaceParticles& around) {
  std::vector<float> record;
  record.reserve(kRecord * around.index.size());
  for (std::size_t k = 0; k < around.index.size(); ++k) {
    const Vec3d at = projected.eye(static_cast<std::size_t>(around.index[k]));
    const Vec3d& normal = around.normal[k];
    for (const double value :
         {at.x, at.y, at.z, around.weight[k], normal.x, normal.y, normal.z, 0.0})
      record.push_back(static_cast<float>(value));
  }
  return record;
}

ParticleFits fit_particles(Device& device, const Projected& projected, const Visible& seen,
                           const SurfaceParticles& around, const FitParams& params) {
  const std::size_t count = seen.index.size();
  ParticleFits fits;
  if (count == 0) return fits;
  const auto records = upload(device, particle_records(projected, around));
  for (const std::int32_t i : seen.index)
    fits.position.push_back(projected.eye(static_cast<std::size_t>(i)));
  const std::vector<std::int32_t> place = places_in(around.index, seen.index);
  const Neighbours near = find_neighbours(projected, seen.index, around.index, params.support);
  std::vector<Lanes> parts = make_lanes(device, near, place);
  std::vector<float> rho(count, static_cast<float>(params.support));
  set_supports(device, parts, rho);
  const float falloff = static_cast<float>(2 / (params.normal_sigma * params.normal_sigma));
  const int width = device.state().vector_width;
  // Few items of much work: small work-groups spread them over the compute units.
  const auto items = [width](const Lanes& lanes) {
    return Range{lanes.fits.lanes / static_cast<std::size_t>(width), 1, 8, 1};
  };
  for (int pass = 0; pass < params.passes; ++pass) {
    if (pass > 0 && pass + 1 == params.passes && params.least_support < 1) {
      rho = narrow_supports(device, fits.position, normals_of(download(device, records), place),
                            residuals(device, parts, count), params);
      set_supports(device, parts, rho);
    }
    for (const Lanes& lanes : parts) {
      const DeviceFits& on_device = lanes.fits;
      launch(device, "particle_fit.cl", "weigh_neighbours", items(lanes), width_option(width),
             records, lanes.particle, lanes.neighbour, on_device.first, on_device.length,
             on_device.scale, on_device.quadric, on_device.quality, on_device.points,
             static_cast<cl_int>(on_device.slots), static_cast<cl_int>(on_device.lanes),
             cl_int{pass},
             cl_float4{{falloff, static_cast<float>(params.tau), kHeight, kHeightGrowth}});
      fit_batches(device, on_device, params);
    }
    for (const Lanes& lanes : parts)  // once all fits have seen the normals before
      launch(device, "particle_fit.cl", "turn_normals", {lanes.fits.lanes}, "", lanes.particle,
             lanes.fits.quadric, lanes.fits.quality, records,
             static_cast<cl_int>(lanes.fits.lanes));
  }
  fits.normal = normals_of(download(device, records), place);
  fits.support.assign(rho.begin(), rho.end());
  fits.residual = residuals(device, parts, count);
  fits.edge.resize(count);
  fits.spread.resize(count);
  fits.supporters.resize(count);
  fits.quadric.resize(count);
  for (const Lanes& part : parts) {
    const std::size_t lanes = part.fits.lanes;
    const auto device_rows = allocate<float>(device, 3 * lanes);
    launch(device, "particle_fit.cl", "measure_edges", items(part), width_option(width), records,
           part.particle, part.neighbour, part.fits.first, part.fits.length, part.fits.scale,
           part.fits.quadric, device_rows, static_cast<cl_int>(lanes), falloff, kEdgeReach);
    const std::vector<float> c = download(device, part.fits.quadric);
    const std::vector<float> rows = download(device, device_rows);
    for (std::size_t l = 0; l < part.batches.order.size(); ++l) {
      const std::size_t k = static_cast<std::size_t>(part.batches.order[l]);
      fits.edge[k] = rows[l];
      fits.spread[k] = rows[lanes + l];
      fits.supporters[k] = rows[2 * lanes + l];
      for (std::size_t r = 0; r < 10; ++r) fits.quadric[k][r] = c[r * lanes + l];
    }
  }
  for (std::size_t k = 0; k < count; ++k) {
    const std::size_t i = static_cast<std::size_t>(place[k]);
    fits.visible.push_back(visibility(seen.owned[k]));
    fits.surface.push_back(around.weight[i]);
    fits.foot.push_back(fits.position[k]);
    if (fits.residual[k] < 0) continue;
    std::array<float, 10>& quadric = fits.quadric[k];
    const double behind = std::clamp(-double{quadric[0]}, -1.0, 1.0);
    fits.foot[k] += fits.normal[k] * (params.offset + behind);
    quadric[0] -= static_cast<float>(params.offset);
  }
  return fits;
}

}  // namespace meniscus
