// The way back to world space, held against the camera's own matrices.
#include "to_world.hpp"

#include <gmock/gmock.h>

#include "stages/stage_test_support.hpp"

namespace meniscus {
namespace {

using testing::ElementsAre;
using testing::IsEmpty;

constexpr double kRadius = 0.05;

// Every third sample is empty; the others have depths, turned normals and groups.
Extraction made_up(int width, int height) {
  Extraction made;
  made.image.grid = {width, height, 0.5f, 1.0f};
  Random random(2);
  for (int s = 0; s < width * height; ++s) {
    const bool there = s % 3 != 0;
    made.image.depth.push_back(there ? static_cast<float>(random(100, 250)) : kNoSurface);
    made.image.normal.push_back(there ? Vec3{0.6f, 0, 0.8f} : Vec3{});
    made.image.group.push_back(there ? s % 5 - 1 : -1);
    made.image.kind.push_back(there ? Kind::surface : Kind::none);
  }
  made.residual = {0.25f, -1, 2, 3};
  return made;
}

Surface returned(const Camera& camera, int width, int height) {
  const View view = make_view(camera, kRadius, {1, -2, 0.5});
  return to_world(view, made_up(width, height), {}, {});
}

TEST(ToWorld, PositionsLieAtTheirPixelsAndDepths) {
  constexpr int kWidth = 37, kHeight = 81;  // more rows than a thread takes at a time
  const Camera camera = perspective_camera(kWidth, kHeight);
  const Surface surface = returned(camera, kWidth, kHeight);
  const Extraction made = made_up(kWidth, kHeight);
  for (int s = 0; s < kWidth * kHeight; ++s) {
    if (s % 3 == 0) {
      EXPECT_EQ(surface.depth[s], kNoSurface);
      EXPECT_EQ(surface.position[s], Vec3{});
      EXPECT_EQ(surface.normal[s], Vec3{});
      EXPECT_EQ(surface.group[s], 0u);
      EXPECT_EQ(surface.kind[s], Kind::none);
      EXPECT_EQ(surface.residual[s], 0);
      continue;
    }
    EXPECT_EQ(surface.depth[s], static_cast<float>(made.image.depth[s] * kRadius));
    const Vec3d p(surface.position[s]);
    const auto row = [&](const std::array<double, 16>& m, int r, const Vec3d& x) {
      return m[4 * r] * x.x + m[4 * r + 1] * x.y + m[4 * r + 2] * x.z + m[4 * r + 3];
    };
    const Vec3d eye{row(camera.view, 0, p), row(camera.view, 1, p), row(camera.view, 2, p)};
    const double w = row(camera.projection, 3, eye);
    const double u = (row(camera.projection, 0, eye) / w + 1) / 2 * kWidth;
    const double v = (1 - row(camera.projection, 1, eye) / w) / 2 * kHeight;
    // Positions are floats of at most 16: each is off by 2^-21 at most, 1e-6 over three axes; at 5
    // from a camera with a field of view of 45 degrees a unit is at most 20 pixels.
    EXPECT_NEAR(-eye.z, made.image.depth[s] * kRadius, 1e-6);
    EXPECT_NEAR(u, s % kWidth + 0.5, 20e-6);
    EXPECT_NEAR(v, s / kWidth + 0.5, 20e-6);
    // The normal in eye space again.
    const Vec3d n(surface.normal[s]);
    for (int r = 0; r < 3; ++r)
      EXPECT_NEAR(row(camera.view, r, n) - camera.view[4 * r + 3],
                  (r == 0   ? 0.6
                   : r == 1 ? 0
                            : 0.8),
                  4 * kEpsilon);
  }
}

TEST(ToWorld, GroupsAreCountedFromOneAndHaveTheirResiduals) {
  const Surface surface = returned(perspective_camera(5, 3), 5, 3);
  EXPECT_THAT(surface.group, ElementsAre(0, 1, 2, 0, 4, 0, 0, 2, 3, 0, 0, 1, 0, 3, 4));
  EXPECT_THAT(surface.residual, ElementsAre(0, 0.25f, 0, 0, 3, 0, 0, 0, 2, 0, 0, 0.25f, 0, 2, 3));
}

TEST(ToWorld, SaysHowManyPixelsThereAreAndWhenNothingIsInView) {
  const View view = make_view(perspective_camera(5, 3), kRadius, {0, 0, 0});
  Extraction made = made_up(5, 3);
  made.counts = {{"particles", 7}, {"in view", 7}};
  Surface surface = to_world(view, made, {}, {});
  EXPECT_EQ(surface.counts.back(), (std::pair<std::string, std::int64_t>{"pixels", 10}));
  EXPECT_THAT(surface.warnings, IsEmpty());
  made.counts = {{"particles", 7}, {"in view", 0}};
  EXPECT_THAT(to_world(view, made, {}, {}).warnings,
              ElementsAre("no particle is in view: the surface is empty"));
  made.counts = {{"particles", 0}, {"in view", 0}};
  EXPECT_THAT(to_world(view, made, {}, {}).warnings,
              ElementsAre("there are no particles: the surface is empty"));
}

TEST(ToWorld, WithoutAnImageThereAreNoMaps) {
  const View view = make_view(perspective_camera(5, 3), kRadius, {0, 0, 0});
  Extraction made;
  made.mesh.position = {{1, 2, 3}};
  Parameters params;
  params.image = false;
  const Surface surface = to_world(view, made, {}, params);
  EXPECT_TRUE(surface.depth.empty());
  EXPECT_TRUE(surface.position.empty());
  EXPECT_EQ(surface.mesh.position.size(), 1u);
  EXPECT_THAT(surface.counts, IsEmpty());
}

}  // namespace
}  // namespace meniscus
