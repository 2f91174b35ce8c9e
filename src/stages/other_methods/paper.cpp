#include "stages/other_methods/paper.hpp"

#include <algorithm>
#include <climits>
#include <map>

#include "base/exact_math.hpp"
#include "base/rounded_up.hpp"
#include "device/kernels.hpp"
#include "stages/frame/cells.hpp"

namespace meniscus {
namespace {

constexpr std::size_t kNeighbours = 3;  // fewer make a splash particle
constexpr int kQuadricPoints = 8;       // fewer make a plane
constexpr double kSupport = 1.3;        // radius of the fit's weight over the farthest member
constexpr float kLinearRidge = 1e-6f;   // keeps a group of collinear particles solvable

Range samples_of(const SampleGrid& grid) {
  return {static_cast<std::size_t>(grid.nx), static_cast<std::size_t>(grid.ny), 16, 4};
}

// SLIM's weight [7] at the distance d, in units of the support.
double slim_weight(double d) {
  const double rest = std::max(0.0, 1 - d);
  return d <= 0.5 ? exp_negative(-8 * d * d) : 2.16536453 * rest * rest * rest * rest;
}

// Orthonormal axes of which the third is the unit vector n.
struct Axes {
  Vec3d x, y, z;
  explicit Axes(const Vec3d& n) : z(n) {
    x = normalized(cross(n, std::abs(n.x) < 0.7 ? Vec3d{1, 0, 0} : Vec3d{0, 1, 0}));
    y = cross(n, x);
  }
};

// f(X) = z - R h(x / R, y / R) with x, y, z the coordinates of X along the axes.
std::array<float, 10> quadric_of(const Axes& axes, double R, const std::array<float, 6>& h) {
  const Vec3d &a = axes.x, &b = axes.y;
  const Vec3d linear = axes.z - a * h[1] - b * h[2];
  const double xx = -h[3] / R, xy = -h[4] / R, yy = -h[5] / R;
  const auto square = [&](double ai, double bi) {
    return xx * ai * ai + xy * ai * bi + yy * bi * bi;
  };
  const auto mixed = [&](double ai, double bi, double aj, double bj) {
    return 2 * xx * ai * aj + xy * (ai * bj + aj * bi) + 2 * yy * bi * bj;
  };
  const double c[10] = {-R * h[0],
                        linear.x,
                        linear.y,
                        linear.z,
                        square(a.x, b.x),
                        square(a.y, b.y),
                        square(a.z, b.z),
                        mixed(a.x, b.x, a.y, b.y),
                        mixed(a.y, b.y, a.z, b.z),
                        mixed(a.z, b.z, a.x, b.x)};
  std::array<float, 10> quadric;
  for (std::size_t k = 0; k < 10; ++k) quadric[k] = static_cast<float>(c[k]);
  return quadric;
}

}  // namespace

SplashSplit split_by_neighbours(const Projected& projected, const SplashParams& params) {
  SplashSplit split;
  const float link = static_cast<float>(params.link);
  const Cells cells = make_cells(projected.x, projected.y, projected.z, std::max(link, 0.1f));
  for (std::size_t i = 0; i < projected.size(); ++i) {
    std::size_t neighbours = 0;
    visit_near(cells, projected.x[i], projected.y[i], projected.z[i], [&](std::int32_t p) {
      const float dx = cells.x[p] - projected.x[i], dy = cells.y[p] - projected.y[i],
                  dz = cells.z[p] - projected.z[i];
      if (cells.item[p] != static_cast<std::int32_t>(i) &&
          dx * dx + dy * dy + dz * dz < link * link)
        ++neighbours;
      return neighbours < kNeighbours;
    });
    (neighbours < kNeighbours ? split.splash : split.body).push_back(static_cast<std::int32_t>(i));
  }
  return split;
}

Triangulation add_ghost_particles(const View& view, const Triangulation& mesh, double d_max) {
  Triangulation patched = mesh;
  std::map<std::pair<std::int32_t, double>, std::int32_t> ghosts;  // by vertex and depth
  for (std::size_t t = 0; t < mesh.triangle.size(); ++t) {
    if (mesh.kind[t] != TriangleKind::ghost) continue;
    std::array<std::int32_t, 3>& corner = patched.triangle[t];
    double farthest = 0;
    for (const std::int32_t v : corner) farthest = std::max(farthest, -mesh.position[v].z);
    for (std::int32_t& v : corner) {
      if (farthest + mesh.position[v].z <= d_max / 2) continue;
      const auto [ghost, is_new] =
          ghosts.try_emplace({v, farthest}, static_cast<std::int32_t>(patched.position.size()));
      if (is_new) {
        const ScreenPoint at = mesh.screen[v];
        patched.particle.push_back(mesh.particle[v]);
        patched.position.push_back(point_at(view, at.u, at.v, farthest));
        patched.screen.push_back(at);
        patched.owned.push_back(0);
        patched.fan_start.push_back(patched.fan_start.back());
      }
      v = ghost->second;
    }
    const Vec3d &a = patched.position[corner[0]], &b = patched.position[corner[1]],
                &c = patched.position[corner[2]];
    const Vec3d twice = cross(b - a, c - a);
    const PixelPosition middle = project(view, (a + b + c) / 3);
    const Vec3d towards = -ray_direction(view, middle.u, middle.v);
    const Vec3d normal = normalized(twice, normalized(towards));
    patched.normal[t] = dot(normal, towards) < 0 ? -normal : normal;
    patched.area[t] = length(twice) / 2;
    patched.kind[t] = TriangleKind::kept;
  }
  return patched;
}

std::vector<std::int32_t> particles_without_group(const Triangulation& mesh,
                                                  std::size_t visible_count) {
  std::vector<char> grouped(mesh.position.size(), 0);
  for (const auto& corner : mesh.triangle)
    for (const std::int32_t v : corner) grouped[v] = 1;
  std::vector<std::int32_t> alone;
  for (std::size_t v = 0; v < visible_count; ++v)
    if (!grouped[v]) alone.push_back(mesh.particle[v]);
  return alone;
}

Quadrics fit_heights(Device& device, const Triangulation& mesh, const Groups& groups,
                     const FitParams& params, double offset) {
  const std::size_t n = groups.size(), slots = groups.point.size();
  Quadrics quadrics{std::vector<std::array<float, 10>>(n), std::vector<float>(n, -1.0f)};
  if (n == 0) return quadrics;
  require(slots < (std::size_t{1} << 28), "fit: too many points for 32-bit indices");
  std::vector<float> points(4 * slots);
  std::vector<double> scale(n);
  for (std::size_t g = 0; g < n; ++g) {
    const Axes axes(groups.normal[g]);
    scale[g] = kSupport * groups.radius[g];
    for (std::int32_t k = groups.start[g]; k < groups.start[g + 1]; ++k) {
      const Vec3d q = (mesh.position[groups.point[k]] - groups.centre[g]) / scale[g];
      const double row[4] = {dot(axes.x, q), dot(axes.y, q), dot(axes.z, q),
                             slim_weight(length(q))};
      for (std::size_t r = 0; r < 4; ++r) points[r * slots + k] = static_cast<float>(row[r]);
    }
  }
  const auto height = allocate<float>(device, 7 * n);
  launch(device, kernels::fit_heights, 1, {n}, upload(device, points), upload(device, groups.start),
         height, static_cast<cl_int>(slots), static_cast<cl_int>(n), cl_int{kQuadricPoints},
         cl_float2{{kLinearRidge, static_cast<float>(params.ridge)}});
  const std::vector<float> h = download(device, height);
  for (std::size_t g = 0; g < n; ++g) {
    std::array<float, 6> a;
    for (std::size_t k = 0; k < 6; ++k) a[k] = h[k * n + g];
    std::array<float, 10>& c = quadrics.coefficient[g];
    c = quadric_of(Axes(groups.normal[g]), scale[g], a);
    if (offset != 0)  // the level f = offset |grad f(centre)|
      c[0] -= static_cast<float>(offset * length(Vec3d{c[1], c[2], c[3]}));
    quadrics.residual[g] = static_cast<float>(h[6 * n + g] * scale[g]);
  }
  return quadrics;
}

GroupRecords printed_records(const View& view, const Groups& groups, const Quadrics& quadrics,
                             const BlendParams& params) {
  GroupRecords records;
  records.centre = groups.centre;
  for (std::size_t g = 0; g < groups.size(); ++g) {
    const Vec3d &c = groups.centre[g], &n = groups.normal[g];
    const PixelPosition at = project(view, c);
    records.billboard.push_back(groups.radius[g] + params.reach);
    for (const double value : {c.x, c.y, c.z, n.x, n.y, n.z})
      records.values.push_back(static_cast<float>(value));
    for (const float k : quadrics.coefficient[g]) records.values.push_back(k);
    for (const double value : {at.u, at.v, groups.radius[g], records.billboard[g]})
      records.values.push_back(static_cast<float>(value));
  }
  return records;
}

TileLists list_groups(const View& view, const GroupRecords& records, const SampleGrid& grid) {
  std::vector<ScreenBox> boxes;
  for (std::size_t g = 0; g < records.centre.size(); ++g) {
    const double r = records.billboard[g];
    boxes.push_back(box_of(view, records.centre[g], {r, r, r}, grid));
  }
  return list_boxes(boxes, std::vector<char>(boxes.size(), 1), grid);
}

PaperRegion draw_region(Device& device, const View& view, const Triangulation& mesh,
                        const Groups& groups, const SampleGrid& grid) {
  const std::size_t n = mesh.triangle.size(), stride = rounded_up(n, 64);
  std::vector<float> corners(9 * stride, 0.0f);
  for (std::size_t t = 0; t < n; ++t)
    for (std::size_t c = 0; c < 3; ++c) {
      const std::size_t v = static_cast<std::size_t>(mesh.triangle[t][c]);
      corners[3 * c * stride + t] = static_cast<float>(mesh.screen[v].u);
      corners[(3 * c + 1) * stride + t] = static_cast<float>(mesh.screen[v].v);
      corners[(3 * c + 2) * stride + t] = static_cast<float>(-mesh.position[v].z);
    }
  const auto device_corners = upload(device, corners);
  const cl_int2 samples{{grid.nx, grid.ny}};
  const auto owner = filled<cl_int>(device, grid.size(), INT_MAX);
  launch(device, kernels::own_samples, 1, {n}, device_corners, owner, static_cast<cl_int>(n),
         static_cast<cl_int>(stride), samples, grid.first, grid.step);
  PaperRegion region{grid, allocate<cl_int>(device, grid.size()),
                     allocate<float>(device, grid.size())};
  launch(device, kernels::draw_region, 1, samples_of(grid), device_corners,
         upload(device, groups.group_of_triangle), owner, region, static_cast<cl_int>(stride),
         lattice_of(grid), static_cast<cl_int>(!view.orthographic));
  return region;
}

PaperRegion smooth_contour(Device& device, const PaperRegion& region, const Groups& groups,
                           const RegionParams& params, double cell) {
  const SampleGrid& grid = region.grid;
  const double sigma = params.sigma_s * cell / grid.step;  // samples
  const int reach = static_cast<int>(std::ceil(3 * sigma));
  std::vector<float> distance_weight;  // Eq. 4 without its factor, which cancels in Eq. 3
  for (int squared = 0; squared <= 2 * reach * reach; ++squared)
    distance_weight.push_back(static_cast<float>(exp_negative(-squared / (2 * sigma * sigma))));
  const std::size_t n = groups.size();
  std::vector<float> normal(3 * n);
  for (std::size_t g = 0; g < n; ++g) {
    normal[g] = static_cast<float>(groups.normal[g].x);
    normal[n + g] = static_cast<float>(groups.normal[g].y);
    normal[2 * n + g] = static_cast<float>(groups.normal[g].z);
  }
  PaperRegion smoothed{grid, allocate<cl_int>(device, grid.size()),
                       allocate<float>(device, grid.size())};
  launch(device, kernels::smooth_contour, 1, samples_of(grid), region, upload(device, normal),
         upload(device, distance_weight), smoothed, static_cast<cl_int>(n),
         cl_int2{{grid.nx, grid.ny}}, cl_int{reach},
         static_cast<cl_float>(1 / (2 * params.sigma_n * params.sigma_n)));
  return smoothed;
}

SurfaceBuffers blend_printed(Device& device, const View& view, const PaperRegion& region,
                             const GroupRecords& records, const BlendParams& params,
                             const PaperParams& paper) {
  const SampleGrid& grid = region.grid;
  const SurfaceBuffers surface = empty_surface(device, grid);
  fill(device, surface.normal, 0.0f);  // still unknown
  const TileLists tiles = list_groups(view, records, grid);
  meniscus::records::PrintedBlend how{static_cast<float>(view.u_scale),
                                      static_cast<float>(view.v_scale),
                                      {},
                                      static_cast<float>(params.d_max),
                                      static_cast<float>(paper.b_least),
                                      static_cast<float>(paper.b_gain)};
  for (std::size_t k = 0; k < 4; ++k) how.w_row[k] = static_cast<float>(view.w_row[k]);
  launch(device, kernels::blend_printed, 1,
         {static_cast<std::size_t>(grid.nx), static_cast<std::size_t>(grid.ny), kTile, kTile},
         region, upload(device, records.values), upload(device, tiles.start),
         upload(device, tiles.box), surface.depth, surface.group, screen_of(view, grid), how);
  return surface;
}

void draw_spheres(Device& device, const View& view, const Projected& projected,
                  const std::vector<std::int32_t>& splash, const SurfaceBuffers& surface) {
  if (splash.empty()) return;
  const SampleGrid& grid = surface.grid;
  const SplatParticles splats = upload_splats(device, projected, splash);
  const Buffer<float> depth = splat_depth(device, splats, grid, 1);
  const Buffer<cl_int> owner = splat_owner(device, splats, grid, 1);
  const std::size_t stride = static_cast<std::size_t>(splats.stride);
  std::vector<float> eye(3 * stride, 0.0f);
  for (std::size_t k = 0; k < splash.size(); ++k) {
    const std::size_t i = static_cast<std::size_t>(splash[k]);
    eye[k] = projected.x[i];
    eye[stride + k] = projected.y[i];
    eye[2 * stride + k] = projected.z[i];
  }
  launch(device, kernels::draw_spheres, 1, samples_of(grid), depth, owner, upload(device, eye),
         surface, splats.stride, screen_of(view, grid));
}

}  // namespace meniscus
