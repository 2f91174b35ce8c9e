// Method stable's kernels against double-precision loops, on every device.
#include "stages/other_methods/stable.hpp"

#include <algorithm>
#include <cmath>

#include "meniscus/meniscus.hpp"
#include "stages/stage_test_support.hpp"
#include "verify/reference/stable.hpp"
#include "verify/stage_cases/cases.hpp"
#include "verify/stage_cases/fits_by_hand.hpp"
#include "verify/stage_cases/mesh_by_hand.hpp"

namespace meniscus {
namespace {

using Stable = OnDevice;

double flat(double, double) { return 30; }

struct Drawn {
  StableRegion region;
  SurfaceBuffers surface;
};

Drawn draw(Device& device, const Projected& projected, const Triangulation& mesh,
           const ParticleFits& fits, const SampleGrid& grid, const Parameters& params) {
  const GroupRecords records = stable_records(fits, params.fit, params.blend.radius);
  const auto device_records = upload(device, records.values);
  StableRegion region = draw_stable_region(device, plain_view(), mesh, all_visible(projected), fits,
                                           device_records, grid, params);
  const SurfaceBuffers surface =
      blend_particles(device, plain_view(), region, device_records,
                      list_tiles(plain_view(), records, grid), params.blend);
  return {std::move(region), surface};
}

// Triangles alone.
Parameters bare() {
  Parameters params;
  params.stable.capsule = 0;
  params.stable.closing = 0;
  return params;
}

const SampleGrid kGrids[] = {{75, 70, 6, 0.4f}, {100, 100, 0.5f, 1}, {17, 9, 10, 2}, {1, 1, 20, 1}};

// Triangles belong to the corner that counts most, and fits are blended as in double precision.
TEST_P(Stable, MatchesTheReference) {
  for (const SampleGrid& grid : kGrids) expect_within(verify::stable_errors(device_, grid));
}

// Without fits, and with fits that face the camera, a capsule is a stadium of one particle radius.
TEST_P(Stable, CapsulesSurroundTheContour) {
  const Projected p = place({{40, 40, 30}, {44, 40.5, 30}, {41.5, 43.5, 30}, {60, 50, 25}});
  const Triangulation mesh = triangulated(p);
  ASSERT_EQ(mesh.triangle.size(), 1u);
  ParticleFits fits = made_by_hand(mesh, flat, 0, 1);
  const SampleGrid grid{110, 70, 36, 0.25f};
  Parameters params;
  params.stable.closing = 0;
  for (const float residual : {0.0f, -1.0f}) {
    fits.residual.assign(fits.size(), residual);
    const StableRegion region = draw(device_, p, mesh, fits, grid, params).region;
    const auto front = download(device_, region.front);
    const auto owner = download(device_, region.owner);
    for (int j = 0; j < grid.ny; ++j)
      for (int i = 0; i < grid.nx; ++i) {
        const Vec3d at{grid.first + grid.step * i, grid.first + grid.step * j, 0};
        double nearest = 1e9;  // distance to the triangle's outline or the lone particle
        const auto corner = [&](int k) { return Vec3d{mesh.screen[k].u, mesh.screen[k].v, 0}; };
        for (int k = 0; k < 4; ++k) {
          const Vec3d a = corner(k), b = corner(k < 3 ? (k + 1) % 3 : 3), along = b - a;
          const double squared = dot(along, along);
          const double f = squared > 0 ? std::clamp(dot(at - a, along) / squared, 0.0, 1.0) : 0;
          nearest = std::min(nearest, length(at - a - along * f));
        }
        const std::size_t s = static_cast<std::size_t>(j) * grid.nx + i;
        const bool inside = reference::owned_at(plain_view(), mesh, fits, at.x, at.y).owner >= 0;
        // Screen coordinates below 64 rounded a few times decide nothing farther away than this.
        if (std::abs(nearest - 1) < 1e-4 || (nearest < 1e-4)) continue;
        ASSERT_EQ(owner[s] >= 0, inside || nearest < 1) << at.x << " " << at.y;
        if (inside || nearest > 1) continue;
        // 30 - sqrt(1 - d^2): d is good to 1e-5, and the root's slope below 1 / sqrt(2e-4).
        const double depth = at.x > 50 ? 25 : 30;
        EXPECT_NEAR(front[s], depth - std::sqrt(1 - nearest * nearest), 1e-3);
      }
  }
}

// Where no particle has a fit, the region shows its own depth with its owners' normals.
TEST_P(Stable, WithoutFitsTheOwnersNormalsAreShown) {
  const Projected p = field(8, 19, hills);
  const Triangulation mesh = triangulated(p);
  ParticleFits fits = made_by_hand(mesh, hills, 0, 20);
  fits.residual.assign(fits.size(), -1.0f);
  const SampleGrid grid{40, 40, 8, 0.5f};
  const Drawn drawn = draw(device_, p, mesh, fits, grid, {});
  const auto front = download(device_, drawn.region.front);
  const auto owner = download(device_, drawn.region.owner);
  const SurfaceMap map = download(device_, drawn.surface);
  std::size_t covered = 0;
  for (std::size_t s = 0; s < grid.size(); ++s) {
    EXPECT_EQ(std::isfinite(map.depth[s]), owner[s] >= 0);
    if (owner[s] < 0) continue;
    ++covered;
    EXPECT_EQ(map.depth[s], front[s]);
    EXPECT_EQ(map.group[s], owner[s]);
    // Normalised once more: four roundings a coordinate.
    EXPECT_LT(length(Vec3d(map.normal[s]) - fits.normal[owner[s]]), 8 * kEpsilon);
  }
  EXPECT_GT(covered, 500u);
}

// Closing by a disc: a sample is filled when every disc that holds it meets the region.
TEST_P(Stable, ClosingFillsWhatNoDiscFitsInto) {
  const Projected all = field(14, 9, flat);
  std::vector<Vec3d> uvt;
  Random random(10);
  for (std::size_t k = 0; k < all.size(); ++k)
    if (random(0, 1) < 0.7) uvt.push_back({all.u[k], all.v[k], -all.z[k]});
  const Projected p = place(uvt);
  const Triangulation mesh = triangulated(p);
  const ParticleFits fits = made_by_hand(mesh, flat, 0, 11);
  for (const SampleGrid& grid : kGrids) {
    Parameters params = bare();
    const StableRegion open = draw(device_, p, mesh, fits, grid, params).region;
    params.stable.closing = 1.7;
    const StableRegion closed = draw(device_, p, mesh, fits, grid, params).region;
    const auto before = download(device_, open.reference),
               after = download(device_, closed.reference);
    const auto owner_before = download(device_, open.owner),
               owner = download(device_, closed.owner);
    const double radius = params.stable.closing / grid.step;  // a pixel is a particle radius
    const int reach = static_cast<int>(radius);
    const auto near = [&](int s,
                          auto&& visit) {  // samples within the radius, with squared distance
      const int i = s % grid.nx, j = s / grid.nx;
      for (int y = std::max(0, j - reach); y <= std::min(grid.ny - 1, j + reach); ++y)
        for (int x = std::max(0, i - reach); x <= std::min(grid.nx - 1, i + reach); ++x) {
          const int squared = (x - i) * (x - i) + (y - j) * (y - j);
          if (squared <= radius * radius) visit(y * grid.nx + x, squared);
        }
    };
    const int n = static_cast<int>(grid.size());
    std::vector<char> wide(n, 0);
    for (int s = 0; s < n; ++s) near(s, [&](int o, int) { wide[s] |= owner_before[o] >= 0; });
    for (int s = 0; s < n; ++s) {
      bool fill = true;
      int nearest = INT_MAX;
      near(s, [&](int o, int squared) {
        fill &= wide[o];
        if (owner_before[o] >= 0) nearest = std::min(nearest, squared);
      });
      ASSERT_EQ(owner[s] >= 0, owner_before[s] >= 0 || (fill && nearest < INT_MAX)) << s;
      if (owner[s] < 0 || owner_before[s] >= 0) continue;
      bool found = false;
      near(s, [&](int o, int squared) {
        found |= squared == nearest && before[o] == after[s] && owner_before[o] == owner[s];
      });
      EXPECT_TRUE(found) << s;
    }
  }
}

// Fits that are one plane blend into it, whatever their weights.
TEST_P(Stable, APlaneStaysAPlane) {
  const auto plane = [](double u, double v) { return 30 + 0.3 * u - 0.2 * v; };
  const Projected p = field(12, 15, plane);
  const Triangulation mesh = triangulated(p);
  const Parameters params;
  const Vec3d n = normalized({0.3, 0.2, 1});
  for (const SampleGrid& grid : kGrids) {
    const SurfaceMap map = download(
        device_, draw(device_, p, mesh, made_by_hand(mesh, plane, 0, 16), grid, params).surface);
    for (std::size_t s = 0; s < grid.size(); ++s) {
      if (!(map.group[s] >= 0)) continue;
      // Offset by one radius along the normal. Coordinates below 64 are rounded when stored, twice
      // in the ray and in the sums of f, over a slope along the ray of at least 0.9.
      EXPECT_NEAR(map.depth[s], plane(u_of(grid, s), v_of(grid, s)) - 1 / n.z, 16 * 64 * kEpsilon);
      // Gradients are equal to one rounding a coordinate; what the weights add is f = 0.
      EXPECT_LT(length(Vec3d(map.normal[s]) - n), 16 * 64 * kEpsilon);
    }
  }
}

TEST_P(Stable, VectorsOfAnyWidthGiveTheSameBits) {
  const Projected p = field(12, 17, roof);
  const Triangulation mesh = triangulated(p);
  for (const SampleGrid& grid : kGrids) {
    const ParticleFits fits = made_by_hand(mesh, roof, 0.05, 18);
    use_width(1);
    const SurfaceMap one = download(device_, draw(device_, p, mesh, fits, grid, {}).surface);
    use_width(8);
    const SurfaceMap eight = download(device_, draw(device_, p, mesh, fits, grid, {}).surface);
    EXPECT_EQ(one.depth, eight.depth);
    EXPECT_EQ(one.group, eight.group);
    for (std::size_t s = 0; s < grid.size(); ++s)
      EXPECT_EQ(Vec3d(one.normal[s]), Vec3d(eight.normal[s]));
  }
}

TEST_P(Stable, TheOrderOfTheParticlesDoesNotMatter) {
  Particles particles = read_particles(MENISCUS_TEST_DATA "/dam_4913.ply");
  const Camera camera = frame_particles(particles, 200, 150);
  Parameters params;
  params.method = Method::stable;
  const Surface first = extract(device_, particles, camera, params);
  EXPECT_GT(std::count_if(first.depth.begin(), first.depth.end(),
                          [](float depth) { return std::isfinite(depth); }),
            1000);
  std::reverse(particles.x.begin(), particles.x.end());
  std::reverse(particles.y.begin(), particles.y.end());
  std::reverse(particles.z.begin(), particles.z.end());
  const Surface second = extract(device_, particles, camera, params);
  EXPECT_EQ(first.depth, second.depth);
  ASSERT_EQ(first.mesh.position.size(), second.mesh.position.size());
}

TEST_P(Stable, NothingInViewIsAnEmptySurface) {
  Particles particles;
  Parameters params;
  params.method = Method::stable;
  const Surface surface = extract(device_, particles, frame_particles(particles, 40, 30), params);
  for (const float depth : surface.depth) EXPECT_EQ(depth, kNoSurface);
  EXPECT_TRUE(surface.mesh.triangle.empty());
}

MENISCUS_ON_EVERY_DEVICE(Stable);

}  // namespace
}  // namespace meniscus
