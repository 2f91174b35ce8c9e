// The lights of the previews that show water, and what water does to rays. All in eye space (x
// right, y up, z to the viewer), so that every camera gets the same light.
#pragma once

#include <algorithm>
#include <cmath>

#include "io/picture.hpp"

namespace meniscus {

inline constexpr float kWater = 1 / 1.333f;  // ratio of the refractive indices, air to water

inline Vec3 unit(const Vec3& v) { return v * (1 / std::sqrt(std::max(dot(v, v), 1e-20f))); }

inline const Vec3 kKey = unit({-0.5f, 0.72f, 0.48f});  // towards the key light

/// A direction that goes on behind a surface of water; `ratio` of the refractive indices.
inline Vec3 refract(const Vec3& along, const Vec3& n, float ratio) {
  const float c = -dot(along, n);
  const float k = std::max(1 - ratio * ratio * (1 - c * c), 0.0f);
  return along * ratio + n * (ratio * c - std::sqrt(k));
}

/// A rectangular light around a direction: 1 in its middle, 0 outside.
inline float soft_box(const Vec3& d, const Vec3& towards, const Vec3& right, float half_width,
                      float half_height) {
  const float facing = dot(d, towards);
  if (facing <= 0) return 0;
  const Vec3 up = {towards.y * right.z - towards.z * right.y,
                   towards.z * right.x - towards.x * right.z,
                   towards.x * right.y - towards.y * right.x};
  const float a = std::abs(dot(d, right)) / facing, b = std::abs(dot(d, up)) / facing;
  return (1 - smoothstep(0.6f * half_width, 1.3f * half_width, a)) *
         (1 - smoothstep(0.6f * half_height, 1.3f * half_height, b));
}

/// Light that comes from a direction.
inline Color studio(const Vec3& d) {
  Color light = mix({0.15f, 0.29f, 0.40f}, {0.44f, 0.76f, 0.97f}, smoothstep(-0.6f, 0.5f, d.y));
  light = light + Color{6.0f, 5.9f, 5.7f} * soft_box(d, kKey, unit({0.48f, 0, 0.5f}), 0.55f, 0.40f);
  light = light + Color{0.5f, 1.1f, 1.5f} *
                      soft_box(d, unit({0.85f, 0.30f, 0.1f}), unit({0.1f, 0, -0.85f}), 0.25f, 0.8f);
  light = light +
          Color{1.0f, 1.1f, 1.2f} * soft_box(d, unit({0, 0.62f, -0.78f}), {1, 0, 0}, 1.4f, 0.45f);
  return light;
}

/// Keeps colours below `knee` and bends brighter ones towards 1.
inline float tone(float x) {
  constexpr float knee = 0.7f;
  return x < knee ? x : knee + (1 - knee) * (1 - std::exp(-(x - knee) / (1 - knee)));
}

}  // namespace meniscus
