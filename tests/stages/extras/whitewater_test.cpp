// Whitewater drawn over a surface's front, pixel by pixel against a plain loop over all particles,
// on every device; and what happens at the edges of what is given.
#include "meniscus/whitewater.hpp"

#include <gmock/gmock.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <numeric>

#include "meniscus/camera.hpp"
#include "same_bits.hpp"
#include "stages/stage_test_support.hpp"
#include "thrown.hpp"
#include "verify/stage_cases/whitewater.hpp"

namespace meniscus {
namespace {

using WhitewaterOn = OnDevice;
using testing::HasSubstr;

// A surface of this front, whose particles' radius is 1/4.
constexpr double kRadius = 0.25;
Surface surface_of(const Camera& camera, std::vector<float> depth) {
  Surface surface;
  surface.camera = camera;
  surface.particle_radius = kRadius;
  surface.depth = std::move(depth);
  return surface;
}

// A pixel is 1/4 wide, and depths and places are exact: the eye is at (0, 0, 16), looks down -z,
// and pixel (i, j) begins at x = i/4 - 4, y = 3 - j/4.
Camera exact_camera() {
  Camera camera = look_at({0, 0, 16}, {0, 0, 0}, {0, 1, 0}, 45, 32, 24);
  camera.projection = {0.25, 0, 0, 0, 0, 1.0 / 3, 0, 0, 0, 0, -1.0 / 8, -1.125, 0, 0, 0, 1};
  return camera;
}

Surface exact_surface(float depth) {
  const Camera camera = exact_camera();
  return surface_of(camera, std::vector<float>(static_cast<std::size_t>(camera.width) *
                                                   static_cast<std::size_t>(camera.height),
                                               depth));
}

void add(Particles& particles, double x, double y, double z, double radius, Vec3 velocity = {}) {
  add_position(particles, {x, y, z});
  particles.radius.push_back(static_cast<float>(radius));
  particles.vx.push_back(velocity.x);
  particles.vy.push_back(velocity.y);
  particles.vz.push_back(velocity.z);
}

// Draws particles of one type and returns its maps.
WhitewaterMaps drawn(Device& device, WhitewaterType type, const Particles& particles,
                     Surface& surface, const Parameters& params = {},
                     std::size_t memory = kStreamMemory) {
  const auto source = source_of(particles);
  draw_whitewater(device, {{.type = type, .particles = source.get()}}, params, surface, nullptr,
                  memory);
  EXPECT_EQ(surface.whitewater.size(), 1u);
  return surface.whitewater.at(0);
}

double sum_of(const std::vector<float>& values) {
  return std::accumulate(values.begin(), values.end(), 0.0);
}

// Drops of all sizes about a front with a step and holes, and with layers of water behind it.
struct Scene {
  Surface surface;
  Particles particles;
  std::vector<reference::Drop> drops;

