// Fits made by hand, for the cases of their blend.
#pragma once

#include "stages/fit/particle_fit.hpp"
#include "verify/stage_cases/inputs.hpp"

namespace meniscus {

struct GivenFits {
  ParticleFits fits;
  std::vector<double> trust;

  // A fit whose surface passes `foot`, one radius outside its particle, and bends by `bend` times
  // the distance to the foot; with its visibility v.
  void add(const Vec3d& foot, const Vec3d& outward, double visible = 1, double bend = 0) {
    const Vec3d n = normalized(outward), at = foot - n;
    const Vec3d particle = Vec3d(static_cast<Vec3>(at));
    fits.position.push_back(particle);
    fits.normal.push_back(n);
    fits.visible.push_back(visible);
    fits.surface.push_back(1);
    fits.support.push_back(FitParams{}.support);
    fits.roundness.push_back(0);
    fits.edge.push_back(1);
    fits.firmness.push_back(1);
    fits.spread.push_back(0);
    fits.supporters.push_back(30);
    fits.foot.push_back(foot);
    // f = n.x - 1 + bend / 2 (x.x - (n.x)^2), x from the particle
    const auto quadratic = [&](double a, double b, double same) {
      return static_cast<float>(bend / 2 * same * (1 - a * b) - bend * (1 - same) * a * b);
    };
    fits.quadric.push_back({static_cast<float>(dot(n, particle - foot)), static_cast<float>(n.x),
                            static_cast<float>(n.y), static_cast<float>(n.z),
                            quadratic(n.x, n.x, 1), quadratic(n.y, n.y, 1), quadratic(n.z, n.z, 1),
                            quadratic(n.x, n.y, 0), quadratic(n.y, n.z, 0),
                            quadratic(n.z, n.x, 0)});
    fits.residual.push_back(0);
    trust.push_back(1);
  }
};

/// A perspective camera that looks down -z, u = 8 + 8 x / t on 16 x 16 pixels and so on.
inline View frontal_view(int width, int height) {
  Camera camera;
  camera.width = width;
  camera.height = height;
  camera.view = {1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1};
  camera.projection = {1, 0, 0, 0, 0, 1.0 * width / height, 0, 0, 0, 0, -1, -0.2, 0, 0, -1, 0};
  return make_view(camera, 1, {0, 0, 0});
}

/// Fits of three sheets, crowded so that a ray meets more than the kernel keeps, and others that
/// face away among them; no two are alike.
inline GivenFits crowd(unsigned seed) {
  Random random(seed);
  GivenFits scene;
  for (int k = 0; k < 480; ++k) {
    const bool hidden = k % 7 < 2;
    const Vec3d foot{random(-7, 7), random(-5, 5), random(-21, -19)};
    const Vec3d sides[] = {{-0.8, 0.1, 0.9}, {0.8, 0, 0.9}, {0.1, 0.9, 0.5}};
    const Vec3d scatter{random(-0.3, 0.3), random(-0.3, 0.3), random(-0.3, 0.3)};
    // One after the other: compilers differ in which argument of a call they work out first.
    const double bend = random(-0.05, 0.1), visible = k % 11 == 0 ? 5e-4 : random(0.01, 1);
    const Vec3d outward =
        hidden ? Vec3d{random(-1, 1), random(-1, 1), -0.7} : sides[k % 3] + scatter;
    scene.add(foot, outward, visible, bend);
    scene.fits.surface.back() = random(0, 1);
    scene.fits.support.back() = random(5, 10);
    scene.fits.roundness.back() = k % 3 == 0 ? random(0, 1) : 0;
    scene.fits.edge.back() = random(0.2, 1);
    scene.fits.firmness.back() = random(0.005, 1);
    scene.trust.back() = k % 13 == 0 ? 0.009 : k % 3 == 0 ? random(0.02, 1) : 1;
    if (k % 17 == 0) scene.fits.residual.back() = -1;
  }
  return scene;
}

/// Fits all over a ball of radius 5, whose outline passes x = 1 at y = 0. Their surfaces stick out
/// by up to `out`.
inline GivenFits ball_of_fits(unsigned seed, double out = 0.1) {
  Random random(seed);
  GivenFits scene;
  for (int k = 0; k < 120; ++k) {
    const double x = random(-1, 1), y = random(-1, 1), z = random(-1, 1);
    const Vec3d outward = normalized(Vec3d{x, y, z});
    scene.add(Vec3d{-4, 0, -20} + outward * random(4.9, 5 + out), outward, 1, random(0.18, 0.25));
    if (k % 2 == 0) scene.fits.roundness.back() = random(0.5, 1);
  }
  return scene;
}

/// The scene as if its numbers had been rounded eight times: coordinates near 20 and coefficients.
inline GivenFits rounded(const GivenFits& scene, Random& random) {
  GivenFits moved = scene;
  const auto off = [&](double size) { return 8 * kEpsilon * size * random(-1, 1); };
  for (std::size_t k = 0; k < scene.fits.size(); ++k) {
    moved.fits.position[k] += Vec3d{off(20), off(20), off(20)};
    moved.fits.foot[k] += Vec3d{off(20), off(20), off(20)};
    for (float& c : moved.fits.quadric[k]) c += static_cast<float>(off(std::abs(c)));
  }
  return moved;
}

}  // namespace meniscus
