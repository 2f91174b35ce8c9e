#include "accuracy/motion.hpp"

#include <cmath>
#include <numbers>
#include <utility>

namespace meniscus::accuracy {
namespace {

constexpr double kAmplitude = 0.06;  // s a frame

double wave(double along, double length, double phase) {
  return kAmplitude * std::sin(2 * std::numbers::pi * along / length + phase);
}

}  // namespace

Motion rigid_motion(const Vec3d& centre) {
  constexpr double kTurn = 0.002;  // radians a frame
  const Vec3d shift{0.03, -0.02, 0.04};
  const auto turned = [=](const Vec3d& p, double angle) {
    const Vec3d arm = p - centre;
    const double c = std::cos(angle), s = std::sin(angle);
    return centre + Vec3d{c * arm.x - s * arm.y, s * arm.x + c * arm.y, arm.z};
  };
  return {[=](const Vec3d& p, int frame) { return turned(p, frame * kTurn) + frame * shift; },
          [=](const Vec3d& p, int frame) { return turned(p - frame * shift, -frame * kTurn); }};
}

Motion smooth_bend() {
  const auto forth = [](Vec3d p, int frame) {
    p.x += frame * wave(p.y, 20, 1);
    p.y += frame * wave(p.z, 22, 0);
    p.z += frame * wave(p.x, 24, 2);
    return p;
  };
  const auto back = [](Vec3d p, int frame) {
    p.z -= frame * wave(p.x, 24, 2);
    p.y -= frame * wave(p.z, 22, 0);
    p.x -= frame * wave(p.y, 20, 1);
    return p;
  };
  return {forth, back};
}

Particles moved(Particles particles, const Motion& motion, int frame) {
  for (std::size_t k = 0; k < particles.size(); ++k) {
    const Vec3 p =
        static_cast<Vec3>(motion.forth({particles.x[k], particles.y[k], particles.z[k]}, frame));
    particles.x[k] = p.x;
    particles.y[k] = p.y;
    particles.z[k] = p.z;
  }
  return particles;
}

Scene moved(Scene scene, const Motion& motion, int frame) {
  constexpr double kStretch = 0.9;  // three frames of the bend change lengths by at most 6 %
  constexpr double kRoom = 1;       // s; nothing moves farther
  scene.distance = [=, still = std::move(scene.distance)](const Vec3d& p) {
    return still(motion.back(p, frame));
  };
  scene.safe_step *= kStretch;
  scene.low = scene.low - Vec3d{kRoom, kRoom, kRoom};
  scene.high = scene.high + Vec3d{kRoom, kRoom, kRoom};
  for (Piece& piece : scene.splash)
    for (Vec3d& p : piece) p = motion.forth(p, frame);
  return scene;
}

}  // namespace meniscus::accuracy
