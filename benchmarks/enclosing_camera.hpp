// The camera of figures that were measured before frame_particles() came closer.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

#include "meniscus/camera.hpp"
#include "meniscus/types.hpp"

namespace meniscus {

/// Shows the sphere around the box of all particles, which are finite and have a radius, from where
/// frame_particles() looks. Figures of docs/performance.md and docs/accuracy.md were measured with
/// it, and stay comparable.
inline Camera enclosing_camera(const Particles& particles, int width, int height) {
  constexpr double kFov = 40;
  constexpr std::array<double, 3> kFromWhere{.55, .45, .8};
  const auto middle_and_half = [](const std::vector<float>& values) {
    const auto [low, high] = std::minmax_element(values.begin(), values.end());
    return std::array{(double{*low} + *high) / 2, (double{*high} - *low) / 2};
  };
  const std::array sides{middle_and_half(particles.x), middle_and_half(particles.y),
                         middle_and_half(particles.z)};
  const auto length = [](double x, double y, double z) { return std::sqrt(x * x + y * y + z * z); };
  const double radius = length(sides[0][1], sides[1][1], sides[2][1]) + particles.particle_radius;
  const double half_v = kFov * std::numbers::pi / 360;
  const double half_h = std::atan(std::tan(half_v) * width / height);
  const double distance = 1.05 * radius / std::sin(std::min(half_v, half_h));
  const double along = distance / length(kFromWhere[0], kFromWhere[1], kFromWhere[2]);
  const auto eye = [&](std::size_t k) { return sides[k][0] + kFromWhere[k] * along; };
  return look_at({eye(0), eye(1), eye(2)}, {sides[0][0], sides[1][0], sides[2][0]}, {0, 1, 0}, kFov,
                 width, height);
}

}  // namespace meniscus
