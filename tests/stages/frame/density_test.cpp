// The density field against a loop over all particles, and the blobs it draws, on every device.
#include "stages/frame/density.hpp"

#include "stages/frame/relax.hpp"
#include "stages/sample/settle.hpp"
#include "stages/stage_test_support.hpp"
#include "verify/reference/density.hpp"
#include "verify/reference/settle.hpp"
#include "verify/stage_cases/cases.hpp"
#include "verify/stage_cases/into_new.hpp"
#include "verify/stage_cases/mesh_by_hand.hpp"

namespace meniscus {
namespace {

using Density = OnDevice;

DeviceCells cells_of(Device& device, const Projected& p) {
  return upload_cells(device, make_cells(p.x, p.y, p.z, kDensitySupport));
}

DeviceCells levelled(Device& device, const DeviceCells& cells, const RegionParams& params) {
  return level_cells(device, cells, params);
}

TEST_P(Density, MatchesTheReferenceWithItsGradients) {
  for (const std::size_t n : {1, 65, 700, 1050})
    expect_within(verify::density_errors(device_, n, 333));
}

// The polynomial against the spline that it stands for, with what docs/method.md says of it.
TEST_P(Density, IsTheCubicSplineButForAThousandthsFour) {
  const Projected p = place({{20, 20, 20}});
  const Vec3d centre = p.eye(0);
  constexpr int kSteps = 4096;  // of distances up to the support, 4 radii: exact in floats
  std::vector<Vec3d> points{centre, centre + Vec3d{1, 0, 0}};
  for (int k = 0; k < kSteps; ++k) points.push_back(centre + Vec3d{(k + 0.5) * 4 / kSteps, 0, 0});
  const std::vector<float> found = measure_density(device_, cells_of(device_, p), points);
  const double peak = reference::cubic_spline(0);
  const double rounding = reference::density_error(p, centre, peak);
  // The spline's own value in the middle and at a particle's radius: four coefficients of six
  // digits.
  constexpr double kDigits = 4 * 0.5e-6 / std::numbers::pi;
  EXPECT_NEAR(found[0], peak, kDigits + rounding);
  EXPECT_NEAR(found[1], reference::cubic_spline(0.5), kDigits + rounding);
  double volume = 0;
  for (int k = 0; k < kSteps; ++k) {
    const double q = (k + 0.5) * 2 / kSteps;
    EXPECT_NEAR(found[2 + k], reference::cubic_spline(q), 0.004 * peak + rounding) << q;
    volume += 4 * std::numbers::pi * q * q * found[2 + k] * 2 / kSteps;
  }
  // Its integral: digits and roundings over a ball of radius 2 h, and the midpoint rule, whose
  // error is below (2 h / steps)^2 / 24 of the integrand's second derivative, below 40 over 2 h.
  const double ball = 4.0 / 3 * std::numbers::pi * 8;
  EXPECT_NEAR(volume, 1, ball * (kDigits + rounding) + std::pow(2.0 / kSteps, 2) / 24 * 40 * 2);
}

// A lattice, shaken by `rough` radii, its particles `spacing` radii from each other: buckets wrap
// around many times.
Projected shaken_block(int side, double spacing, double rough) {
  Random random(9);
  Projected p;
  for (int k = 0; k < side; ++k)
    for (int j = 0; j < side; ++j)
      for (int i = 0; i < side; ++i)
        add_position(
            p, {spacing * i - 20 + random(-rough, rough), spacing * j - 20 + random(-rough, rough),
                -20 - spacing * k + random(-rough, rough)});
  return p;
}

TEST_P(Density, NearAirMeasuresAllButWhatIsInside) {
  for (const double spacing : {2.0, 1.6, 3.0}) {  // as the radius says, too large and too small
    const Projected p = shaken_block(18, spacing, 0.1);
    const std::size_t n = p.size();
    const Cells cells = make_cells(p.x, p.y, p.z, kDensitySupport);
    const DeviceCells on_device = upload_cells(device_, cells);
    const auto all = download(device_, measure_gradients(device_, on_device));
    const auto found = download(device_, measure_gradients(device_, on_device, Measured::near_air));
    std::size_t inside = 0;
    for (std::size_t k = 0; k < n; ++k) {
      const bool measured = found[k] == all[k] && found[n + k] == all[n + k] &&
                            found[2 * n + k] == all[2 * n + k] &&
                            found[3 * n + k] == all[3 * n + k];
      if (measured) continue;
      ++inside;
      for (std::size_t row = 0; row < 4; ++row)
        EXPECT_EQ(found[row * n + k], row == 3 ? 1.0f : 0.0f);
      // What makes a particle one of the surface begins at .22 a spacing (surface.hpp), where there
      // is as much mass as the radius says.
      const double mass = std::pow(2 / spacing, 3);
      EXPECT_LT(2 * length({all[k], all[n + k], all[2 * n + k]}), 0.2 * mass) << spacing;
      EXPECT_GT(all[3 * n + k], 0.85);  // from where on levels are those of the inside
    }
    if (spacing > 2.5)
      EXPECT_EQ(inside, 0u) << "2.4 particles a cell";
    else
      EXPECT_GT(inside, n / 20);
  }
}

TEST_P(Density, LevelledWeightsAreOneForALoneParticleAndFallInsideTheFluid) {
  Projected p = scattered(1, 1, 3);
  RegionParams params;
  EXPECT_EQ(download(device_, levelled(device_, cells_of(device_, p), params).weight)[0], 1.0f);
  // A lattice of spacing two radii has the density 1 inside: the weight is level / 0.45.
  p = {};
  for (int k = 0; k < 7; ++k)
    for (int j = 0; j < 7; ++j)
      for (int i = 0; i < 7; ++i) add_position(p, Vec3d(2 * i, 2 * j, -20 - 2 * k));
  const Cells cells = make_cells(p.x, p.y, p.z, kDensitySupport);
  const auto weight =
      download(device_, levelled(device_, upload_cells(device_, cells), params).weight);
  for (std::size_t k = 0; k < weight.size(); ++k)
    if (cells.item[k] == 3 + 7 * (3 + 7 * 3)) {  // the middle
      ASSERT_GT(reference::density(p, p.eye(cells.item[k])), 0.85);
      // One quotient of sums of two: four roundings.
      EXPECT_NEAR(weight[k], params.blob_density / 0.45, 4 * kEpsilon);
    }
}

// Whatever unit of length and level of the field the fluid's disorder takes.
TEST_P(Density, LoneIrregularParticlesReachTheLevelAtTheirRadius) {
  const Cells cells = [] {
    const Projected one = scattered(1, 1, 3);
    return make_cells(one.x, one.y, one.z, kDensitySupport);
  }();
  for (const double amount : {0.0, 0.02, 0.25, 0.5, 1.0, 1.5, 2.0}) {
    const Disorder disorder{.amount = amount};
    const RegionParams params = for_disorder(RegionParams{}, disorder);
    const DeviceCells alone = level_cells(device_, upload_cells(device_, cells, disorder.mass()),
                                          params, lone_factor({}, disorder));
    const double weight = download(device_, alone.weight)[0];
    // The kernels' polynomial is the spline's to 1/100, and with it the radius.
    EXPECT_NEAR(weight * reference::cubic_spline(0.5 / disorder.unit()), params.blob_density,
                0.01 * params.blob_density)
        << amount;
  }
}

TEST_P(Density, IrregularParticlesCountNoLessWhereTheyAreMany) {
  const Disorder disorder{.amount = 2};
  const RegionParams params = for_disorder(RegionParams{}, disorder);
  const double lone = lone_factor({}, disorder);
  const auto weights = [&](const Projected& p, double factor) {
    const Cells cells = make_cells(p.x, p.y, p.z, kDensitySupport);
    return download(
        device_,
        level_cells(device_, upload_cells(device_, cells, disorder.mass()), params, factor).weight);
  };
  // As many at one place as it takes until they count once, and two more.
  const double enough = (lone - 0.3) / 0.7;
  std::vector<Vec3d> places;
  double last = INFINITY;
  for (int k = 1; k < enough + 2; ++k) {
    places.push_back({30, 30, 20});
    const double raised = weights(place(places), lone)[0] / weights(place(places), 1)[0];
    EXPECT_NEAR(raised, std::max(0.3 + (lone - 0.3) / k, 1.0), 16 * kEpsilon * lone) << k;
    EXPECT_LE(raised, last);
    last = raised;
  }
  EXPECT_EQ(last, 1);
}

TEST_P(Density, ALoneParticleIsDrawnAsASphere) {
  const Camera camera = perspective_camera(61, 47);
  const View view = make_view(camera, 0.5, {0, 0, 0});
  const Vec3d at = point_at(view, 30, 24, 19);
  Projected p;
  p.x = {static_cast<float>(at.x)};
  p.y = {static_cast<float>(at.y)};
  p.z = {static_cast<float>(at.z)};
  const PixelPosition screen = project(view, p.eye(0));
  p.u = {static_cast<float>(screen.u)};
  p.v = {static_cast<float>(screen.v)};
  p.ku = {static_cast<float>(view.u_scale / screen.w)};
  p.kv = {static_cast<float>(view.v_scale / screen.w)};
  p.scale = {1};
  const RegionParams params;
  // The level's radius: where the reference's share falls to it.
  double low = 0, high = 2;
  for (int k = 0; k < 60; ++k) {
    const double middle = (low + high) / 2;
    (reference::share(middle / 2) > params.blob_density ? low : high) = middle;
  }
  EXPECT_NEAR(low, 1, 0.01) << "the default draws a sphere of the particle's radius";
  const SurfaceBuffers surface = empty_surface(device_, pixel_grid(view));
  const Extent extent = splat_extent(device_, upload_splats(device_, p, {0}), surface.grid, 2.5,
                                     no_blocks(device_, surface.grid));
  draw_splash(device_, view,
              list_gaps(device_, surface.grid, extent.from, extent.occupied,
                        blocks_of(device_, surface.grid, false), 0)
                  .lists,
              levelled(device_, cells_of(device_, p), params), extent, surface, params);
  const SurfaceMap map = download(device_, surface);
  std::size_t drawn = 0;
  for (int j = 0; j < map.grid.ny; ++j)
    for (int i = 0; i < map.grid.nx; ++i) {
      const std::size_t s = static_cast<std::size_t>(j) * map.grid.nx + i;
      const Vec3d direction = ray_direction(view, i + 0.5, j + 0.5);
      const Vec3d from = point_at(view, i + 0.5, j + 0.5, 0) - p.eye(0);
      const double a = dot(direction, direction), b = dot(direction, from);
      const double root = b * b - a * (dot(from, from) - low * low);
      // A ray that passes within 5 % of the limb may slip between two steps of the march.
      if (root < -0.05 * a) {
        EXPECT_EQ(map.depth[s], kNoSurface);
      } else if (root > 0.3 * a) {
        ++drawn;
        ASSERT_LT(map.depth[s], kNoSurface);
        const double t = (-b - std::sqrt(root)) / a;
        // What the kernel promises, in radii along the ray and so less in depth.
        EXPECT_NEAR(map.depth[s], t, 1.0 / 1024);
        EXPECT_EQ(map.kind[s], Kind::splash);
        const Vec3d outward = normalized(point_at(view, i + 0.5, j + 0.5, map.depth[s]) - p.eye(0));
        // The gradient points along the difference of positions near 20, whose rounding is 2e-6.
        EXPECT_NEAR(length(Vec3d(map.normal[s]) - outward), 0, 1e-5);
      }
    }
  EXPECT_GT(drawn, 10u);
}

MENISCUS_ON_EVERY_DEVICE(Density);

}  // namespace
}  // namespace meniscus
