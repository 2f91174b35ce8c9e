// Cameras: making them, and each error of check() and look_at().
#include "meniscus/camera.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>
#include <string>
#include <utility>

#include "api/framing.hpp"
#include "meniscus/error.hpp"
#include "meniscus/source.hpp"
#include "stages/view.hpp"
#include "thrown.hpp"

namespace meniscus {
namespace {

using testing::HasSubstr;

Camera good_camera() { return look_at({0, 0, 5}, {0, 0, 0}, {0, 1, 0}, 60, 40, 30); }

std::string check_after(const std::function<void(Camera&)>& spoil) {
  Camera camera = good_camera();
  spoil(camera);
  return text_of_thrown<InvalidArgument>([&] { check(camera); });
}

TEST(Check, AcceptsPerspectiveAndOrthographic) {
  EXPECT_EQ(check_after([](Camera&) {}), "no error");
  EXPECT_EQ(check_after([](Camera& c) {
              c.projection = {1, 0, 0, 0.5, 0, 1, 0, 0, 0, 0, -0.1, 0, 0, 0, 0, 1};
            }),
            "no error");
}

TEST(Check, NamesWhatIsWrong) {
  const double nan = std::nan(""), inf = std::numeric_limits<double>::infinity();
  EXPECT_THAT(check_after([](Camera& c) { c.width = 0; }), HasSubstr("size is 0x30"));
  EXPECT_THAT(check_after([](Camera& c) { c.height = 16385; }), HasSubstr("40x16385"));
  EXPECT_THAT(check_after([&](Camera& c) { c.view[6] = nan; }), HasSubstr("view[1][2] is nan"));
  EXPECT_THAT(check_after([&](Camera& c) { c.projection[5] = inf; }),
              HasSubstr("projection[1][1] is inf"));
  EXPECT_THAT(check_after([](Camera& c) { c.view[13] = 2; }), HasSubstr("view[3][1] is 2"));
  EXPECT_THAT(check_after([](Camera& c) { c.view[15] = 0; }), HasSubstr("view[3][3] is 0"));
  EXPECT_THAT(
      check_after([](Camera& c) {
        for (int k = 0; k < 3; ++k) std::swap(c.view[4 * k + 3], c.view[12 + k]);
      }),
      HasSubstr("view is transposed: its last row is 0 0 -5 1 and its last column 0 0 0 1"));
  EXPECT_THAT(check_after([](Camera& c) {
                for (int k = 0; k < 3; ++k) c.view[k] *= 2;
              }),
              HasSubstr("must be a rotation"));
  EXPECT_THAT(check_after([](Camera& c) {
                for (int k = 0; k < 3; ++k) c.view[k] = -c.view[k];
              }),
              HasSubstr("mirrors"));
  EXPECT_THAT(check_after([](Camera& c) { c.projection[0] = 0; }), HasSubstr("singular"));
  EXPECT_THAT(check_after([](Camera& c) { c.projection[11] = 0; }), HasSubstr("singular"));
  EXPECT_THAT(check_after([](Camera& c) { c.projection[12] = 0.1; }),
              HasSubstr("last row of projection is 0.1 0 -1 0"));
  EXPECT_THAT(check_after([](Camera& c) { c.projection[14] = 1; }), HasSubstr("last row"));
}

// Scenes in millimetres: the depths in the projection, or the image's sides, are large numbers.
TEST(Check, TakesScenesOfAnySize) {
  EXPECT_NO_THROW(check(look_at({0, 0, 3e9}, {0, 0, 0}, {0, 1, 0}, 40, 40, 30)));
  EXPECT_EQ(check_after([](Camera& c) {
              c.projection = {1e-7, 0, 0, 0, 0, 1e-7, 0, 0, 0, 0, -1e-8, -1, 0, 0, 0, 1};
            }),
            "no error");
}

TEST(LookAt, PutsTheTargetInTheMiddleAndUpUpwards) {
  const Camera camera = look_at({4, -3, 2}, {1, 1, 1}, {0, 0, 1}, 50, 80, 60);
  check(camera);
  const View view = make_view(camera, 0.5, {0, 0, 0});
  const PixelPosition target = project(view, eye_from_world(view, {1, 1, 1}));
  EXPECT_NEAR(target.u, 40, 1e-9);  // doubles, a few roundings of numbers below 100
  EXPECT_NEAR(target.v, 30, 1e-9);
  EXPECT_NEAR(target.w, std::sqrt(9.0 + 16 + 1), 1e-9);
  const PixelPosition above = project(view, eye_from_world(view, {1, 1, 1.1}));
  EXPECT_NEAR(above.u, 40, 1e-9);
  EXPECT_LT(above.v, 30);
}

TEST(LookAt, FieldOfViewSpansTheHeight) {
  const Camera camera = look_at({0, 0, 5}, {0, 0, 0}, {0, 1, 0}, 60, 80, 60);
  const View view = make_view(camera, 1, {0, 0, 0});
  const double half = 5 * std::tan(std::acos(-1) / 6);
  EXPECT_NEAR(project(view, eye_from_world(view, {0, half, 0})).v, 0, 1e-9);
  EXPECT_NEAR(project(view, eye_from_world(view, {0, -half, 0})).v, 60, 1e-9);
  EXPECT_NEAR(project(view, eye_from_world(view, {half * 80 / 60, 0, 0})).u, 80, 1e-9);
}

TEST(LookAt, NamesWhatIsWrong) {
  const double nan = std::nan("");
  const auto error = [](std::array<double, 3> eye, std::array<double, 3> up, double fov, int w) {
    return text_of_thrown<InvalidArgument>([=] { look_at(eye, {0, 0, 0}, up, fov, w, 10); });
  };
  EXPECT_THAT(error({0, 0, 1}, {0, 1, 0}, 60, 0), HasSubstr("size is 0x10"));
  EXPECT_THAT(error({0, 0, 1}, {0, 1, 0}, 0, 10), HasSubstr("field of view is 0"));
  EXPECT_THAT(error({0, 0, 1}, {0, 1, 0}, 180, 10), HasSubstr("field of view is 180"));
  EXPECT_THAT(error({0, 0, 1}, {0, 1, 0}, nan, 10), HasSubstr("field of view is nan"));
  EXPECT_THAT(error({0, nan, 1}, {0, 1, 0}, 60, 10), HasSubstr("finite"));
  EXPECT_THAT(error({0, 0, 0}, {0, 1, 0}, 60, 10), HasSubstr("same point"));
  EXPECT_THAT(error({0, 0, 1}, {0, 0, 3}, 60, 10), HasSubstr("parallel"));
  EXPECT_THAT(error({0, 0, 1}, {0, 0, 0}, 60, 10), HasSubstr("up is zero"));
}

TEST(FrameParticles, ShowsEveryParticle) {
  Particles particles;
  particles.particle_radius = 0.1;
  for (const double x : {-3.0, 0.0, 7.0})
    for (const double y : {-1.0, 2.0}) add_position(particles, {x, y, x * y});
  particles.x.push_back(std::nanf(""));  // left out
  particles.y.push_back(0);
  particles.z.push_back(0);
  for (const auto& [width, height] : {std::pair{64, 48}, {30, 100}, {200, 20}}) {
    const Camera camera = frame_particles(particles, {.width = width, .height = height});
    check(camera);
    const View view = make_view(camera, 0.1, {0, 0, 0});
    for (std::size_t i = 0; i + 1 < particles.size(); ++i) {
      const Vec3d eye = eye_from_world(view, {particles.x[i], particles.y[i], particles.z[i]});
      const PixelPosition at = project(view, eye);
      const double ku = view.u_scale / at.w, kv = view.v_scale / at.w;  // a radius in pixels
      EXPECT_GT(-eye.z, view.near_depth + 1);
      EXPECT_GT(at.u - ku, 0);
      EXPECT_LT(at.u + ku, width);
      EXPECT_GT(at.v - kv, 0);
      EXPECT_LT(at.v + kv, height);
    }
  }
}

// Particles that are looked at as those of a large file.
class Surveyed : public ParticleSource {
 public:
  explicit Surveyed(Particles particles) : particles_(std::move(particles)) {}
  std::int64_t size() const override { return static_cast<std::int64_t>(particles_.size()); }
  std::string name(std::int64_t particle) const override { return std::to_string(particle); }
  bool has_radius() const override { return false; }
  bool has_velocity() const override { return false; }
  double particle_radius() const override { return particles_.particle_radius; }
  void read(std::int64_t first, std::size_t count, const ParticleArrays& to) const override {
    std::copy_n(particles_.x.data() + first, count, to.x);
    std::copy_n(particles_.y.data() + first, count, to.y);
    std::copy_n(particles_.z.data() + first, count, to.z);
  }

