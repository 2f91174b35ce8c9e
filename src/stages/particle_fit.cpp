#include "stages/particle_fit.hpp"

#include <algorithm>
#include <cmath>

#include "stages/cells.hpp"
#include "stages/fit.hpp"

namespace meniscus {
namespace {

constexpr float kEdgeReach = 4;            // particle radii
constexpr float kHeight = 0.6f;            // h_0 of weigh_neighbours, particle radii
constexpr float kHeightGrowth = 0.075f;    // h_1, 1 / particle radii
constexpr double kLeastVisibility = 1e-4;  // v of a particle that is barely seen

Cells cells_of(const Projected& projected, const Visible& seen, double side) {
  std::vector<float> x, y, z;
  for (const std::int32_t i : seen.index) {
    x.push_back(projected.x[i]);
    y.push_back(projected.y[i]);
    z.push_back(projected.z[i]);
  }
  return make_cells(x, y, z, static_cast<float>(side));
}

// The particles within `reach` of each, by position in `seen` (CSR).
struct Neighbours {
  std::vector<std::size_t> start{0};
  std::vector<std::int32_t> index;
};

Neighbours find_neighbours(const Projected& projected, const Visible& seen, double reach) {
  const Cells cells = cells_of(projected, seen, reach);
  const float squared = static_cast<float>(reach * reach);
  Neighbours near;
  for (const std::int32_t i : seen.index) {
    const float x = projected.x[i], y = projected.y[i], z = projected.z[i];
    visit_near(cells, x, y, z, [&](std::int32_t p) {
      const float dx = cells.x[p] - x, dy = cells.y[p] - y, dz = cells.z[p] - z;
      if (dx * dx + dy * dy + dz * dz < squared) near.index.push_back(cells.item[p]);
      return true;
    });
    near.start.push_back(near.index.size());
  }
  return near;
}

}  // namespace

Visible more_visible(const Visible& visible, double least_owned) {
  Visible more;
  for (std::size_t k = 0; k < visible.index.size(); ++k) {
    if (visible.owned[k] < least_owned) continue;
    more.index.push_back(visible.index[k]);
    more.owned.push_back(visible.owned[k]);
  }
  return more;
}

std::vector<std::int32_t> places_in(const Visible& visible,
                                    const std::vector<std::int32_t>& particles) {
  std::vector<std::int32_t> places;
  for (const std::int32_t i : particles)
    places.push_back(static_cast<std::int32_t>(
        std::lower_bound(visible.index.begin(), visible.index.end(), i) - visible.index.begin()));
  return places;
}

std::vector<Vec3d> first_normals(const View& view, const Projected& projected, const Visible& seen,
                                 const Triangulation& mesh, const std::vector<Vec3d>& normals) {
  const std::size_t n = seen.index.size();
  std::vector<Vec3d> sum(n);
  const std::vector<std::int32_t> place = places_in(seen, mesh.particle);
  for (std::size_t t = 0; t < mesh.triangle.size(); ++t)
    if (mesh.kind[t] == TriangleKind::kept)
      for (const std::int32_t v : mesh.triangle[t]) sum[place[v]] += normals[t] * mesh.area[t];

  constexpr double kReach = 4;
  const Cells cells = cells_of(projected, seen, kReach);
  std::vector<Vec3d> result(n);
  for (std::size_t k = 0; k < n; ++k) {
    result[k] = normalized(sum[k], {0, 0, 0});
    if (length(result[k]) > 0) continue;
    const std::size_t i = static_cast<std::size_t>(seen.index[k]);
    Vec3d near;
    visit_near(cells, projected.x[i], projected.y[i], projected.z[i], [&](std::int32_t p) {
      const Vec3d at{cells.x[p], cells.y[p], cells.z[p]};
      const double share = 1 - length(at - projected.eye(i)) / kReach;
      if (share > 0) near += normalized(sum[cells.item[p]], {0, 0, 0}) * share;
      return true;
    });
    result[k] = normalized(near, normalized(-ray_direction(view, projected.u[i], projected.v[i])));
  }
  return result;
}

ParticleFits fit_particles(Device& device, const Projected& projected, const Visible& seen,
                           const std::vector<Vec3d>& normals, const FitParams& fit,
                           const StableParams& params) {
  const std::size_t n = seen.index.size();
  ParticleFits fits;
  if (n == 0) return fits;
  std::vector<float> particles(4 * n), normal(3 * n);
  for (std::size_t k = 0; k < n; ++k) {
    const std::size_t i = static_cast<std::size_t>(seen.index[k]);
    const double share =
        std::clamp((seen.owned[k] - kLeastFitted) / (kFullyVisible - kLeastFitted), 0.0, 1.0);
    fits.position.push_back(projected.eye(i));
    fits.visible.push_back(std::max(kLeastVisibility, share * share * (3 - 2 * share)));
    particles[k] = projected.x[i];
    particles[n + k] = projected.y[i];
    particles[2 * n + k] = projected.z[i];
    particles[3 * n + k] = static_cast<float>(fits.visible[k]);
    normal[k] = static_cast<float>(normals[k].x);
    normal[n + k] = static_cast<float>(normals[k].y);
    normal[2 * n + k] = static_cast<float>(normals[k].z);
  }

  const Neighbours near = find_neighbours(projected, seen, params.support);
  std::vector<std::size_t> sizes;
  for (std::size_t k = 0; k < n; ++k) sizes.push_back(near.start[k + 1] - near.start[k]);
  const FitBatches batches = make_batches(sizes);
  const std::size_t lanes = batches.lanes, slots = batches.slots;
  std::vector<cl_int> neighbour(slots, -1), particle(lanes, -1);
  for (std::size_t l = 0; l < n; ++l) {
    const std::size_t k = static_cast<std::size_t>(batches.order[l]);
    particle[l] = batches.order[l];
    std::size_t slot = batches.first_slot(l);
    for (std::size_t p = near.start[k]; p < near.start[k + 1]; ++p, slot += 8)
      neighbour[slot] = near.index[p];
  }

  const DeviceFits device_fits{filled<float>(device, 7 * slots, 0.0f),
                               upload(device, batches.first),
                               upload(device, batches.length),
                               filled<float>(device, lanes, static_cast<float>(params.support)),
                               filled<float>(device, lanes, 0.0f),
                               allocate<float>(device, 10 * lanes),
                               filled<float>(device, 2 * lanes, -1.0f),
                               lanes,
                               slots};
  FitParams one_pass = fit;
  one_pass.robust_passes = 0;
  one_pass.offset = 0;
  const auto device_particles = upload(device, particles);
  const auto device_normal = upload(device, normal);
  const auto device_particle = upload(device, particle);
  const auto device_neighbour = upload(device, neighbour);
  const cl_int count = static_cast<cl_int>(n);
  const cl_int lane_count = static_cast<cl_int>(lanes);
  const cl_float4 options{{static_cast<float>(params.support),
                           static_cast<float>(2 / (params.normal_sigma * params.normal_sigma)),
                           static_cast<float>(fit.tau), 0.0f}};
  for (int pass = 0; pass < params.passes; ++pass) {
    launch(device, "particle_fit.cl", "weigh_neighbours", {lanes, 1, 8, 1}, "", device_particles,
           device_normal, device_particle, device_neighbour, device_fits.first, device_fits.length,
           device_fits.quadric, device_fits.quality, device_fits.points, count,
           static_cast<cl_int>(slots), lane_count, cl_int{pass}, options,
           cl_float2{{kHeight, kHeightGrowth}});
    fit_batches(device, device_fits, one_pass);
    launch(device, "particle_fit.cl", "turn_normals", {lanes}, "", device_particle,
           device_fits.quadric, device_fits.quality, device_normal, count, lane_count);
  }
  const auto edge = allocate<float>(device, n);
  launch(device, "particle_fit.cl", "measure_edges", {lanes, 1, 8, 1}, "", device_particles,
         device_normal, device_particle, device_neighbour, device_fits.first, device_fits.length,
         edge, count, lane_count, kEdgeReach);

  const std::vector<float> c = download(device, device_fits.quadric);
  const std::vector<float> quality = download(device, device_fits.quality);
  const std::vector<float> e = download(device, edge);
  normal = download(device, device_normal);
  fits.edge.assign(e.begin(), e.end());
  fits.quadric.resize(n);
  fits.residual.resize(n);
  for (std::size_t k = 0; k < n; ++k)
    fits.normal.push_back({normal[k], normal[n + k], normal[2 * n + k]});
  fits.foot = fits.position;
  for (std::size_t l = 0; l < n; ++l) {
    const std::size_t k = static_cast<std::size_t>(batches.order[l]);
    for (std::size_t r = 0; r < 10; ++r) fits.quadric[k][r] = c[r * lanes + l];
    fits.residual[k] = quality[l];
    if (quality[l] < 0) continue;
    const double behind = std::clamp(-double{fits.quadric[k][0]}, -1.0, 1.0);
    fits.foot[k] += fits.normal[k] * (fit.offset + behind);
    fits.quadric[k][0] -= static_cast<float>(fit.offset);
  }
  return fits;
}

}  // namespace meniscus