  Scene(const Camera& camera, std::size_t count, bool layered) {
    const View view = make_view(camera, kRadius, {});
    std::vector<float> depth = patches(pixel_grid(view), 5);
    for (float& t : depth) t *= 0.4f;  // 8 and 15 world units away
    surface = surface_of(camera, depth);
    if (layered) {
      surface.layers.most = 1;
      for (const float t : depth) surface.layers.exit.push_back(t + 1.5f);
    }
    Random random(31);
    const auto exact = [&](double low, double high) {
      return double{static_cast<float>(random(low, high))};
    };
    for (std::size_t k = 0; k < count; ++k) {
      const double radius =
          double{static_cast<float>(k % 97 == 40 ? 1.5 : kRadius * std::exp2(random(-8, 0)))};
      const reference::Drop drop{{exact(-6, 6), exact(-6, 6), exact(-9, 11)},
                                 radius,
                                 {exact(-2, 2), exact(-2, 2), exact(-2, 2)}};
      drops.push_back(drop);
      add(particles, drop.at[0], drop.at[1], drop.at[2], radius, Vec3(drop.velocity));
    }
  }
};

// Occlusion, coverage, density, depth and velocity of every pixel. What a pixel shows is sure but
// where single precision decides about a particle within a few units of the last place.
void expect_as_plain_loop(Device& device, const Camera& camera, WhitewaterType type, bool layered) {
  Scene scene(camera, 3000, layered);
  const bool bubbles = type == WhitewaterType::bubble;
  const WhitewaterMaps maps = drawn(device, type, scene.particles, scene.surface);
  std::vector<double> from, to;
  for (std::size_t s = 0; s < scene.surface.depth.size(); ++s) {
    const double front = scene.surface.depth[s] / kRadius;
    from.push_back(bubbles ? front - 1 : 0);
    to.push_back(!bubbles ? front + 1 : layered ? scene.surface.layers.exit[s] / kRadius : 1e30);
  }
  const View view = make_view(camera, kRadius, {});
  const auto expected = reference::whitewater(camera, kRadius, view.near_depth, scene.drops, from,
                                              to, bubbles ? 1 : 0);
  std::size_t unsure = 0, covered = 0, empty = 0, depths = 0;
  verify::WhitewaterErrors errors;
  for (std::size_t s = 0; s < expected.size(); ++s) {
    const reference::WhitewaterPixel& e = expected[s];
    if (!e.sure) {
      ++unsure;
      continue;
    }
    ++(e.density > 0 ? covered : empty);
    depths += e.depth_is_sure();
    errors.see(maps, s, e, kRadius);
  }
  SCOPED_TRACE(to_string(type));
  expect_within(errors.all());
  EXPECT_LT(unsure, expected.size() / 100);
  EXPECT_GT(covered, expected.size() / 5);
  EXPECT_GT(empty, 0u);
  EXPECT_GT(depths, expected.size() / 2);
}

TEST_P(WhitewaterOn, IsThatOfAPlainLoopOverAllParticles) {
  for (const Camera& camera :
       {perspective_camera(83, 61), off_centre_camera(47, 52), orthographic_camera(64, 49)})
    for (const WhitewaterType type :
         {WhitewaterType::foam, WhitewaterType::spray, WhitewaterType::bubble})
      expect_as_plain_loop(device_, camera, type, false);
  expect_as_plain_loop(device_, perspective_camera(83, 61), WhitewaterType::bubble, true);
}

// A disc's shares add up to its area wherever it lies and however small it is.
TEST_P(WhitewaterOn, LosesNothingOfADisc) {
  for (const double half : {0.002, 0.03, 0.4, 1.7, 5.0}) {  // pixels
    for (int step = 0; step < 24; ++step) {
      Surface surface = exact_surface(kNoSurface);
      Particles particles;
      add(particles, 0.25 * step / 24, 0.25 * step / 17, 0, half / 4);
      const WhitewaterMaps maps = drawn(device_, WhitewaterType::spray, particles, surface);
      const double area = M_PI * half * half;
      // As share_error() of the reference, at up to 12 x 12 pixels; their errors cancel but for the
      // disc's own top and bottom.
      EXPECT_NEAR(sum_of(maps.density), area, 2e-6 * half * half * 12 + 150 * 0x1p-32);
    }
  }
}

TEST_P(WhitewaterOn, IsTheSameInAnyOrderAndInAnyChunks) {
  Scene scene(perspective_camera(83, 61), 3000, false);
  Surface surface = scene.surface;
  const WhitewaterMaps maps = drawn(device_, WhitewaterType::bubble, scene.particles, surface);
  Particles reversed = scene.particles;
  for (std::vector<float>* values : {&reversed.x, &reversed.y, &reversed.z, &reversed.radius,
                                     &reversed.vx, &reversed.vy, &reversed.vz})
    std::reverse(values->begin(), values->end());
  EXPECT_TRUE(same_bits(drawn(device_, WhitewaterType::bubble, reversed, surface), maps));
  EXPECT_TRUE(same_bits(
      drawn(device_, WhitewaterType::bubble, scene.particles, surface, {}, 28 * 64), maps));
  EXPECT_GT(sum_of(maps.coverage), 100);
}

// The front is at depth 16; a tolerance of one radius is 1/4.
TEST_P(WhitewaterOn, IsSeenUpToTheToleranceAndNotBeyond) {
  const auto seen = [&](WhitewaterType type, double behind) {
    Surface surface = exact_surface(16);
    Particles particles;
    add(particles, 0.125, 0.125, -behind, 0.0625);
    return sum_of(drawn(device_, type, particles, surface).density) > 0;
  };
  for (const WhitewaterType type : {WhitewaterType::foam, WhitewaterType::spray}) {
    EXPECT_TRUE(seen(type, 0));
    EXPECT_TRUE(seen(type, 0.25));
    EXPECT_FALSE(seen(type, 0.25 + 0x1p-18));
    EXPECT_TRUE(seen(type, -8));
  }
  EXPECT_TRUE(seen(WhitewaterType::bubble, 0));
  EXPECT_TRUE(seen(WhitewaterType::bubble, -0.25));
  EXPECT_FALSE(seen(WhitewaterType::bubble, -0.25 - 0x1p-18));
  EXPECT_TRUE(seen(WhitewaterType::bubble, 100));
}

TEST_P(WhitewaterOn, BubblesAreInTheWaterAlone) {
  Particles particles;
  add(particles, 0.125, 0.125, -2, 0.0625);  // in the middle of a pixel
  Surface nowhere = exact_surface(kNoSurface);
  EXPECT_EQ(sum_of(drawn(device_, WhitewaterType::bubble, particles, nowhere).density), 0);
  EXPECT_GT(sum_of(drawn(device_, WhitewaterType::foam, particles, nowhere).density), 0);
  for (const auto& [exit, is_seen] : {std::pair{18.0f, true}, {17.9999f, false}}) {
    Surface layered = exact_surface(16);
    layered.layers.most = 2;
    layered.layers.exit.assign(2 * layered.depth.size(), kNoSurface);
    std::fill_n(layered.layers.exit.begin(), layered.depth.size(), exit);
    const WhitewaterMaps maps = drawn(device_, WhitewaterType::bubble, particles, layered);
    EXPECT_EQ(sum_of(maps.density) > 0, is_seen);
    if (is_seen) {
      EXPECT_EQ(maps.behind[11 * 32 + 16], 2);
    }
  }
}

TEST_P(WhitewaterOn, CoversAsDiscsOverEachOtherByChance) {
  Particles particles;
  for (int k = 0; k < 5; ++k)
    add(particles, 0.125, 0.125, k, 0.0625, {1, static_cast<float>(k), 0});
  Surface surface = exact_surface(16);
  const WhitewaterMaps maps = drawn(device_, WhitewaterType::foam, particles, surface);
  const std::size_t pixel = 11 * 32 + 16;
  const double share = M_PI / 16;  // a disc of a quarter of a pixel
  EXPECT_NEAR(maps.density[pixel], 5 * share, 5e-6);
  EXPECT_NEAR(maps.coverage[pixel], 1 - std::pow(1 - share, 5), 5e-6);
  EXPECT_EQ(maps.depth[pixel], 12);
  EXPECT_NEAR(maps.velocity[pixel].x, 1, 1e-6);
  EXPECT_NEAR(maps.velocity[pixel].y, 2, 1e-5);
  EXPECT_EQ(maps.velocity[0], Vec3());
  EXPECT_TRUE(std::isinf(maps.depth[0]));
  EXPECT_TRUE(maps.behind.empty());
}

TEST_P(WhitewaterOn, LeavesOutWhatIsNotInView) {
  Particles particles;
  add(particles, 0, 0, 16, 1);        // at the eye
  add(particles, 0, 0, 40, 1);        // behind it
  add(particles, 100, 0, 0, 1);       // beside the screen
  add(particles, 0, -1e30, 0, 1);     // far away
  add(particles, 0, 0, 3e38, 1e-30);  // farther
  add(particles, 1, 1, 0, 1e-20);     // smaller than sums can tell
  Surface surface = exact_surface(20);
  const WhitewaterMaps maps = drawn(device_, WhitewaterType::foam, particles, surface);
  EXPECT_EQ(sum_of(maps.density), 0);
  EXPECT_EQ(surface.counts.whitewater, 6);
  EXPECT_TRUE(std::all_of(maps.depth.begin(), maps.depth.end(),
                          [](float depth) { return std::isinf(depth); }));
}

TEST_P(WhitewaterOn, CoversTheScreenWhereADiscIsLarger) {
  Particles particles;
  add(particles, 0, 0, 0, 1000);
  Surface surface = exact_surface(20);
  surface.particle_radius = 100;  // discs of foam are not much larger than the water's
  const WhitewaterMaps maps = drawn(device_, WhitewaterType::foam, particles, surface);
  for (std::size_t s = 0; s < maps.density.size(); ++s) {
    EXPECT_EQ(maps.density[s], 1);
    EXPECT_EQ(maps.coverage[s], 1);
  }
}

TEST_P(WhitewaterOn, SaysWhatIsNotFiniteAndDoesWithout) {
  Particles particles;
  add(particles, 0.125, 0.125, 0, 0.0625, {1, 2, 3});
  add(particles, NAN, 0, 0, 0.0625);
  add(particles, 0, INFINITY, 0, 0.0625);
  add(particles, 2.125, 0.125, 0, 0.0625, {NAN, 0, 0});
  Surface surface = exact_surface(20);
  const WhitewaterMaps maps = drawn(device_, WhitewaterType::spray, particles, surface);
  EXPECT_NEAR(sum_of(maps.density), 2 * M_PI / 16, 1e-5);
  EXPECT_EQ(surface.counts.whitewater, 2);
  ASSERT_EQ(surface.notices.size(), 2u);
  EXPECT_EQ(surface.notices[0].code, Code::not_finite);
  EXPECT_EQ(
      to_string(surface.notices[0]),
      "spray: 2 of 4 particles have NaN or infinite coordinates (the first is particle 1) and "
      "were dropped");
  EXPECT_EQ(surface.notices[1].code, Code::bad_velocities);
  EXPECT_NEAR(maps.velocity[11 * 32 + 16].z, 3, 1e-5);
  EXPECT_EQ(maps.velocity[11 * 32 + 24], Vec3());
  Parameters strict;
  strict.strict = true;
  EXPECT_THROW(drawn(device_, WhitewaterType::spray, particles, surface, strict), InputError);
}

// A step of velocity is 1/4 here.
TEST_P(WhitewaterOn, CountsVelocitiesAndDepthsUpToTheirMost) {
  Particles particles;
  add(particles, 0.125, 0.125, -1e7, 0.0625, {1e12f, -1e12f, 7});
  Surface surface = exact_surface(16);
  const WhitewaterMaps maps = drawn(device_, WhitewaterType::bubble, particles, surface);
  const float most = records::kWhitewaterMost / 4;
  const Vec3 velocity = maps.velocity[11 * 32 + 16];
  EXPECT_NEAR(velocity.x / most, 1, 1e-6);
  EXPECT_NEAR(velocity.y / most, -1, 1e-6);
  EXPECT_NEAR(velocity.z, 7, 1e-4);
  EXPECT_NEAR(maps.behind[11 * 32 + 16] / (records::kWhitewaterMost * kRadius), 1, 1e-6);
}

TEST_P(WhitewaterOn, TakesTheRadiusThatIsGivenStatedOrAShareOfTheWaters) {
  const auto area = [&](double given, double own, double stated) {
    Particles particles;
    add(particles, 0.125, 0.125, 0, own);
    if (!(own > 0)) particles.radius.clear();
    particles.particle_radius = stated;
    Parameters params;
    params.whitewater.radius = given;
    Surface surface = exact_surface(20);
    return sum_of(drawn(device_, WhitewaterType::foam, particles, surface, params).density) / M_PI;
  };
  // In pixels, a pixel is 1/4.
  EXPECT_NEAR(area(0.125, 0.0625, 0.03125), 0.25, 1e-5);
  EXPECT_NEAR(area(0, 0.0625, 0.03125), 0.0625, 1e-5);
  EXPECT_NEAR(area(0, 0, 0.125), 0.25, 1e-5);
  EXPECT_NEAR(area(0, 0, 0), 0.0625, 1e-5);  // a quarter of 1/4
}

TEST_P(WhitewaterOn, DrawsEachTypeAndParticlesOfOneValue) {
  Particles particles;
  for (int k = 0; k < 6; ++k) add(particles, 0.25 * k + 0.125, 0.125, 0, 0.0625);
  particles.attributes = {{"other", std::vector<float>(6)}, {"type", {1, 0, 2, 1, 1, 7}}};
  const auto source = source_of(particles), none = source_of(Particles{});
  Surface surface = exact_surface(16);
  draw_whitewater(device_,
                  {{WhitewaterType::bubble, none.get()},
                   {WhitewaterType::foam, source.get(), "type", 1},
                   {WhitewaterType::spray, source.get(), "type", 0}},
                  {}, surface);
  ASSERT_EQ(surface.whitewater.size(), 3u);
  EXPECT_EQ(surface.whitewater[0].type, WhitewaterType::foam);
  EXPECT_EQ(surface.whitewater[1].type, WhitewaterType::spray);
  EXPECT_EQ(surface.whitewater[2].type, WhitewaterType::bubble);
  EXPECT_NEAR(sum_of(surface.whitewater[0].density), 3 * M_PI / 16, 1e-5);
  EXPECT_NEAR(sum_of(surface.whitewater[1].density), M_PI / 16, 1e-5);
  EXPECT_EQ(sum_of(surface.whitewater[2].density), 0);
  EXPECT_TRUE(surface.whitewater[2].velocity.empty());
  EXPECT_EQ(surface.counts.whitewater, 4);
}

template <class Thrown>
void expect_refused(const std::string& why, const std::function<void()>& work) {
  EXPECT_THAT(text_of_thrown<Thrown>([&] { work(); }), HasSubstr(why));
}

TEST_P(WhitewaterOn, RefusesWhatItCannotDraw) {
  Particles particles;
  add(particles, 0, 0, 0, 1);
  const auto source = source_of(particles);
  Surface surface = exact_surface(16);
  const auto draw = [&](const std::vector<WhitewaterSource>& sources) {
    draw_whitewater(device_, sources, {}, surface);
  };
  const WhitewaterSource foam{WhitewaterType::foam, source.get()};
  expect_refused<InvalidArgument>("foam is given twice", [&] { draw({foam, foam}); });
  expect_refused<InvalidArgument>("foam has no particles", [&] { draw({{}}); });
  expect_refused<InputError>("foam: has no attribute type", [&] {
    draw({{WhitewaterType::foam, source.get(), "type", 1}});
  });
  Particles flat = particles;
  flat.radius = {0};
  const auto bad = source_of(flat);
  expect_refused<InputError>(
      "foam: particle 0: radius is 0, must be > 0 and finite (give "
      "whitewater_radius to override)",
      [&] {
        draw({{WhitewaterType::foam, bad.get()}});
      });
  Particles millimetres = particles;
  millimetres.radius = {static_cast<float>(250 * kRadius)};
  const auto large = source_of(millimetres);
  expect_refused<InputError>("must be at most 16 times the water's", [&] {
    draw({{WhitewaterType::foam, large.get()}});
  });
  surface.depth.pop_back();
  expect_refused<InvalidArgument>("767 depths for 768 pixels", [&] { draw({foam}); });
  surface = exact_surface(16);
  surface.particle_radius = 0;
  expect_refused<InvalidArgument>("particle radius is 0", [&] { draw({foam}); });
  expect_refused<InvalidArgument>("type is mist", [] { whitewater_named("mist"); });
}

MENISCUS_ON_EVERY_DEVICE(WhitewaterOn);

}  // namespace
}  // namespace meniscus
