// The camera as the stages use it, against the matrices it was made from.
#include "stages/view.hpp"

#include "stages/stage_test_support.hpp"

namespace meniscus {
namespace {

struct Case {
  const char* name;
  Camera camera;

  friend void PrintTo(const Case& test, std::ostream* out) { *out << test.name; }
};

class ViewTest : public testing::TestWithParam<Case> {
 protected:
  const Camera camera_ = GetParam().camera;
  const std::array<double, 3> origin_{0.25, -1.5, 0.75};
  const View view_ = make_view(camera_, 0.3, origin_);
};

// clip = projection * view * x.
std::array<double, 4> clip_of(const Camera& camera, const Vec3d& world) {
  const std::array<double, 4> x{world.x, world.y, world.z, 1};
  std::array<double, 4> eye{}, clip{};
  for (int r = 0; r < 4; ++r)
    for (int c = 0; c < 4; ++c) eye[r] += camera.view[r * 4 + c] * x[c];
  for (int r = 0; r < 4; ++r)
    for (int c = 0; c < 4; ++c) clip[r] += camera.projection[r * 4 + c] * eye[c];
  return clip;
}

// All arithmetic is in double: a handful of roundings of numbers up to a few hundred.
constexpr double kTolerance = 1e-10;

TEST_P(ViewTest, ProjectsAsTheMatricesDo) {
  Random random(1);
  for (int k = 0; k < 50; ++k) {
    const Vec3d world{random(-2, 2), random(-2, 2), random(-2, 2)};
    const auto clip = clip_of(camera_, world);
    const PixelPosition at = project(view_, eye_from_world(view_, world));
    EXPECT_NEAR(at.u, (clip[0] / clip[3] + 1) / 2 * camera_.width, kTolerance);
    EXPECT_NEAR(at.v, (1 - clip[1] / clip[3]) / 2 * camera_.height, kTolerance);
    EXPECT_NEAR(at.w, clip[3], kTolerance);
  }
}

TEST_P(ViewTest, PointAtIsTheInverseOfProject) {
  Random random(2);
  for (int k = 0; k < 50; ++k) {
    const double u = random(-10, 110), v = random(-10, 90), t = random(5, 60);
    const Vec3d eye = point_at(view_, u, v, t);
    EXPECT_DOUBLE_EQ(eye.z, -t);
    const PixelPosition at = project(view_, eye);
    EXPECT_NEAR(at.u, u, kTolerance);
    EXPECT_NEAR(at.v, v, kTolerance);
  }
}

TEST_P(ViewTest, RayDirectionIsTheChangeOfThePointWithDepth) {
  const Vec3d step = point_at(view_, 33, 21, 31) - point_at(view_, 33, 21, 30);
  const Vec3d direction = ray_direction(view_, 33, 21);
  EXPECT_NEAR(length(step - direction), 0, kTolerance);
}

TEST_P(ViewTest, WorldAndEyeAreInverse) {
  Random random(3);
  for (int k = 0; k < 20; ++k) {
    const Vec3d world{random(-5, 5), random(-5, 5), random(-5, 5)};
    EXPECT_NEAR(length(world_from_eye(view_, eye_from_world(view_, world)) - world), 0, kTolerance);
  }
}

TEST_P(ViewTest, DirectionsTurnWithTheView) {
  const Vec3d a = world_from_eye(view_, {1, 2, -20}), b = world_from_eye(view_, {4, -2, -21});
  const Vec3d turned = world_direction(view_, Vec3d{4, -2, -21} - Vec3d{1, 2, -20});
  EXPECT_NEAR(length((b - a) / view_.radius - turned), 0, kTolerance);
}

TEST_P(ViewTest, AParticlesRadiusSpansAsManyPixelsAtTheDepthThatIsToldForThem) {
  const double scale = std::min(view_.u_scale, view_.v_scale);
  if (view_.orthographic) {
    const double span = scale / project(view_, {0, 0, -9}).w;
    EXPECT_EQ(depth_of_radius(view_, 0.99 * span), INFINITY);
    EXPECT_EQ(depth_of_radius(view_, 1.01 * span), 0);
    return;
  }
  for (const double pixels : {0.5, 2.0, 7.0})
    EXPECT_NEAR(scale / project(view_, {0, 0, -depth_of_radius(view_, pixels)}).w, pixels,
                kTolerance);
}

TEST_P(ViewTest, ParticlesOnTheNearPlaneAreAtNearDepth) {
  // The near plane is clip z = -w.
  const Vec3d world = world_from_eye(view_, {0, 0, -view_.near_depth});
  const auto clip = clip_of(camera_, world);
  EXPECT_NEAR(clip[2], -clip[3], kTolerance);
}

TEST_P(ViewTest, ACoarserOneIsThatOfALargerRadius) {
  const View coarse = coarser(view_, 1.4), expected = make_view(camera_, 1.4 * 0.3, origin_);
  EXPECT_NEAR(coarse.near_depth, expected.near_depth, kTolerance);
  EXPECT_NEAR(coarse.u_scale, expected.u_scale, kTolerance);
  EXPECT_NEAR(coarse.v_scale, expected.v_scale, kTolerance);
  EXPECT_FLOAT_EQ(world_depth(coarse, 10), world_depth(expected, 10));
  Random random(7);
  for (int k = 0; k < 50; ++k) {
    const Vec3d world{random(-2, 2), random(-2, 2), random(-2, 2)};
    const Vec3d eye = eye_from_world(expected, world);
    EXPECT_LE(length(eye_from_world(coarse, world) - eye), kTolerance);
    const PixelPosition at = project(coarse, eye), wanted = project(expected, eye);
    EXPECT_NEAR(at.u, wanted.u, kTolerance);
    EXPECT_NEAR(at.v, wanted.v, kTolerance);
    EXPECT_NEAR(at.w, wanted.w, kTolerance);
    const double u = random(-10, 110), v = random(-10, 90), t = random(5, 60);
    EXPECT_LE(length(point_at(coarse, u, v, t) - point_at(expected, u, v, t)), 1e-9);
    EXPECT_LE(length(world_from_eye(coarse, eye) - world), kTolerance);
  }
}

INSTANTIATE_TEST_SUITE_P(Cameras, ViewTest,
                         testing::Values(Case{"Perspective", perspective_camera(101, 77)},
                                         Case{"OffCentre", off_centre_camera(101, 77)},
                                         Case{"Orthographic", orthographic_camera(101, 77)}),
                         [](const testing::TestParamInfo<Case>& test) { return test.param.name; });

TEST(View, KnowsPerspectiveFromOrthographic) {
  EXPECT_FALSE(make_view(perspective_camera(8, 8), 1, {}).orthographic);
  EXPECT_TRUE(make_view(orthographic_camera(8, 8), 1, {}).orthographic);
}

TEST(View, ScaleIsWhatALengthSpansOnTheScreen) {
  // Parallel to the screen and in the middle of it, a length l spans l u_scale / w pixels.
  const View view = make_view(perspective_camera(101, 77), 0.3, {});
  const Vec3d a = point_at(view, 50.5, 38.5, 25);
  const PixelPosition right = project(view, a + Vec3d{0.5, 0, 0});
  const PixelPosition up = project(view, a + Vec3d{0, 0.5, 0});
  EXPECT_NEAR(right.u - 50.5, 0.5 * view.u_scale / right.w, kTolerance);
  EXPECT_NEAR(38.5 - up.v, 0.5 * view.v_scale / up.w, kTolerance);
}

}  // namespace
}  // namespace meniscus
