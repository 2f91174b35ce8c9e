// The frames that whole frames are measured on.
#include "frame/input.hpp"

#include <gmock/gmock.h>

#include <array>

#include "meniscus/camera.hpp"
#include "meniscus/io.hpp"
#include "program/dam_break.hpp"

namespace meniscus {
namespace {

TEST(DamFrame, IsTheExampleBitForBit) {
  const FrameInput frame = dam_frame();
  const std::string folder = MENISCUS_EXAMPLE_DATA "/dam/";
  const Particles file = read_particles(folder + "frame_015.ply");
  EXPECT_EQ(frame.particles.x, file.x);
  EXPECT_EQ(frame.particles.y, file.y);
  EXPECT_EQ(frame.particles.z, file.z);
  EXPECT_EQ(frame.particles.particle_radius, 0.025);
  const Camera camera = read_camera(folder + "camera.json");
  EXPECT_EQ(frame.camera.view, camera.view);
  EXPECT_EQ(frame.camera.projection, camera.projection);
  EXPECT_EQ(frame.camera.width, 1024);
  EXPECT_EQ(frame.camera.height, 768);
}

TEST(SyntheticFrame, IsTheDamBreakInAValidCamera) {
  const FrameInput frame = synthetic_frame(2000, 64, 48);
  const DamBreak dam(2000, 1);
  std::size_t k = 0;
  dam.emit([&](std::span<const float> block) {
    for (std::size_t c = 0; c < block.size(); c += 3, ++k)
      ASSERT_EQ((std::array{frame.particles.x[k], frame.particles.y[k], frame.particles.z[k]}),
                (std::array{block[c], block[c + 1], block[c + 2]}));
  });
  EXPECT_EQ(k, frame.particles.size());
  EXPECT_EQ(frame.particles.particle_radius, dam.particle_radius());
  EXPECT_NO_THROW(check(frame.camera));
  EXPECT_EQ(frame.camera.width, 64);
}

TEST(Resized, KeepsTheVerticalFieldOfView) {
  const Camera camera = look_at({0, 0, 5}, {0, 0, 0}, {0, 1, 0}, 50, 640, 480);
  const Camera wide = resized(camera, 1920, 480),
               wanted = look_at({0, 0, 5}, {0, 0, 0}, {0, 1, 0}, 50, 1920, 480);
  EXPECT_EQ(wide.width, 1920);
  EXPECT_EQ(wide.height, 480);
  for (std::size_t k = 0; k < 16; ++k)  // one quotient each: a rounding or two
    EXPECT_NEAR(wide.projection[k], wanted.projection[k], 1e-14);
  EXPECT_EQ(wide.view, wanted.view);
}

}  // namespace
}  // namespace meniscus
