// Where the surface goes on the screen, held against the cameras' own matrices.
#include <gmock/gmock.h>

#include <Eigen/Dense>
#include <cmath>

#include "meniscus/error.hpp"
#include "meniscus/motion.hpp"
#include "stages/stage_test_support.hpp"
#include "thrown.hpp"

namespace meniscus {
namespace {

using Matrix = Eigen::Matrix<double, 4, 4, Eigen::RowMajor>;

Matrix matrix(const std::array<double, 16>& values) {
  return Eigen::Map<const Matrix>(values.data());
}

// Pixel coordinates as fractions of the image.
Eigen::Vector2d screen(const Camera& camera, const Eigen::Vector3d& world) {
  const Eigen::Vector4d clip =
      matrix(camera.projection) * matrix(camera.view) * world.homogeneous();
  return {(1 + clip.x() / clip.w()) / 2, (1 - clip.y() / clip.w()) / 2};
}

// The point at `depth` along the camera's axis that is seen at the fractions (a, b).
Eigen::Vector3d point_seen(const Camera& camera, double a, double b, double depth) {
  const Matrix p = matrix(camera.projection);
  // (row 0 - x row 3) (ex, ey, -depth, 1) = 0, and alike for y.
  const double x = 2 * a - 1, y = 1 - 2 * b;
  const Eigen::RowVector4d u = p.row(0) - x * p.row(3), v = p.row(1) - y * p.row(3);
  Eigen::Matrix2d left;
  left << u[0], u[1], v[0], v[1];
  const Eigen::Vector2d e =
      left.inverse() * Eigen::Vector2d(u[2] * depth - u[3], v[2] * depth - v[3]);
  return (matrix(camera.view).inverse() * Eigen::Vector4d(e.x(), e.y(), -depth, 1)).hnormalized();
}

// Every fifth pixel is empty.
Surface made_up(const Camera& camera, double speed) {
  Surface surface;
  surface.camera = camera;
  surface.particle_radius = 0.05;
  Random random(3);
  for (int s = 0; s < camera.width * camera.height; ++s) {
    surface.depth.push_back(s % 5 == 0 ? INFINITY : static_cast<float>(random(6, 14)));
    const auto component = [&] { return static_cast<float>(random(-speed, speed)); };
    surface.velocity.push_back({component(), component(), component()});
  }
  return surface;
}

TEST(ScreenMotion, IsWhatProjectingByHandGives) {
  constexpr int kWidth = 37, kHeight = 41;  // more rows than a thread takes at a time
  const Camera moved = look_at({3.3, 1.8, 9.4}, {0.2, -0.1, 0.3}, {0.1, 1, 0}, 43, kWidth, kHeight);
  for (const Camera& camera :
       {perspective_camera(kWidth, kHeight), off_centre_camera(kWidth, kHeight),
        orthographic_camera(kWidth, kHeight)}) {
    const Surface surface = made_up(camera, 20);
    for (const Camera& next : {camera, moved, orthographic_camera(kWidth, kHeight),
                               perspective_camera(2 * kWidth, 3 * kHeight)}) {
      const ScreenMotion motion = screen_motion(surface, next, 25);
      EXPECT_EQ(motion.frames_per_second, 25);
      ASSERT_EQ(motion.pixels.size(), surface.depth.size());
      for (std::size_t s = 0; s < surface.depth.size(); ++s) {
        if (s % 5 == 0) {
          EXPECT_EQ(motion.pixels[s], (std::array<float, 2>{}));
          continue;
        }
        const double u = s % kWidth + 0.5, v = s / kWidth + 0.5;
        const Vec3 velocity = surface.velocity[s];
        const Eigen::Vector3d then = point_seen(camera, u / kWidth, v / kHeight, surface.depth[s]) +
                                     Eigen::Vector3d(velocity.x, velocity.y, velocity.z) / 25;
        const Eigen::Vector2d at = screen(next, then);
        // Both in double precision; the result is rounded to float.
        const double off_u = at.x() * kWidth - u, off_v = at.y() * kHeight - v;
        EXPECT_NEAR(motion.pixels[s][0], off_u, kEpsilon * std::abs(off_u) + 1e-9);
        EXPECT_NEAR(motion.pixels[s][1], off_v, kEpsilon * std::abs(off_v) + 1e-9);
      }
    }
  }
}

TEST(ScreenMotion, PointsToTheRightAndDown) {
  const Camera camera = look_at({0, 0, 10}, {0, 0, 0}, {0, 1, 0}, 45, 9, 9);
  Surface surface = made_up(camera, 0);
  surface.depth[40] = 10;  // the middle
  surface.velocity[40] = {1, 0, 0};
  auto motion = screen_motion(surface, camera, 10).pixels[40];
  EXPECT_GT(motion[0], 0);
  EXPECT_NEAR(motion[1], 0, 1e-9);
  surface.velocity[40] = {0, 1, 0};  // upward
  motion = screen_motion(surface, camera, 10).pixels[40];
  EXPECT_NEAR(motion[0], 0, 1e-9);
  EXPECT_LT(motion[1], 0);
}

TEST(ScreenMotion, NothingMovesUnderAStillCamera) {
  for (const Camera& camera : {perspective_camera(31, 17), orthographic_camera(31, 17)}) {
    Surface surface = made_up(camera, 0);
    for (const auto& [u, v] : screen_motion(surface, camera, 24).pixels) {
      EXPECT_NEAR(u, 0, 1e-10);  // a few dozen roundings of numbers up to 31 in double precision
      EXPECT_NEAR(v, 0, 1e-10);
    }
  }
}

// A point that flies past the eye on its right and below it leads out of the image there, by as
// much as from the same place on the near plane.
TEST(ScreenMotion, BehindTheEyeItLeadsOutWhereItPasses) {
  const Camera camera = look_at({0, 0, 10}, {0, 0, 0}, {0, 1, 0}, 45, 9, 9);
  Surface surface = made_up(camera, 0);
  surface.depth[40] = 8;
  const auto moved = [&](const Vec3& velocity) {
    surface.velocity[40] = velocity;
    return screen_motion(surface, camera, 1).pixels[40];
  };
  const auto behind = moved({0.5f, -0.25f, 30});  // from z = 2 to z = 32
  EXPECT_GT(behind[0], 4.5f);
  EXPECT_GT(behind[1], 4.5f);
  EXPECT_NEAR(behind[0], -2 * -behind[1], 1e-5 * behind[0]);
  const auto farther = moved({0.5f, -0.25f, 3000});
  EXPECT_EQ(farther, behind);
  // look_at's near plane lies at .02 of the distance to the target.
  const auto at_near = moved({0.5f, -0.25f, 7.8f});
  EXPECT_NEAR(behind[0], at_near[0], 1e-5 * behind[0]);
  EXPECT_EQ(moved({0, 0, 100})[0], moved({0, 0, 200})[0]);  // through the eye
}

TEST(ScreenMotion, IsFiniteWhateverTheVelocity) {
  for (const Camera& camera : {perspective_camera(31, 17), orthographic_camera(31, 17)})
    for (const double rate : {1e-300, 1e-3, 24.0, 1e300}) {
      const Surface surface = made_up(camera, 1e30);
      for (const auto& pixel : screen_motion(surface, perspective_camera(31, 17), rate).pixels)
        for (const float component : pixel) {
          EXPECT_TRUE(std::isfinite(component));
          EXPECT_LE(std::abs(component), 1e6f);
        }
    }
}

TEST(ScreenMotion, RefusesWhatItCannotWorkWith) {
  const Camera camera = perspective_camera(5, 4);
  const Surface surface = made_up(camera, 1);
  for (const double rate : {0.0, -24.0, double{INFINITY}, double{NAN}})
    EXPECT_THROW(screen_motion(surface, camera, rate), InvalidArgument) << rate;
  EXPECT_THROW(screen_motion(surface, Camera{}, 24), InvalidArgument);
  Surface still = surface;
  still.velocity.clear();
  EXPECT_THAT(text_of_thrown<InvalidArgument>([&] { screen_motion(still, camera, 24); }),
              testing::HasSubstr("has 0 velocities for 20 pixels"));
}

}  // namespace
}  // namespace meniscus
