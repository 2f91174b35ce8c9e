// The passes over particles that stream through the device.
#include "prepare/gather.hpp"

#include <gmock/gmock.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <set>

#include "meniscus/error.hpp"
#include "stages/frame/project.hpp"
#include "stages/stage_test_support.hpp"
#include "thrown.hpp"

namespace meniscus {
namespace {

constexpr double kRadius = 0.02;
constexpr std::array<double, 3> kOrigin{0.5, -0.25, 0.125};  // exact in float

using Gather = OnDevice;

Particles cloud(std::size_t n) {
  Random random(11);
  Particles particles;
  for (std::size_t i = 0; i < n; ++i)
    add_position(particles, {random(-9, 9), random(-9, 9), random(-9, 12)});
  particles.x[n / 2] = NAN;
  particles.y[n / 3] = INFINITY;
  return particles;
}

using Places = std::vector<std::pair<std::int64_t, bool>>;  // of particles, and whether seen

Places select(Device& device, const View& view, const Particles& particles, std::size_t chunk,
              const FrontMap& map) {
  Places places;
  select_near(device, view, *source_of(particles), chunk, map, {},
              [&](const ParticleChunk& now, const std::vector<cl_uint>& found) {
                for (const cl_uint place : found)
                  places.emplace_back(now.first + (place & ~kIsSeen), (place & kIsSeen) != 0);
              });
  std::sort(places.begin(), places.end());
  return places;
}

// The same particles as project keeps, whatever the chunks and the width.
TEST_P(Gather, LetsEverythingInViewPassAnEmptyMap) {
  const Particles particles = cloud(3000);
  for (const Camera& camera :
       {perspective_camera(101, 77), off_centre_camera(37, 120), orthographic_camera(90, 61)}) {
    const View view = make_view(camera, kRadius, kOrigin);
    const Projected expected =
        project_particles(view, {particles.x, particles.y, particles.z, {}, false, {}}, 5.0);
    for (const int width : {1, 8}) {
      Places at_once;
      for (const std::size_t chunk : {100000, 64, 63, 1}) {
        if (chunk == 1 && width == 1) continue;  // 3000 launches are enough
        use_width(width);
        const Places found = select(device_, view, particles, chunk, empty_map(device_, view, 5.0));
        ASSERT_EQ(found.size(), expected.size()) << chunk;
        EXPECT_GT(found.size(), 100u);
        if (at_once.empty()) at_once = found;
        EXPECT_EQ(found, at_once) << chunk;
      }
    }
  }
}

// The nearest depth of every cell, as single precision has it, from the places and depths that
// double precision gives: those within 1e-4 of a cell's edge are left out.
TEST_P(Gather, FindsTheNearestDepthOfEveryCell) {
  constexpr double kCell = 3, kBorder = 10;
  Particles particles = cloud(20000);
  const Camera camera = perspective_camera(100, 76);
  const View view = make_view(camera, kRadius, kOrigin);
  std::map<std::pair<int, int>, double> nearest;
  Particles kept;
  for (std::size_t i = 0; i < particles.size(); ++i) {
    const Vec3d eye = eye_from_world(view, {particles.x[i], particles.y[i], particles.z[i]});
    const PixelPosition at = project(view, eye);
    if (!std::isfinite(at.u) || eye.z > -1) continue;
    const double u = at.u / kCell + 4, v = at.v / kCell + 4;  // 4 cells of border: 12 pixels
    if (std::abs(u - std::round(u)) < 1e-4 || std::abs(v - std::round(v)) < 1e-4) continue;
    if (u < 1 || v < 1 || u > 41 || v > 33) continue;  // inside of the outermost cells
    add_position(kept, {particles.x[i], particles.y[i], particles.z[i]});
    double& depth = nearest.try_emplace({int(u), int(v)}, 1e30).first->second;
    depth = std::min(depth, -eye.z);
  }
  ASSERT_GT(nearest.size(), 500u);
  for (const int width : {1, 8})
    for (const std::size_t chunk : {63, 64, 100000}) {
      use_width(width);
      // A margin that reaches beyond the border; no cell is alone or a pore where all are looked at
      // as they are, so that only fronts and limits are compared.
      const FrontMap map = find_fronts(
          device_, view, *source_of(kept), chunk,
          {.cell = kCell, .border = kBorder, .margin = 500, .block = kCell, .reach = 7});
      ASSERT_EQ(map.border, 4);
      ASSERT_EQ(map.nx, 34 + 8);
      ASSERT_EQ(map.ny, 26 + 8);
      ASSERT_EQ(map.block, 1);
      for (const auto& [cell, depth] : nearest)
        EXPECT_NEAR(map.limit[static_cast<std::size_t>(cell.second) * map.nx + cell.first],
                    depth + 7, 2e-6 * depth);
    }
}

// A slope of particles behind which others lie: the layer is told at every angle.
TEST_P(Gather, TellsTheFrontLayerOfASlope) {
  const View view = make_view(orthographic_camera(160, 120), kRadius, {0, 0, 0});
  for (const double slope : {0.0, 0.5, 2.0}) {
    Particles particles;
    std::set<std::int64_t> front;
    Random random(5);
    // Layers 1.6 radii apart along the normal, spacing 2 radii along u and v.
    for (int layer = 0; layer < 4; ++layer)
      for (int j = -50; j <= 50; ++j)
        for (int i = -50; i <= 50; ++i) {
          const double x = 2 * i + random(-.2, .2), y = 2 * j + random(-.2, .2);
          const double back = 1.6 * layer + random(-.1, .1);
          const Vec3d eye{x, y, -400 - slope * x - back * std::sqrt(1 + slope * slope)};
          const Vec3d world = world_from_eye(view, eye);
          if (layer == 0) front.insert(static_cast<std::int64_t>(particles.size()));
          add_position(particles, world);
        }
    const double spacing = 2 * view.u_scale / view.w_row[3];
    const FrontMap map = find_fronts(
        device_, view, *source_of(particles), 1 << 14,
        {.cell = 1.5 * spacing, .margin = 4, .block = 6 * spacing, .reach = 1e4, .thickness = 0.8});
    int seen = 0, of_front = 0, wrong = 0;
    for (const auto& [place, is_seen] : select(device_, view, particles, 1 << 14, map)) {
      const bool is_front = front.contains(place);
      of_front += is_front;
      seen += is_front && is_seen;
      wrong += is_seen && !is_front;
    }
    EXPECT_GT(of_front, 1000);
    // Slopes are measured between cells that hold two particles or three of a layer.
    EXPECT_GT(seen, 0.8 * of_front) << slope;
    EXPECT_LT(wrong, 0.05 * seen) << slope;
  }
}

TEST_P(Gather, LimitsEndBehindTheFrontButNotAtGaps) {
  const View view = make_view(orthographic_camera(160, 120), kRadius, {0, 0, 0});
  Particles particles;
  const auto add = [&](double u, double v, double depth) {
    const Vec3d world = world_from_eye(view, point_at(view, u, v, depth));
    add_position(particles, world);
  };
  // The left half of the screen is full at depth 300 but for one cell; a particle behind
  // everywhere.
  for (int j = 0; j < 30; ++j)
    for (int i = 0; i < 20; ++i)
      if (i != 5 || j != 7) add(4 * i + 2, 4 * j + 2, 300);
  const std::size_t first_behind = particles.size();
  for (int i = 0; i < 40; ++i) add(4 * i + 2, 42, 400);
  const FrontMap map =
      find_fronts(device_, view, *source_of(particles), 100,
                  {.cell = 4, .margin = 1, .block = 8, .around = 16, .reach = 50, .thickness = 1});
  const Places found = select(device_, view, particles, 100, map);
  std::vector<std::int64_t> behind;
  for (const auto& [place, seen] : found)
    if (place >= static_cast<std::int64_t>(first_behind))
      behind.push_back(place - static_cast<std::int64_t>(first_behind));
  // Blocks are 8 pixels; those within 16 pixels of the empty half (u >= 80) have no limit: from
  // block 8 on, particle 16. The lone empty cell is none.
  std::vector<std::int64_t> expected;
  for (std::int64_t i = 16; i < 40; ++i) expected.push_back(i);
  EXPECT_EQ(behind, expected);
}

TEST(ChunkSize, FitsTheMemoryOrSaysWhatWould) {
  EXPECT_EQ(chunk_size(1000 + 16 * 6400, 1000), 6400u);
  EXPECT_EQ(chunk_size(1000 + 16 * 6463, 1000), 6400u);
  EXPECT_EQ(chunk_size(std::size_t{1} << 40, 0), std::size_t{1} << 20);
  EXPECT_EQ(chunk_size(16 * 64, 0), 64u);
  EXPECT_THAT(text_of_thrown<InvalidArgument>([&] { chunk_size(5000, 4000); }),
              testing::HasSubstr("memory is 5000 bytes, must be at least 5024"));
}

MENISCUS_ON_EVERY_DEVICE(Gather);

}  // namespace
}  // namespace meniscus
