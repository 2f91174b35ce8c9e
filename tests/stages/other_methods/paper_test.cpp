// The stages of the method paper against loops in double precision, on every device.
#include "stages/other_methods/paper.hpp"

#include <Eigen/Dense>
#include <algorithm>
#include <set>

#include "stages/orthographic_view.hpp"
#include "stages/stage_test_support.hpp"
#include "verify/reference/paper.hpp"
#include "verify/stage_cases/fits_by_hand.hpp"
#include "verify/stage_cases/mesh_by_hand.hpp"

namespace meniscus {
namespace {

using Paper = OnDevice;

struct FilteredContour {
  bool inside;
  double doubt;  // distance of the filter's value from 1/2
};

// Eqs. 3 to 5 on the region at sample (i, j); the window ends at three sigma_s (samples).
FilteredContour filter_contour(const std::vector<int>& group, int nx, int ny, int i, int j,
                               const std::vector<Vec3d>& normal, double sigma_s, double sigma_n) {
  const int reach = static_cast<int>(std::ceil(3 * sigma_s));
  const int here = group[static_cast<std::size_t>(j) * nx + i];
  double sum = 0, weight = 0;
  for (int n = -reach; n <= reach; ++n)
    for (int m = -reach; m <= reach; ++m) {
      const int x = i + m, y = j + n;
      if (x < 0 || y < 0 || x >= nx || y >= ny) continue;
      const int there = group[static_cast<std::size_t>(y) * nx + x];
      double w = std::exp(-(m * m + n * n) / (2 * sigma_s * sigma_s));
      if (here >= 0 && there >= 0) {
        const Vec3d d = normal[here] - normal[there];
        w *= std::exp(-dot(d, d) / (2 * sigma_n * sigma_n));
      }
      weight += w;
      if (there >= 0) sum += w;
    }
  return {sum > weight / 2, std::abs(sum / weight - 0.5)};
}

TEST(GhostParticles, ReplaceTheNearCornersOfADeletedTriangle) {
  const View view = plain_view();
  // Two triangles at depth 20, a jump to 30 at u = 14, two triangles there.
  const Triangulation mesh = triangulated(place({{10, 10, 20},
                                                 {10, 12.1, 20},
                                                 {12, 10, 20},
                                                 {12, 12.1, 20},
                                                 {14, 10, 30},
                                                 {14, 12.1, 30},
                                                 {16, 10, 30},
                                                 {16, 12.1, 30}}));
  ASSERT_EQ(std::count(mesh.kind.begin(), mesh.kind.end(), TriangleKind::ghost), 2);
  const Triangulation patched = add_ghost_particles(view, mesh, 6);
  EXPECT_EQ(patched.triangle.size(), mesh.triangle.size());
  EXPECT_EQ(std::count(patched.kind.begin(), patched.kind.end(), TriangleKind::kept), 6);
  ASSERT_EQ(patched.position.size(), 10u) << "a ghost is shared by the triangles around it";
  for (std::size_t v = 8; v < 10; ++v) {
    const std::size_t of = static_cast<std::size_t>(patched.particle[v]);
    EXPECT_DOUBLE_EQ(patched.screen[v].u, mesh.screen[of].u);
    EXPECT_DOUBLE_EQ(patched.screen[v].u, 12);
    EXPECT_DOUBLE_EQ(patched.position[v].z, -30);
    EXPECT_NEAR(patched.position[v].x, mesh.position[of].x, 1e-6);  // the particle's is a float
  }
  for (std::size_t t = 0; t < mesh.triangle.size(); ++t)
    if (mesh.kind[t] == TriangleKind::ghost) {
      EXPECT_NEAR(length(patched.normal[t] - Vec3d{0, 0, 1}), 0, 1e-12);
    } else {
      EXPECT_EQ(patched.triangle[t], mesh.triangle[t]);
    }
  // The deep plane and its ghosts merge; the near plane stays apart.
  EXPECT_EQ(merge_groups(patched, patched.normal, {}).size(), 2u);
  EXPECT_TRUE(particles_without_group(patched, 8).empty());
}

TEST(GhostParticles, AParticleOfWhichNoTriangleIsLeftHasNoGroup) {
  const Triangulation mesh = triangulated(place(
      {{10, 10, 40}, {14, 10, 40}, {10, 14, 40}, {14, 14.1, 40}, {12, 12, 20}, {40, 40, 30}}));
  const Triangulation patched = add_ghost_particles(plain_view(), mesh, 6);
  EXPECT_EQ(particles_without_group(patched, 6), (std::vector<std::int32_t>{4, 5}));
}

TEST(ListGroups, NamesEveryGroupWhoseBillboardReachesASample) {
  const View view = frontal_view(70, 50);
  Random random(5);
  GroupRecords records;
  for (int k = 0; k < 60; ++k) {
    records.centre.push_back({random(-30, 30), random(-20, 20), random(-40, -12)});
    records.billboard.push_back(random(2, 6));
  }
  for (const SampleGrid& grid : {SampleGrid{70, 50, 0.5f, 1}, SampleGrid{36, 26, 0, 2}}) {
    const TileLists tiles = list_groups(view, records, grid);
    ASSERT_EQ(tiles.start.size(), static_cast<std::size_t>(tiles.nx * tiles.ny + 1));
    std::size_t reached = 0;
    for (int j = 0; j < grid.ny; ++j)
      for (int i = 0; i < grid.nx; ++i) {
        const int tile = j / 16 * tiles.nx + i / 16;
        const auto first = tiles.box.begin() + tiles.start[tile];
        const auto last = tiles.box.begin() + tiles.start[tile + 1];
        EXPECT_TRUE(std::is_sorted(first, last));
        for (std::size_t k = 0; k < 60; ++k) {
          // Nearest distance of the ray to the group's centre.
          const double u = grid.first + grid.step * i, v = grid.first + grid.step * j;
          const Vec3d from = point_at(view, u, v, 0), d = ray_direction(view, u, v);
          const Vec3d to = records.centre[k] - from;
          const double t = dot(to, d) / dot(d, d);
          if (!(length(to - d * t) < records.billboard[k])) continue;
          EXPECT_TRUE(std::binary_search(first, last, static_cast<cl_int>(k)))
              << i << " " << j << " " << k;
          ++reached;
        }
      }
    EXPECT_GT(reached, static_cast<std::size_t>(grid.nx * grid.ny));
  }
}

TEST_P(Paper, HeightsSolveTheNormalEquations) {
  for (const std::size_t n : {3, 7, 8, 40}) {
    const Triangulation mesh = bumps(n, static_cast<unsigned>(n));
    const Groups groups = one_group(mesh);
    const FitParams params;
    const Quadrics quadrics = fit_heights(device_, mesh, groups, params);
    const auto& c = quadrics.coefficient[0];
    EXPECT_EQ(c[3], 1);
    EXPECT_EQ(c[6], 0);
    EXPECT_EQ(c[8], 0);
    EXPECT_EQ(c[9], 0);
    const auto left =
        reference::height_residuals(mesh.position, groups.centre[0], groups.radius[0], c, params);
    for (int k = left.terms; k < 6; ++k) EXPECT_EQ(left.solution[k], 0) << "few make a plane";
    for (int k = 0; k < left.terms; ++k)
      EXPECT_LE(std::abs(left.error[k]), left.bound[k]) << n << " " << k;
    EXPECT_NEAR(quadrics.residual[0], left.rms, left.rms_bound);
  }
}

// Points of a plane that leans by 0.32 from the group's normal.
TEST_P(Paper, AnOffsetMovesTheSurfaceOutAlongItsOwnNormal) {
  Triangulation mesh = bumps(12, 4);
  for (Vec3d& p : mesh.position) p.z = -20 + 0.3 * p.x + 0.1 * p.y;
  const Groups groups = one_group(mesh);
  const Vec3d normal = normalized({-0.3, -0.1, 1});
  for (const double offset : {0.0, 1.0, -0.5}) {
    const Quadrics quadrics = fit_heights(device_, mesh, groups, {}, offset);
    // The ridge of 10^-6 and floats move heights of some 7 radii by less than 10^-4 of them.
    for (const Vec3d& p : mesh.position)
      EXPECT_NEAR(
          reference::value_at(quadrics.coefficient[0], p + normal * offset - groups.centre[0]), 0,
          7e-4);
  }
}

TEST_P(Paper, TheRegionIsTheTrianglesWithTheirGroupsAndDepths) {
  const View view = plain_view();
  // A plane: whichever triangle owns a sample, its depth is the plane's.
  const Triangulation mesh =
      triangulated(field(8, 2, [](double u, double v) { return 20 + 0.25 * u - 0.125 * v; }));
  Groups groups;
  for (std::size_t t = 0; t < mesh.triangle.size(); ++t)
    groups.group_of_triangle.push_back(static_cast<std::int32_t>(t));
  const SampleGrid grid{67, 55, 0.25f, 0.5f};
  const PaperRegion region = draw_region(device_, view, mesh, groups, grid);
  const auto group = download(device_, region.group);
  const auto depth = download(device_, region.depth);
  std::size_t inside = 0;
  for (int j = 0; j < grid.ny; ++j)
    for (int i = 0; i < grid.nx; ++i) {
      const std::size_t s = static_cast<std::size_t>(j) * grid.nx + i;
      const double u = 0.25 + 0.5 * i, v = 0.25 + 0.5 * j;
      std::set<int> sure, possible;
      for (std::size_t t = 0; t < mesh.triangle.size(); ++t) {
        const ScreenPoint &a = mesh.screen[mesh.triangle[t][0]],
                          &b = mesh.screen[mesh.triangle[t][1]],
                          &c = mesh.screen[mesh.triangle[t][2]];
        const double doubled = (b.u - a.u) * (c.v - a.v) - (c.u - a.u) * (b.v - a.v);
        const double l1 = ((u - a.u) * (c.v - a.v) - (c.u - a.u) * (v - a.v)) / doubled;
        const double l2 = ((b.u - a.u) * (v - a.v) - (u - a.u) * (b.v - a.v)) / doubled;
        const double least = std::min({1 - l1 - l2, l1, l2});
        // Sides are at most 5 and areas at least 0.2: 1e-5 is twice the coordinates' rounding.
        if (least > 1e-5) sure.insert(static_cast<int>(t));
        if (least > -3e-5) possible.insert(static_cast<int>(t));
      }
      if (possible.empty()) {
        EXPECT_EQ(group[s], -1);
        EXPECT_EQ(depth[s], kNoSurface);
      } else if (!sure.empty()) {
        ++inside;
        EXPECT_TRUE(possible.count(group[s]));
        // Screen positions and depths are floats near 30 (2e-6 each); the coordinates' error of
        // 1e-5 moves the depth by the triangle's range, at most 2.
        EXPECT_NEAR(depth[s], 20 + 0.25 * u - 0.125 * v, 4e-5);
      }
    }
  EXPECT_GT(inside, 300u);
}

TEST_P(Paper, ContourFilterMatchesTheReference) {
  const int nx = 41, ny = 29;
  const SampleGrid grid{nx, ny, 0.5f, 1};
  Groups groups;
  groups.centre.resize(3);
  groups.normal = {{0, 0, 1}, normalized({0.2, 0, 1}), normalized({1, 0, 1})};
  std::vector<int> group;
  std::vector<float> depth;
  Random random(7);
  for (int j = 0; j < ny; ++j)
    for (int i = 0; i < nx; ++i) {
      const double wave = std::sin(0.4 * i) + std::cos(0.5 * j) + random(-0.4, 0.4);
      group.push_back(wave < -0.2 ? -1 : i < 15 ? 0 : j < 14 ? 1 : 2);
      depth.push_back(group.back() < 0 ? kNoSurface : 20 + static_cast<float>(random(0, 1)));
    }
  RegionParams params;
  params.sigma_s = 0.9;
  const double cell = 2, sigma = params.sigma_s * cell;
  const PaperRegion region{grid, upload(device_, group), upload(device_, depth)};
  const PaperRegion smoothed = smooth_contour(device_, region, groups, params, cell);
  const auto actual = download(device_, smoothed.group);
  const auto actual_depth = download(device_, smoothed.depth);
  const double terms = std::pow(2 * std::ceil(3 * sigma) + 1, 2);
  std::size_t left = 0, entered = 0;
  for (int j = 0; j < ny; ++j)
    for (int i = 0; i < nx; ++i) {
      const std::size_t s = static_cast<std::size_t>(j) * nx + i;
      const auto expected =
          filter_contour(group, nx, ny, i, j, groups.normal, sigma, params.sigma_n);
      // Each term carries some 16 epsilon (the own exponential 4), each sum one more a term.
      if (expected.doubt < (terms + 16) * kEpsilon) continue;
      EXPECT_EQ(actual[s] >= 0, expected.inside);
      EXPECT_EQ(actual_depth[s] < kNoSurface, expected.inside);
      left += group[s] >= 0 && !expected.inside;
      if (!expected.inside) continue;
      if (group[s] >= 0) {
        EXPECT_EQ(actual[s], group[s]);
        EXPECT_EQ(actual_depth[s], depth[s]);
        continue;
      }
      ++entered;
      int least = 1 << 30;  // squared distance to the region
      std::set<std::pair<int, float>> nearest;
      for (int y = 0; y < ny; ++y)
        for (int x = 0; x < nx; ++x) {
          const std::size_t k = static_cast<std::size_t>(y) * nx + x;
          const int squared = (x - i) * (x - i) + (y - j) * (y - j);
          if (group[k] < 0 || squared > least) continue;
          if (squared < least) nearest.clear();
          least = squared;
          nearest.insert({group[k], depth[k]});
        }
      EXPECT_TRUE(nearest.count({actual[s], actual_depth[s]}));
    }
  EXPECT_GT(left, 0u);
  EXPECT_GT(entered, 0u);
}

TEST_P(Paper, SplashIsDrawnAsSpheres) {
  // Orthographic, one pixel a tenth of a radius.
  const View view = orthographic_view(45, 45, {20 / 45.0, 20 / 45.0, -0.01});
  Projected p;
  const Vec3d centre[2] = {{0.25, 0.5, -20}, {-0.5, 0.25, -20.5}};
  for (const Vec3d& c : centre) {
    const PixelPosition at = project(view, c);
    add_particle(p, c, at.u, at.v, view.u_scale, view.v_scale);
  }
  SurfaceBuffers surface = empty_surface(device_, pixel_grid(view));
  // A surface at depth 19.4 hides what lies behind it.
  surface.depth = filled<float>(device_, surface.grid.size(), 19.4f);
  draw_spheres(device_, view, p, {0, 1}, surface);
  const SurfaceMap map = download(device_, surface);
  std::size_t drawn = 0;
  for (int j = 0; j < 45; ++j)
    for (int i = 0; i < 45; ++i) {
      const std::size_t s = static_cast<std::size_t>(j) * 45 + i;
      double depth = 19.4;
      Vec3d normal;
      for (const Vec3d& c : centre) {
        const Vec3d at = point_at(view, i + 0.5, j + 0.5, 0) - Vec3d{c.x, c.y, 0};
        const double q = 1 - at.x * at.x - at.y * at.y;
        if (q <= 0 || -c.z - std::sqrt(q) >= depth) continue;
        depth = -c.z - std::sqrt(q);
        normal = {at.x, at.y, std::sqrt(q)};
      }
      // Screen positions near 30 pixels are off by 2e-6, a tenth of that in radii; where a sphere
      // shows, q > 0.36, so that its root passes on less than twice that; depths near 20 are off by
      // 1e-6 a rounding.
      EXPECT_NEAR(map.depth[s], depth, 1e-5);
      if (depth < 19.4 - 1e-5) {
        ++drawn;
        EXPECT_EQ(map.kind[s], Kind::splash);
        // Three such errors over the radius of 1.
        EXPECT_NEAR(length(Vec3d(map.normal[s]) - normal), 0, 3e-5);
      } else {
        EXPECT_EQ(map.kind[s], Kind::surface);
      }
    }
  EXPECT_GT(drawn, 100u);
}

MENISCUS_ON_EVERY_DEVICE(Paper);

}  // namespace
}  // namespace meniscus
