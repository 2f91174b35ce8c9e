// Where the device's coordinates begin, and that a particle far away does not spoil the others.
#include "prepare/origin.hpp"

#include <gmock/gmock.h>

#include <cfloat>
#include <cmath>

#include "meniscus/device.hpp"
#include "meniscus/extract.hpp"
#include "stages/vec.hpp"
#include "texts.hpp"

namespace meniscus {
namespace {

using Sample = std::vector<std::array<float, 3>>;
using Point = std::array<double, 3>;

Sample row(int count) {
  Sample sample;
  for (int k = 0; k < count; ++k) sample.push_back({static_cast<float>(k), 0, 5});
  return sample;
}

TEST(Origin, IsWarnedOfWhereFloatsAreTooCoarseForTheParticles) {
  // A tenth of the radius, .005, is a step of floats from .005 / 2^-23 = 41,943 on.
  const auto warnings = [](double x) {
    Notices notices;
    warn_of_coarse_positions(make_world_view(0.05, {0, -x, 1}), 0.05, notices);
    return texts(notices.all());
  };
  EXPECT_THAT(warnings(41'900), testing::IsEmpty());
  EXPECT_THAT(warnings(42'000),
              testing::ElementsAre(testing::HasSubstr("the particles lie 42000 from the origin")));
}

TEST(Origin, IsTheMiddleOfTheBounds) {
  EXPECT_EQ(origin_of({0, -2, 5}, {10, 8, 6}, {}), (Point{5, 3, 5.5}));
  EXPECT_EQ(origin_of({-30, -1, 5}, {70, 1, 5}, {}), (Point{20, 0, 5}));
  EXPECT_EQ(origin_of({0, 0, 5}, {99, 0, 5}, row(100)), (Point{49.5, 0, 5}));
}

TEST(Origin, IsTheMiddleOfTheBulkWhereStraysWidenTheBounds) {
  for (const float far : {1e5f, 1e20f, FLT_MAX})
    EXPECT_EQ(origin_of({0, 0, 5}, {far, 0, far}, row(100)), (Point{49.5, 0, 5})) << far;
  EXPECT_EQ(origin_of({-FLT_MAX, 0, 5}, {FLT_MAX, 0, 5}, row(100)), (Point{49.5, 0, 5}));
  // A spray three times as wide as the bulk is none.
  EXPECT_EQ(origin_of({0, 0, 5}, {300, 0, 5}, row(100)), (Point{150, 0, 5}));
}

TEST(Origin, LeavesTheSurfaceAloneWhenAParticleIsThrownOut) {
  Particles particles;
  particles.particle_radius = 0.05;
  for (int k = 0; k < 8; ++k)
    for (int j = 0; j < 10; ++j)
      for (int i = 0; i < 12; ++i)
        add_position(particles, {0.1f * static_cast<float>(i) + 0.01f * static_cast<float>(j % 3),
                                 0.1f * static_cast<float>(j), 0.1f * static_cast<float>(k)});
  const Camera camera = look_at({2.2, 1.8, 2.6}, {0.6, 0.5, 0.4}, {0, 1, 0}, 35, 120, 90);
  Device device;
  for (const Method method : {Method::fit, Method::ssm}) {
    Parameters parameters;
    parameters.method = method;
    const Surface before = extract(device, particles, camera, parameters);
    Particles thrown = particles;  // behind the camera
    for (std::vector<float>* axis : {&thrown.x, &thrown.y, &thrown.z}) axis->push_back(1e30f);
    const Surface after = extract(device, thrown, camera, parameters);
    std::size_t covered = 0, others = 0;
    for (std::size_t k = 0; k < before.depth.size(); ++k) {
      covered += std::isfinite(before.depth[k]);
      others += std::isfinite(before.depth[k]) != std::isfinite(after.depth[k]) ||
                std::abs(before.depth[k] - after.depth[k]) > 1e-3f * 0.05f;
    }
    EXPECT_GT(covered, 1000u);
    EXPECT_LE(others, covered / 1000) << to_string(method);  // pixels on which a rounding decides
  }
}

}  // namespace
}  // namespace meniscus
