// The way back to world space, held against the camera's own matrices.
#include "output/to_world.hpp"

#include <gmock/gmock.h>

#include "stages/stage_test_support.hpp"
#include "texts.hpp"

namespace meniscus {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;

constexpr double kRadius = 0.05;

// Every third sample is empty; the others have depths, turned normals and groups.
SurfaceMap made_up(int width, int height) {
  SurfaceMap image;
  image.grid = {width, height, 0.5f, 1.0f};
  Random random(2);
  for (int s = 0; s < width * height; ++s) {
    const bool there = s % 3 != 0;
    image.depth.push_back(there ? static_cast<float>(random(100, 250)) : kNoSurface);
    image.normal.push_back(there ? Vec3{0.6f, 0, 0.8f} : Vec3{});
    image.group.push_back(there ? s % 5 - 1 : -1);
    image.kind.push_back(there ? s % 2 == 0 ? Kind::surface : Kind::splash : Kind::none);
  }
  return image;
}

class ToWorld : public OnDevice {
 protected:
  Extraction extraction(int width, int height) {
    Extraction made;
    made.image = upload(device_, made_up(width, height));
    made.residual = {0.25f, -1, 2, 3};
    return made;
  }
  Surface returned(const Camera& camera, const Extraction& made, const Parameters& params = {}) {
    const View view = make_view(camera, kRadius, {1, -2, 0.5});
    Notices notices;
    Surface surface = to_world(device_, view, made, {}, params, notices, nullptr);
    surface.notices = notices.all();
    return surface;
  }
};
MENISCUS_ON_EVERY_DEVICE(ToWorld);

TEST_P(ToWorld, PositionsLieAtTheirPixelsAndDepths) {
  constexpr int kWidth = 37, kHeight = 81;  // more rows than a thread takes at a time
  const Camera camera = perspective_camera(kWidth, kHeight);
  const Surface surface = returned(camera, extraction(kWidth, kHeight));
  const SurfaceMap image = made_up(kWidth, kHeight);
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
    EXPECT_EQ(surface.kind[s], image.kind[s]);
    EXPECT_EQ(surface.depth[s], static_cast<float>(image.depth[s] * kRadius));
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
    EXPECT_NEAR(-eye.z, image.depth[s] * kRadius, 1e-6);
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

TEST_P(ToWorld, GroupsAreCountedFromOneAndHaveTheirResiduals) {
  const Surface surface = returned(perspective_camera(5, 3), extraction(5, 3));
  EXPECT_THAT(surface.group, ElementsAre(0, 1, 2, 0, 4, 0, 0, 2, 3, 0, 0, 1, 0, 3, 4));
  EXPECT_THAT(surface.residual, ElementsAre(0, 0.25f, 0, 0, 3, 0, 0, 0, 2, 0, 0, 0.25f, 0, 2, 3));
}

TEST_P(ToWorld, WithoutGroupsAndKindsAllIsSurface) {
  Extraction made = extraction(5, 3);
  made.image.group = {};
  made.image.kind = {};
  const Surface surface = returned(perspective_camera(5, 3), made);
  for (std::size_t s = 0; s < surface.kind.size(); ++s) {
    EXPECT_EQ(surface.kind[s], s % 3 != 0 ? Kind::surface : Kind::none);
    EXPECT_EQ(surface.group[s], 0u);
    EXPECT_EQ(surface.residual[s], 0);
  }
}

TEST_P(ToWorld, SaysHowManyPixelsThereAreAndWhenNothingIsInView) {
  const Camera camera = perspective_camera(5, 3);
  Extraction made = extraction(5, 3);
  made.counts = {.particles = 7, .in_view = 7};
  Surface surface = returned(camera, made);
  EXPECT_EQ(surface.counts.pixels, 10);
  EXPECT_EQ(surface.counts.in_view, 7);
  EXPECT_EQ(surface.counts.splash, -1);
  EXPECT_THAT(texts(surface.notices), IsEmpty());
  made.counts = {.particles = 7, .in_view = 0};
  EXPECT_THAT(texts(returned(camera, made).notices),
              ElementsAre("no particle is in view: the surface is empty (check where the camera is "
                          "and looks)"));
  made.counts = {.particles = 0, .in_view = 0};
  EXPECT_THAT(texts(returned(camera, made).notices),
              ElementsAre("there are no particles: the surface is empty"));
  made.counts = {.particles = 7, .in_view = 5};
  SurfaceMap nothing = made_up(5, 3);
  nothing.depth.assign(nothing.depth.size(), kNoSurface);
  made.image = upload(device_, nothing);
  EXPECT_THAT(
      texts(returned(camera, made).notices),
      ElementsAre(HasSubstr("no pixel shows the particles in view (5): the surface is empty")));
}

TEST_P(ToWorld, MakesTheMapsThatAreAskedForAndNoOthers) {
  const Camera camera = perspective_camera(37, 81);
  const Extraction made = extraction(37, 81);
  const Surface all = returned(camera, made);
  const auto some = [&](const std::string& list) {
    Parameters params;
    params.aovs = aovs_named(list);
    const Surface surface = returned(camera, made, params);
    EXPECT_EQ(surface.depth, all.depth);
    EXPECT_EQ(surface.counts, all.counts);
    return surface;
  };
  const Surface normals = some("N"), ids = some("id,P"), rest = some("residual,kind"),
                none = some("");
  EXPECT_EQ(normals.normal, all.normal);
  EXPECT_THAT(normals.position, IsEmpty());
  EXPECT_THAT(normals.group, IsEmpty());
  EXPECT_THAT(normals.kind, IsEmpty());
  EXPECT_THAT(normals.residual, IsEmpty());
  EXPECT_EQ(ids.group, all.group);
  EXPECT_EQ(ids.position, all.position);
  EXPECT_THAT(ids.normal, IsEmpty());
  EXPECT_EQ(rest.residual, all.residual);
  EXPECT_EQ(rest.kind, all.kind);
  EXPECT_THAT(rest.position, IsEmpty());
  EXPECT_THAT(none.normal, IsEmpty());
}

TEST_P(ToWorld, WithoutAnImageThereAreNoMaps) {
  Extraction made;
  made.mesh.position = {{1, 2, 3}};
  Parameters params;
  params.image = false;
  const Surface surface = returned(perspective_camera(5, 3), made, params);
  EXPECT_TRUE(surface.depth.empty());
  EXPECT_TRUE(surface.position.empty());
  EXPECT_EQ(surface.mesh.position.size(), 1u);
  EXPECT_EQ(surface.counts, Counts{});
}

}  // namespace
}  // namespace meniscus
