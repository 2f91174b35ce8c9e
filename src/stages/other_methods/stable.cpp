#include "stages/other_methods/stable.hpp"

#include <algorithm>
#include <climits>
#include <cmath>

#include "base/rounded_up.hpp"
#include "device/kernels.hpp"

namespace meniscus {
namespace {

Range samples_of(const SampleGrid& grid) {
  return {static_cast<std::size_t>(grid.nx), static_cast<std::size_t>(grid.ny), 16, 4};
}

cl_int2 size_of(const SampleGrid& grid) { return {{grid.nx, grid.ny}}; }

std::size_t padded(std::size_t n) { return rounded_up(n, 64); }

// A corner as kernel own_triangles takes it.
struct Corner {
  ScreenPoint screen;
  double depth;
  std::int32_t particle;  // place in the fits
};

// The triangles that keep the region closed. A ghost lies at the depth of its farthest corner, to
// which it belongs, and only where a sheet is near that.
std::vector<std::array<Corner, 3>> region_triangles(const Triangulation& mesh,
                                                    const std::vector<std::int32_t>& vertex,
                                                    double d_max) {
  std::vector<std::array<Corner, 3>> triangles;
  for (std::size_t t = 0; t < mesh.triangle.size(); ++t) {
    std::array<Corner, 3> corners;
    for (std::size_t c = 0; c < 3; ++c) {
      const std::int32_t v = mesh.triangle[t][c];
      corners[c] = {mesh.screen[v], -mesh.position[v].z, vertex[v]};
    }
    if (mesh.kind[t] == TriangleKind::kept) triangles.push_back(corners);
    if (mesh.kind[t] != TriangleKind::ghost) continue;
    const Corner farthest =
        *std::max_element(corners.begin(), corners.end(),
                          [](const Corner& a, const Corner& b) { return a.depth < b.depth; });
    bool supported = false;
    for (std::size_t c = 0; c < 3; ++c) {
      const std::int32_t v = mesh.triangle[t][c];
      const bool far = farthest.depth - corners[c].depth <= 0.5 * d_max;
      supported |= far && mesh.fan_start[v + 1] - mesh.fan_start[v] >= 3;
      if (far) continue;
      corners[c].depth = farthest.depth;
      corners[c].particle = farthest.particle;
    }
    if (supported) triangles.push_back(corners);
  }
  return triangles;
}

// Edges of kept triangles that no second kept triangle shares, and vertices without any as edges
// of no length.
std::vector<std::array<std::int32_t, 2>> contour_edges(const Triangulation& mesh) {
  std::vector<std::array<std::int32_t, 2>> sides, contour;
  for (std::size_t t = 0; t < mesh.triangle.size(); ++t) {
    if (mesh.kind[t] != TriangleKind::kept) continue;
    for (std::size_t c = 0; c < 3; ++c) {
      const std::int32_t a = mesh.triangle[t][c], b = mesh.triangle[t][(c + 1) % 3];
      sides.push_back({std::min(a, b), std::max(a, b)});
    }
  }
  std::sort(sides.begin(), sides.end());
  for (std::size_t s = 0; s < sides.size(); ++s) {
    const bool shared =
        (s > 0 && sides[s - 1] == sides[s]) || (s + 1 < sides.size() && sides[s + 1] == sides[s]);
    if (!shared) contour.push_back(sides[s]);
  }
  for (std::size_t v = 0; v < mesh.position.size(); ++v)
    if (mesh.fan_start[v] == mesh.fan_start[v + 1])
      contour.push_back({static_cast<std::int32_t>(v), static_cast<std::int32_t>(v)});
  return contour;
}

// Pixels along u that a particle radius spans at a vertex.
double pixels_at(const View& view, const Vec3d& position) {
  return view.u_scale / project(view, position).w;
}

struct OwnerMap {
  Buffer<float> depth;
  Buffer<cl_int> owner;
};

OwnerMap empty_map(Device& device, const SampleGrid& grid) {
  return {filled<float>(device, grid.size(), kNoSurface),
          filled<cl_int>(device, grid.size(), INT_MAX)};
}

OwnerMap own_triangles(Device& device, const View& view, const Triangulation& mesh,
                       const std::vector<std::int32_t>& vertex, const ParticleFits& fits,
                       const SampleGrid& grid, double d_max) {
  const auto triangles = region_triangles(mesh, vertex, d_max);
  const std::size_t n = triangles.size(), stride = padded(n);
  std::vector<float> corners(12 * stride, 0.0f);
  std::vector<cl_int> particle(3 * stride, 0);
  for (std::size_t k = 0; k < n; ++k)
    for (std::size_t c = 0; c < 3; ++c) {
      const Corner& corner = triangles[k][c];
      const double row[4] = {corner.screen.u, corner.screen.v, corner.depth,
                             fits.edge[corner.particle]};
      for (std::size_t r = 0; r < 4; ++r)
        corners[(4 * c + r) * stride + k] = static_cast<float>(row[r]);
      particle[c * stride + k] = corner.particle;
    }
  const OwnerMap map = empty_map(device, grid);
  const auto device_corners = upload(device, corners);
  const auto device_particle = upload(device, particle);
  for (const cl_int owner_pass : {0, 1})
    launch(device, kernels::own_triangles, 1, {n}, device_corners, device_particle, map,
           static_cast<cl_int>(n), static_cast<cl_int>(stride), lattice_of(grid),
           static_cast<cl_int>(!view.orthographic), owner_pass);
  return map;
}

OwnerMap own_capsules(Device& device, const View& view, const Triangulation& mesh,
                      const std::vector<std::int32_t>& vertex, const Buffer<float>& records,
                      const Buffer<float>& triangle_depth, const SampleGrid& grid, double radius,
                      double apart) {
  const auto edges = contour_edges(mesh);
  const std::size_t n = edges.size(), stride = padded(n);
  std::vector<float> ends(8 * stride, 0.0f);
  std::vector<cl_int> particle(2 * stride, 0);
  for (std::size_t k = 0; k < n; ++k)
    for (std::size_t end = 0; end < 2; ++end) {
      const std::size_t v = static_cast<std::size_t>(edges[k][end]);
      const double row[4] = {mesh.screen[v].u, mesh.screen[v].v, -mesh.position[v].z,
                             pixels_at(view, mesh.position[v])};
      for (std::size_t r = 0; r < 4; ++r)
        ends[(4 * end + r) * stride + k] = static_cast<float>(row[r]);
      particle[end * stride + k] = vertex[v];
    }
  const OwnerMap map = empty_map(device, grid);
  const auto device_ends = upload(device, ends);
  const auto device_particle = upload(device, particle);
  const meniscus::records::Capsules capsules{static_cast<int>(n), static_cast<int>(stride),
                                             static_cast<float>(view.u_scale / view.v_scale),
                                             static_cast<float>(radius), static_cast<float>(apart)};
  for (const cl_int owner_pass : {0, 1})
    launch(device, kernels::own_capsules, 1, {n, 1, 8, 1}, device_ends, device_particle, records,
           triangle_depth, map, capsules, screen_of(view, grid), owner_pass);
  return map;
}

// The nearest sample whose `map` is negative (sign 1) or not (sign 0) within `radius` samples.
Buffer<cl_int> nearest_sample(Device& device, const Buffer<cl_int>& map, const SampleGrid& grid,
                              double radius, cl_int sign) {
  const auto column = allocate<cl_int>(device, grid.size());
  const auto nearest = allocate<cl_int>(device, grid.size());
  const cl_int reach = static_cast<cl_int>(std::floor(radius));
  launch(device, kernels::find_in_rows, 1, samples_of(grid), map, column, size_of(grid), reach,
         sign);
  launch(device, kernels::find_in_columns, 1, samples_of(grid), column, nearest, size_of(grid),
         reach, static_cast<cl_float>(radius * radius));
  return nearest;
}

}  // namespace

GroupRecords stable_records(const ParticleFits& fits, const FitParams& fit, double radius) {
  constexpr std::size_t kRecord = records::PARTICLE_RECORD;
  GroupRecords records;
  records.values.assign(fits.size() * kRecord, 0.0f);
  records.billboard.assign(fits.size(), 0.0);
  records.centre = fits.foot;
  for (std::size_t k = 0; k < fits.size(); ++k) {
    float* record = &records.values[k * kRecord];
    const Vec3d &p = fits.position[k], &n = fits.normal[k], &foot = fits.foot[k];
    const double head[6] = {p.x, p.y, p.z, n.x, n.y, n.z};
    for (int c = 0; c < 6; ++c) record[c] = static_cast<float>(head[c]);
    if (fits.residual[k] < 0) continue;
    const double reach = reach_of(fits, k, fit, radius);
    records.billboard[k] = reach;
    for (std::size_t c = 0; c < 10; ++c) record[6 + c] = fits.quadric[k][c];
    record[16] = static_cast<float>(1 / (reach * reach));
    const double seen = fits.visible[k] < kSeen ? 0 : fits.visible[k];
    record[18] = static_cast<float>(fits.edge[k] * seen);
    record[19] = static_cast<float>(foot.x);
    record[20] = static_cast<float>(foot.y);
    record[21] = static_cast<float>(foot.z);
  }
  return records;
}

StableRegion draw_stable_region(Device& device, const View& view, const Triangulation& mesh,
                                const Visible& fitted, const ParticleFits& fits,
                                const Buffer<float>& records, const SampleGrid& grid,
                                const Parameters& params) {
  const std::vector<std::int32_t> vertex = places_in(fitted.index, mesh.particle);
  const double d_max = params.triangle.d_max, offset = params.fit.offset;
  const OwnerMap triangles = own_triangles(device, view, mesh, vertex, fits, grid, d_max);
  const OwnerMap capsules = own_capsules(device, view, mesh, vertex, records, triangles.depth, grid,
                                         params.stable.capsule, 0.5 * d_max);
  StableRegion region{grid, triangles.depth, allocate<float>(device, grid.size()), triangles.owner};
  const cl_int n = static_cast<cl_int>(grid.size());
  launch(device, kernels::join_region, 1, {grid.size()}, region.reference, region.owner,
         region.front, capsules.depth, capsules.owner, n, static_cast<cl_float>(0.5 * d_max),
         static_cast<cl_float>(offset));
  if (mesh.position.empty()) return region;

  double pixels = 0;
  for (const Vec3d& position : mesh.position) pixels += pixels_at(view, position);
  const double radius =
      params.stable.closing * pixels / static_cast<double>(mesh.position.size()) / grid.step;
  const Buffer<cl_int> covered = nearest_sample(device, region.owner, grid, radius, 0);
  const Buffer<cl_int> far = nearest_sample(device, covered, grid, radius, 1);
  launch(device, kernels::fill_gaps, 1, {grid.size()}, region.reference, region.owner, region.front,
         covered, far, n, static_cast<cl_float>(offset));
  return region;
}

SurfaceBuffers blend_particles(Device& device, const View& view, const StableRegion& region,
                               const Buffer<float>& records, const TileLists& tiles,
                               const BlendParams& params) {
  const SampleGrid& grid = region.grid;
  const SurfaceBuffers surface = empty_surface(device, grid);
  const std::size_t width = static_cast<std::size_t>(device.state().vector_width);
  const Range range{static_cast<std::size_t>(tiles.nx) * kTile / width,
                    static_cast<std::size_t>(tiles.ny) * kTile, kTile / width, kTile};
  launch(device, kernels::blend_particles, static_cast<int>(width), range, region, records,
         upload(device, tiles.start), upload(device, tiles.group), surface, screen_of(view, grid),
         blending_of(params));
  return surface;
}

}  // namespace meniscus