 private:
  Particles particles_;
};

// Where the spheres of particles are in an image, in shares of its half width and height: -1 to 1.
struct Reach {
  double left = 9, right = -9, top = 9, bottom = -9;
};

Reach reach_of(const Particles& particles, double radius, const Camera& camera) {
  const View view = make_view(camera, radius, {0, 0, 0});
  Reach reach;
  for (std::size_t i = 0; i < particles.size(); ++i) {
    const Vec3d eye = eye_from_world(view, {particles.x[i], particles.y[i], particles.z[i]});
    const PixelPosition at = project(view, eye);
    const double ku = view.u_scale / at.w, kv = view.v_scale / at.w;  // a radius in pixels
    reach.left = std::min(reach.left, 2 * (at.u - ku) / camera.width - 1);
    reach.right = std::max(reach.right, 2 * (at.u + ku) / camera.width - 1);
    reach.top = std::min(reach.top, 2 * (at.v - kv) / camera.height - 1);
    reach.bottom = std::max(reach.bottom, 2 * (at.v + kv) / camera.height - 1);
  }
  return reach;
}

// A block of particles on a lattice of spacing 1.
Particles block_of(int nx, int ny, int nz) {
  Particles particles;
  for (int k = 0; k < nz; ++k)
    for (int j = 0; j < ny; ++j)
      for (int i = 0; i < nx; ++i) {
        particles.x.push_back(static_cast<float>(i));
        particles.y.push_back(static_cast<float>(j));
        particles.z.push_back(static_cast<float>(k));
      }
  return particles;
}

// Along the axis that limits it, planes that touch the outermost spheres are at 92 % of the image.
// A sphere's radius is taken parallel to the image here, which is less than its outline by a factor
// of sqrt(1 + slope^2), below 1.6 for these images: less than a hundredth of half an image.
TEST(FrameParticles, FillsTheImageAndIsInItsMiddle) {
  Particles particles = block_of(100, 60, 150);
  particles.particle_radius = 0.5;
  for (const auto& [width, height] : {std::pair{640, 480}, {480, 640}, {1920, 400}}) {
    const Reach reach =
        reach_of(particles, 0.5, frame_particles(particles, {.width = width, .height = height}));
    const double wide = std::max(-reach.left, reach.right),
                 high = std::max(-reach.top, reach.bottom);
    EXPECT_NEAR(std::max(wide, high), 0.92, 0.01) << width;
    EXPECT_LE(std::max(wide, high), 0.92) << width;
    EXPECT_NEAR(reach.left, -reach.right, 0.02) << width;
    EXPECT_NEAR(reach.top, -reach.bottom, 0.02) << width;
  }
}

// The file states no radius, as most do: no drop at the border is cut.
TEST(FrameParticles, GuessesARadiusThatIsNotKnown) {
  for (const Particles& particles :
       {block_of(10, 10, 10), block_of(3, 3, 3), block_of(30, 1, 30), block_of(100, 1, 1)}) {
    const Reach reach =
        reach_of(particles, 0.5, frame_particles(particles, {.width = 640, .height = 480}));
    EXPECT_GT(std::min(reach.left, reach.top), -0.921) << particles.size();
    EXPECT_LT(std::max(reach.right, reach.bottom), 0.921) << particles.size();
  }
}

TEST(FrameParticles, StaysBeyondTheNearPlaneOfWideViews) {
  Particles particles = block_of(1, 1, 1000);
  particles.particle_radius = 0.01;
  const Surveyed source(particles);
  for (const double fov : {1.0, 40.0, 120.0, 179.0}) {
    const Camera camera = frame_sources({&source}, {{0, 1, 0}, fov, 640, 480});
    EXPECT_EQ(frame_particles(source, {{0, 1, 0}, fov, 640, 480}).view, camera.view);
    const View view = make_view(camera, 0.01, {0, 0, 0});
    for (std::size_t i = 0; i < particles.size(); ++i)
      ASSERT_GT(-eye_from_world(view, {particles.x[i], particles.y[i], particles.z[i]}).z,
                view.near_depth + 1)
          << fov;
  }
}

// A cube of particles from 0 to 9, and another one.
Particles cube_and(float x) {
  Particles particles;
  particles.particle_radius = 0.5;
  for (int k = 0; k < 1000; ++k) add_position(particles, Vec3d(k % 10, k / 10 % 10, k / 100));
  add_position(particles, {x, 4, 4});
  return particles;
}

TEST(FrameParticles, LeavesOutWhatWasThrownAway) {
  const Camera cube = frame_particles(cube_and(4), {.width = 64, .height = 48});
  for (const float x : {100.0f, 1e5f, -1e30f})  // farther than 4.5 + 20 * 4.5
    EXPECT_EQ(frame_particles(cube_and(x), {.width = 64, .height = 48}).view, cube.view) << x;
  EXPECT_NE(frame_particles(cube_and(90), {.width = 64, .height = 48}).view, cube.view);
  EXPECT_EQ(frame_particles(Surveyed(cube_and(1e5f)), {.width = 64, .height = 48}).view, cube.view);
}

TEST(FrameParticles, WorksWithoutParticlesAndWithOne) {
  Particles particles;
  check(frame_particles(particles, {.width = 10, .height = 10}));
  particles.x = particles.y = particles.z = {1e6f};
  check(frame_particles(particles, {.width = 10, .height = 10}));
  particles.x = particles.y = particles.z = {0.0f};
  check(frame_particles(particles, {.width = 10, .height = 10}));
}

TEST(FrameParticles, NeedsASizeAndWholeParticles) {
  Particles particles;
  EXPECT_THROW(frame_particles(particles, {.width = 0, .height = 10}), InvalidArgument);
  particles.x = particles.y = {0.0f, 1.0f};
  particles.z = {0.0f};
  EXPECT_THROW(frame_particles(particles, {.width = 10, .height = 10}), InvalidArgument);
}

// As a matrix for row vectors has it.
TEST(Camera, ATransposedProjectionIsNamed) {
  EXPECT_THAT(check_after([](Camera& c) {
                for (int i = 0; i < 4; ++i)
                  for (int j = 0; j < i; ++j)
                    std::swap(c.projection[4 * i + j], c.projection[4 * j + i]);
              }),
              HasSubstr("projection is transposed"));
}

Particles point_at(float x, float y, float z) {
  Particles p;
  p.x = {x};
  p.y = {y};
  p.z = {z};
  p.particle_radius = 0.1;
  return p;
}

TEST(Camera, FramesAllSourcesWithTheirUpAndFieldOfView) {
  const Particles bottom_point = point_at(0, 0, 0), top_point = point_at(0, 0, 30), nothing;
  const auto low = source_of(bottom_point), high = source_of(top_point), none = source_of(nothing);
  for (const double fov : {20.0, 60.0}) {
    const Camera camera =
        frame_sources({low.get(), none.get(), high.get()}, {{0, 0, 1}, fov, 200, 100});
    EXPECT_EQ(camera.width, 200);
    EXPECT_NEAR(camera.projection[5], 1 / std::tan(fov * std::acos(-1) / 360), 1e-12);
    const View view = make_view(camera, 0.1, {});
    const PixelPosition bottom = project(view, eye_from_world(view, {0, 0, 0})),
                        top = project(view, eye_from_world(view, {0, 0, 30}));
    for (const PixelPosition& at : {bottom, top}) {
      EXPECT_GT(at.v, 0);
      EXPECT_LT(at.v, 100);
      EXPECT_NEAR(at.u, 100, 1e-6);  // the z-axis is upright in the middle
    }
    EXPECT_GT(std::abs(bottom.v - top.v), 40);
  }
  EXPECT_THAT(text_of_thrown<InvalidArgument>([&] {
                frame_sources({low.get()}, {{0, 0, 0}, 40, 10, 10});
              }),
              HasSubstr("up must be"));
  EXPECT_THAT(text_of_thrown<InvalidArgument>([&] {
                frame_sources({low.get()}, {{0, 1, 0}, 180, 10, 10});
              }),
              HasSubstr("field of view is 180"));
}

}  // namespace
}  // namespace meniscus
