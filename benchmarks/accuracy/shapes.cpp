#include "accuracy/shapes.hpp"

#include <algorithm>
#include <numbers>

namespace meniscus::accuracy {

Rotation::Rotation(double about_x, double about_y, double about_z) {
  const auto turned = [&](Vec3d v) {
    const double cx = std::cos(about_x), sx = std::sin(about_x);
    v = {v.x, cx * v.y - sx * v.z, sx * v.y + cx * v.z};
    const double cy = std::cos(about_y), sy = std::sin(about_y);
    v = {cy * v.x + sy * v.z, v.y, cy * v.z - sy * v.x};
    const double cz = std::cos(about_z), sz = std::sin(about_z);
    return Vec3d{cz * v.x - sz * v.y, sz * v.x + cz * v.y, v.z};
  };
  x = turned({1, 0, 0});
  y = turned({0, 1, 0});
  z = turned({0, 0, 1});
}

double box_distance(const Vec3d& p, const Vec3d& half) {
  const Vec3d q{std::abs(p.x) - half.x, std::abs(p.y) - half.y, std::abs(p.z) - half.z};
  const Vec3d outside{std::max(q.x, 0.0), std::max(q.y, 0.0), std::max(q.z, 0.0)};
  return length(outside) + std::min(std::max({q.x, q.y, q.z}), 0.0);
}

double ellipsoid_distance(const Vec3d& p, const Vec3d& half) {
  // The foot is e^2 y / (t + e^2) along each axis, t the root of sum (e y / (t + e^2))^2 = 1. The
  // sum falls and is convex, so that Newton's steps come from the left and never pass the root.
  constexpr double kTiny = 1e-7;  // s; keeps off the poles, where p lies on a plane of symmetry
  const std::array<double, 3> e{half.x, half.y, half.z};
  const std::array<double, 3> y{std::max(std::abs(p.x), kTiny), std::max(std::abs(p.y), kTiny),
                                std::max(std::abs(p.z), kTiny)};
  double t = -1e300;
  for (int k = 0; k < 3; ++k) t = std::max(t, e[k] * (y[k] - e[k]));
  for (int step = 0; step < 100; ++step) {
    double sum = -1, slope = 0;
    for (int k = 0; k < 3; ++k) {
      const double share = e[k] * y[k] / (t + e[k] * e[k]);
      sum += share * share;
      slope -= 2 * share * share / (t + e[k] * e[k]);
    }
    if (sum <= 1e-14) break;
    t -= sum / slope;
  }
  double square = 0, inside = -1;
  for (int k = 0; k < 3; ++k) {
    const double gap = y[k] * t / (t + e[k] * e[k]);
    square += gap * gap;
    inside += y[k] * y[k] / (e[k] * e[k]);
  }
  return std::copysign(std::sqrt(square), inside);
}

double capsule_distance(const Vec3d& p, const Vec3d& a, const Vec3d& b, double radius) {
  const Vec3d axis = b - a;
  const double along = std::clamp(dot(p - a, axis) / dot(axis, axis), 0.0, 1.0);
  return length(p - a - along * axis) - radius;
}

double bowl_distance(const Vec3d& p, double radius, double thickness) {
  const double across = std::hypot(p.x, p.y);
  const double to_shell =
      p.z < 0 ? std::abs(std::hypot(across, p.z) - radius) : std::hypot(across - radius, p.z);
  return to_shell - thickness / 2;
}

double prism_distance(const Vec3d& p, const std::vector<std::array<double, 2>>& corners,
                      double half_length) {
  double farthest = std::abs(p.y) - half_length;
  for (std::size_t k = 0; k < corners.size(); ++k) {
    const auto& a = corners[k];
    const auto& b = corners[(k + 1) % corners.size()];
    const double x = b[0] - a[0], z = b[1] - a[1];
    farthest = std::max(farthest, (z * (p.x - a[0]) - x * (p.z - a[1])) / std::hypot(x, z));
  }
  return farthest;
}

double distance_to_zero(const Vec3d& p, const std::function<Level(const Vec3d&)>& level) {
  constexpr double kNear = 1, kGoodEnough = 1e-9;  // s
  constexpr int kRounds = 4;
  Level at = level(p);
  double distance = at.value / std::max(length(at.gradient), 1.0);
  if (std::abs(distance) > kNear) return distance;
  for (int round = 0; round < kRounds; ++round) {
    // The tangent plane at the foot found so far; its foot is the next one.
    const Vec3d normal = at.gradient / length(at.gradient);
    const Vec3d foot = p - distance * normal;
    at = level(foot);
    const double before = distance;
    distance = (dot(at.gradient, p - foot) + at.value) / length(at.gradient);
    if (std::abs(distance - before) < kGoodEnough) break;
  }
  return distance;
}

Level above_waves(const Vec3d& p, const std::vector<Wave>& waves) {
  Level level{p.z, {0, 0, 1}};
  for (const Wave& wave : waves) {
    const double k = 2 * std::numbers::pi / wave.length;
    const double kx = k * std::cos(wave.heading), ky = k * std::sin(wave.heading);
    const double angle = kx * p.x + ky * p.y + wave.phase;
    const double slope = -wave.amplitude * std::cos(angle);
    level.value -= wave.amplitude * std::sin(angle);
    level.gradient += Vec3d{kx * slope, ky * slope, 0};
  }
  return level;
}

Level above_balls(const Vec3d& p, const std::vector<std::pair<Vec3d, double>>& balls,
                  double blend) {
  Level level{1e9, {}};
  for (const auto& [centre, radius] : balls) {
    const Level ball{length(p - centre) - radius, normalized(p - centre)};
    // min(a, b) - blend/4 (1 - |a - b|/blend)^2, whose gradient is a mean of both gradients.
    const double overlap = std::max(0.0, 1 - std::abs(level.value - ball.value) / blend);
    const bool nearer = ball.value < level.value;
    const double share = nearer ? 1 - overlap / 2 : overlap / 2;
    level.value = std::min(level.value, ball.value) - blend / 4 * overlap * overlap;
    level.gradient = (1 - share) * level.gradient + share * ball.gradient;
  }
  return level;
}

double melted(double a, double b, double blend) {
  const double overlap = std::max(0.0, 1 - std::abs(a - b) / blend);
  return std::min(a, b) - blend / 4 * overlap * overlap;
}

double thread_distance(const Vec3d& p, const std::vector<Bead>& beads) {
  double nearest = length(p - beads[0].centre) - beads[0].radius;
  for (std::size_t k = 0; k + 1 < beads.size(); ++k) {
    const auto& [a, a_radius] = beads[k];
    const auto& [b, b_radius] = beads[k + 1];
    const Vec3d axis = b - a;
    const double span = length(axis), falls = (a_radius - b_radius) / span;
    if (std::abs(falls) >= 1) {  // one ball holds the other
      nearest = std::min(nearest, length(p - b) - b_radius);
      continue;
    }
    // The nearest of the balls between: the normal of their hull leans by `falls` towards b.
    const double along = dot(p - a, axis) / span;
    const double across = std::sqrt(std::max(dot(p - a, p - a) - along * along, 0.0));
    const double lean = falls / std::sqrt(1 - falls * falls);
    const double share = std::clamp((along - across * lean) / span, 0.0, 1.0);
    const Vec3d centre = a + share * axis;
    nearest = std::min(nearest, length(p - centre) - (a_radius + share * (b_radius - a_radius)));
  }
  return nearest;
}

Level above_dam(const Vec3d& p) {
  // A height field in x, the distance ahead of the parabola; where it is low its end is rounded.
  constexpr double kLow = 3, kFall = 9, kRound = 2;  // s
  constexpr double kFallStart = -13, kFallEnd = 8, kFront = 14;
  constexpr double kBulge = 1. / 45;  // 1/s; the front recedes by y^2/90
  const double x = p.x + kBulge / 2 * p.y * p.y;
  const Vec3d ahead{1, kBulge * p.y, 0};  // gradient of x

  const double t = std::clamp((x - kFallStart) / (kFallEnd - kFallStart), 0.0, 1.0);
  const double height = kLow + kFall * (1 - t * t * t * (t * (6 * t - 15) + 10));
  const double slope = -kFall * 30 * t * t * (1 - t) * (1 - t) / (kFallEnd - kFallStart);
  const double above = p.z - height, beyond = (x - kFront) / length(ahead);
  if (above > -kRound && beyond > -kRound) {  // the slope is zero here
    const double corner = std::hypot(above + kRound, beyond + kRound);
    return {corner - kRound,
            ((above + kRound) * Vec3d{0, 0, 1} + (beyond + kRound) * normalized(ahead)) / corner};
  }
  return above > beyond ? Level{above, Vec3d{0, 0, 1} - slope * ahead} : Level{x - kFront, ahead};
}

}  // namespace meniscus::accuracy
