// project_particles against the matrices in double precision.
#include "stages/frame/project.hpp"

#include "stages/stage_test_support.hpp"
#include "verify/reference/project.hpp"

namespace meniscus {
namespace {

constexpr double kRadius = 0.15;
constexpr double kMargin = 2.5;
constexpr std::array<double, 3> kOrigin{0.5, -0.25, 0.125};  // exact in float

// What the reference says of a particle, when single precision cannot see it otherwise.
enum class Fate { kept, dropped, undecided };

Fate fate_of(const reference::ProjectedParticle& p, const Camera& camera, double near_depth,
             double margin) {
  // Behind the eye the perspective division has no meaning; the depth alone decides.
  if (-p.eye[2] < near_depth / 2) return Fate::dropped;
  const double mu = margin * p.ku, mv = margin * p.kv;
  const double u_error = p.u_error + mu * (p.k_error + 2 * kEpsilon);
  const double v_error = p.v_error + mv * (p.k_error + 2 * kEpsilon);
  // Each is positive where the particle is inside.
  const double inside[5] = {-p.eye[2] - near_depth, p.u + mu, camera.width - (p.u - mu), p.v + mv,
                            camera.height - (p.v - mv)};
  const double error[5] = {p.eye_error[2] + kEpsilon * near_depth, u_error, u_error, v_error,
                           v_error};
  bool doubt = false;
  for (int k = 0; k < 5; ++k) {
    if (inside[k] < -error[k]) return Fate::dropped;
    doubt = doubt || inside[k] <= error[k];
  }
  return doubt ? Fate::undecided : Fate::kept;
}

TEST(Project, MatchesTheReference) {
  for (const Camera& camera :
       {perspective_camera(101, 77), off_centre_camera(37, 120), orthographic_camera(90, 61)})
    for (const std::size_t n : {1, 63, 64, 65, 1001}) {
      const View view = make_view(camera, kRadius, kOrigin);
      Random random(static_cast<unsigned>(n));
      WorldParticles particles;
      std::vector<reference::ProjectedParticle> expected;
      std::size_t dropped = 0;
      while (particles.x.size() < n) {
        const float x = static_cast<float>(random(-9, 9)), y = static_cast<float>(random(-9, 9)),
                    z = static_cast<float>(random(-9, 14)),
                    scale = static_cast<float>(random(0.5, 2));
        const auto p = reference::project(camera, kRadius, kOrigin, {x, y, z}, scale, kEpsilon);
        const Fate fate = fate_of(p, camera, view.near_depth, kMargin);
        if (fate == Fate::undecided) continue;
        add_position(particles, {x, y, z});
        particles.scale.push_back(scale);
        if (fate == Fate::kept)
          expected.push_back(p);
        else
          ++dropped;
      }
      if (n > 1000) {  // the scene holds both
        EXPECT_GT(expected.size(), n / 20);
        EXPECT_GT(dropped, n / 20);
      }
      const Projected actual = project_particles(view, particles, kMargin);
      ASSERT_EQ(actual.size(), expected.size());
      for (std::size_t i = 0; i < expected.size(); ++i) {
        const auto& e = expected[i];
        EXPECT_NEAR(actual.x[i], e.eye[0], e.eye_error[0]);
        EXPECT_NEAR(actual.y[i], e.eye[1], e.eye_error[1]);
        EXPECT_NEAR(actual.z[i], e.eye[2], e.eye_error[2]);
        EXPECT_NEAR(actual.u[i], e.u, e.u_error);
        EXPECT_NEAR(actual.v[i], e.v, e.v_error);
        EXPECT_NEAR(actual.ku[i], e.ku, e.ku * e.k_error);
        EXPECT_NEAR(actual.kv[i], e.kv, e.kv * e.k_error);
      }
    }
}

TEST(Project, KeepsADiscThatReachesTheScreenFromOutside) {
  // One pixel is half a particle radius: a disc of 2.5 radii reaches 5 pixels.
  const Camera camera = [] {
    Camera c;
    c.width = c.height = 40;
    c.view = {1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1};
    c.projection = {0.1, 0, 0, 0, 0, 0.1, 0, 0, 0, 0, -0.01, -1, 0, 0, 0, 1};
    return c;
  }();
  const View view = make_view(camera, 1, {0, 0, 0});
  WorldParticles particles;
  particles.x = {-12.25f, -12.75f, 12.25f, 12.75f, 0, 0, 0, 0};
  particles.y = {0, 0, 0, 0, -12.25f, -12.75f, 12.25f, 12.75f};
  particles.z.assign(8, -5.0f);
  const Projected kept = project_particles(view, particles, kMargin);
  EXPECT_EQ(kept.x, (std::vector<float>{-12.25f, 12.25f, 0, 0}));
  EXPECT_EQ(kept.y, (std::vector<float>{0, 0, -12.25f, 12.25f}));
  EXPECT_EQ(kept.scale, std::vector<float>(4, 1.0f));
  EXPECT_EQ(kept.index, (std::vector<std::uint32_t>{0, 2, 4, 6}));
}

TEST(Project, NoParticlesGiveNone) {
  EXPECT_EQ(project_particles(make_view(perspective_camera(9, 9), 1, {}), {}, 1).size(), 0u);
}

}  // namespace
}  // namespace meniscus
