// The blend on surfaces whose answer is exact, on every device and in every vector width.
#include "stages/blend.hpp"

#include <algorithm>
#include <cmath>
#include <cstring>

#include "stages/stage_test_support.hpp"

namespace meniscus {
namespace {

using Blend = OnDevice;

// Groups whose quadrics are given.
struct Scene {
  Groups groups;
  Quadrics quadrics;

  // A plane through `centre` (of a group of `radius`), which is the surface itself: offset 0.
  void add_plane(const Vec3d& centre, const Vec3d& normal, double radius = 4) {
    groups.centre.push_back(centre);
    groups.normal.push_back(normalized(normal));
    groups.radius.push_back(radius);
    groups.triangles.push_back(6);
    const Vec3d n = normalized(normal);
    quadrics.coefficient.push_back({0, static_cast<float>(n.x), static_cast<float>(n.y),
                                    static_cast<float>(n.z), 0, 0, 0, 0, 0, 0});
    quadrics.residual.push_back(0);
  }
};

// A perspective camera that looks down -z, u = 8 + 8 x / t on 16 x 16 pixels and so on.
View view_of(int width, int height) {
  Camera camera;
  camera.width = width;
  camera.height = height;
  camera.view = {1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1};
  camera.projection = {1, 0, 0, 0, 0, 1.0 * width / height, 0, 0, 0, 0, -1, -0.2, 0, 0, -1, 0};
  return make_view(camera, 1, {0, 0, 0});
}

SurfaceMap blended(Device& device, const View& view, const SampleGrid& grid, const Scene& scene,
                   float reference, int width) {
  device.state().vector_width = width;
  const BlendParams params;
  const std::vector<double> trust(scene.groups.size(), 1.0);
  const GroupRecords records = make_records(scene.groups, scene.quadrics, trust, params, 0);
  const SurfaceBuffers surface = empty_surface(device, grid);
  blend_groups(device, view, upload(device, records.values), list_tiles(view, records, grid),
               filled<float>(device, grid.size(), reference), surface, params);
  return download(device, surface);
}

// Depth at which the ray of pixel (u, v) meets the plane.
double plane_depth(const View& view, const Vec3d& centre, const Vec3d& normal, double u, double v) {
  const Vec3d from = point_at(view, u, v, 0), direction = ray_direction(view, u, v);
  return dot(centre - from, normal) / dot(direction, normal);
}

// Calls check(depth, normal, u, v) at every sample with surface, for every width, and expects the
// same bits of all of them. Returns how many there are.
template <class Check>
std::size_t for_every_width(Device& device, const View& view, const SampleGrid& grid,
                            const Scene& scene, float reference, Check&& check) {
  const SurfaceMap one = blended(device, view, grid, scene, reference, 1);
  const SurfaceMap eight = blended(device, view, grid, scene, reference, 8);
  EXPECT_EQ(std::memcmp(one.depth.data(), eight.depth.data(), grid.size() * sizeof(float)), 0);
  EXPECT_TRUE(one.group == eight.group);
  EXPECT_TRUE(one.normal == eight.normal);
  std::size_t count = 0;
  for (std::size_t s = 0; s < grid.size(); ++s) {
    if (!(one.depth[s] < kNoSurface)) continue;
    ++count;
    check(one.depth[s], Vec3d(one.normal[s]),
          grid.first + grid.step * static_cast<double>(s % grid.nx),
          grid.first + grid.step * static_cast<double>(s / grid.nx));
  }
  return count;
}

// Largest error of a depth near 20 on a plane that the ray meets at a slope of at least 0.3: the
// value C of the plane at the reference is a sum of three products of numbers up to 30, whose
// factors carry five roundings each; the slope divides it; the reference is added. A mean of such
// depths adds two more.
constexpr double kDepthError = (3 * 8 * 30 / 0.3 + 4 * 30) * kEpsilon;
// A normal is a gradient, plus half the weights' gradients times the differences of the depths they
// weigh, which are 0 on a plane but for their rounding. Within five radii of a group of radius 4
// (b = 2.5, reach 7) a weight's half gradient is at most 5 (1 / (2 b^2) + 2 / (reach^2 - 5^2)) < 1
// times the slope of the ray, below 1.3. Two sums of them, and the length's roundings.
constexpr double kNormalError = 2 * 1.3 * kDepthError + 8 * kEpsilon;

bool near_a_group(const View& view, const Scene& scene, double u, double v, double depth) {
  for (const Vec3d& centre : scene.groups.centre)
    if (length(point_at(view, u, v, depth) - centre) < 5) return true;
  return false;
}

const SampleGrid kGrids[] = {{37, 21, 0.5f, 1}, {19, 11, 0, 2}, {1, 1, 15, 1}};

TEST_P(Blend, APlaneStaysAPlane) {
  const View view = view_of(37, 21);
  const Vec3d centre{1, -0.5, -20}, normal = normalized({0.3, 0.4, 1});
  Scene scene;
  scene.add_plane(centre, normal);
  for (const SampleGrid& grid : kGrids) {
    const std::size_t count = for_every_width(
        device_, view, grid, scene, 20.5f, [&](float depth, const Vec3d& n, double u, double v) {
          EXPECT_NEAR(depth, plane_depth(view, centre, normal, u, v), kDepthError);
          EXPECT_NEAR(length(n - normal), 0, kNormalError);
        });
    EXPECT_GT(count, 0u);
  }
}

TEST_P(Blend, GroupsOnOnePlaneBlendIntoIt) {
  const View view = view_of(37, 21);
  const Vec3d normal = normalized({-0.2, 0.3, 1});
  const Vec3d side = normalized(cross(normal, {0, 1, 0}));
  Scene scene;
  const Vec3d centre{0, 0, -20};
  for (int k = -2; k <= 2; ++k) scene.add_plane(centre + side * (3.0 * k), normal);
  const std::size_t count = for_every_width(
      device_, view, kGrids[0], scene, 20, [&](float depth, const Vec3d& n, double u, double v) {
        EXPECT_NEAR(depth, plane_depth(view, centre, normal, u, v), kDepthError);
        if (near_a_group(view, scene, u, v, depth)) {
          EXPECT_NEAR(length(n - normal), 0, kNormalError);
        }
      });
  EXPECT_GT(count, 200u);
}

// Two planes that meet on the line x = 0 at depth 20, each centre two radii from it.
void expect_crease(Device& device, double tilt, bool convex) {
  const View view = view_of(37, 21);
  const Vec3d left = normalized({convex ? -tilt : tilt, 0, 1}),
              right = normalized({convex ? tilt : -tilt, 0, 1});
  const Vec3d line{0, 0, -20};
  const Vec3d centre_left = line + normalized(cross(left, {0, 1, 0})) * 2.0,
              centre_right = line - normalized(cross(right, {0, 1, 0})) * 2.0;
  ASSERT_LT(centre_left.x, 0);
  Scene scene;
  scene.add_plane(centre_left, left);
  scene.add_plane(centre_right, right);
  const std::size_t count = for_every_width(
      device, view, kGrids[0], scene, 20, [&](float depth, const Vec3d& n, double u, double v) {
        const double a = plane_depth(view, line, left, u, v);
        const double b = plane_depth(view, line, right, u, v);
        // Beyond 2.4 radii from each other the sheets do not meet: only near the crease.
        if (std::abs(a - b) > 1.5) return;
        EXPECT_NEAR(depth, convex ? std::max(a, b) : std::min(a, b), kDepthError);
        if (std::abs(a - b) < 2 * kDepthError || !near_a_group(view, scene, u, v, depth)) return;
        EXPECT_NEAR(length(n - ((a > b) == convex ? left : right)), 0, kNormalError);
      });
  EXPECT_GT(count, 50u);
}

TEST_P(Blend, AConvexCreaseTakesTheFartherSheet) { expect_crease(device_, 1, true); }
TEST_P(Blend, AConcaveCreaseTakesTheNearerSheet) { expect_crease(device_, 1, false); }

TEST_P(Blend, GroupsFarFromTheReferenceOrFacingAwayDoNotCount) {
  const View view = view_of(37, 21);
  const Vec3d centre{0, 0, -20}, normal{0, 0, 1};
  Scene scene;
  scene.add_plane(centre, normal);
  scene.add_plane({0, 0, -27}, normal);  // seven radii behind the reference
  scene.add_plane({0, 0, -20}, {0, 0, -1});
  const std::size_t count = for_every_width(device_, view, kGrids[0], scene, 20,
                                            [&](float depth, const Vec3d& n, double u, double v) {
                                              EXPECT_NEAR(depth, 20, kDepthError);
                                              if (near_a_group(view, scene, u, v, depth)) {
                                                EXPECT_NEAR(length(n - normal), 0, kNormalError);
                                              }
                                            });
  EXPECT_GT(count, 50u);
}

TEST_P(Blend, ARayParallelToAPlaneDoesNotSpoilItsNeighbours) {
  // The second plane is met by the rays left of u = 4 and left by those right of it, at exactly
  // the slope at which the quadratic's stable root divides by zero.
  const View view = view_of(16, 16);
  const Vec3d normal{1, 0, -0.5};
  Scene scene;
  scene.add_plane({-10, 0, -20}, {0, 0, 1}, 12);
  scene.add_plane(point_at(view, 3.5, 8.5, 20), normal);
  scene.quadrics.coefficient[1] = {0, 1, 0, -0.5f, 0, 0, 0, 0, 0, 0};
  std::size_t nan = 0;
  const SampleGrid grid{16, 16, 0.5f, 1};
  for_every_width(device_, view, grid, scene, 20, [](float, const Vec3d&, double, double) {});
  for (const float depth : blended(device_, view, grid, scene, 20, 8).depth)
    nan += std::isnan(depth);
  EXPECT_EQ(nan, 0u);
}

TEST_P(Blend, SamplesWithoutReferenceOrGroupsStayEmpty) {
  const View view = view_of(37, 21);
  Scene scene;
  scene.add_plane({0, 0, -20}, {0, 0, 1});
  EXPECT_EQ(for_every_width(device_, view, kGrids[0], scene, kNoSurface,
                            [](float, const Vec3d&, double, double) {}),
            0u);
  EXPECT_EQ(for_every_width(device_, view, kGrids[0], Scene{}, 20,
                            [](float, const Vec3d&, double, double) {}),
            0u);
}

TEST(ListTiles, NamesEveryGroupWhoseBillboardReachesASample) {
  const View view = view_of(70, 50);
  Random random(5);
  Scene scene;
  for (int k = 0; k < 60; ++k)
    scene.add_plane({random(-30, 30), random(-20, 20), random(-40, -12)}, {0, 0, 1},
                    random(0.6, 4));
  const std::vector<double> trust(scene.groups.size(), 1.0);
  const GroupRecords records = make_records(scene.groups, scene.quadrics, trust, {}, 1);
  for (const SampleGrid& grid : {SampleGrid{70, 50, 0.5f, 1}, SampleGrid{36, 26, 0, 2}}) {
    const TileLists tiles = list_tiles(view, records, grid);
    ASSERT_EQ(tiles.start.size(), static_cast<std::size_t>(tiles.nx * tiles.ny + 1));
    for (int j = 0; j < grid.ny; ++j)
      for (int i = 0; i < grid.nx; ++i) {
        const int tile = j / 16 * tiles.nx + i / 16;
        const auto first = tiles.group.begin() + tiles.start[tile];
        const auto last = tiles.group.begin() + tiles.start[tile + 1];
        EXPECT_TRUE(std::is_sorted(first, last));
        for (int g = 0; g < 60; ++g) {
          // Nearest distance of the ray to the billboard's centre.
          const double u = grid.first + grid.step * i, v = grid.first + grid.step * j;
          const Vec3d from = point_at(view, u, v, 0), d = ray_direction(view, u, v);
          const Vec3d to = records.centre[g] - from;
          const double t = dot(to, d) / dot(d, d);
          if (length(to - d * t) < records.billboard[g]) {
            EXPECT_TRUE(std::binary_search(first, last, g)) << i << " " << j << " " << g;
          }
        }
      }
  }
}

MENISCUS_ON_EVERY_DEVICE(Blend);

}  // namespace
}  // namespace meniscus
