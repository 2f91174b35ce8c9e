// Preview `lit`: water photographed in a studio. All in eye space (x right, y up, z to the viewer),
// so that every camera gets the same light: a bright backdrop, a large soft box above to the left,
// a strip to the right and a low light from behind that water seen at a grazing angle reflects. All
// lights have wide soft borders: a flaw of the surface bends them instead of sparkling.
#include <cmath>

#include "io/picture.hpp"

namespace meniscus {
namespace {

float dot(const Vec3& a, const Vec3& b) { return a.x * b.x + a.y * b.y + a.z * b.z; }
Vec3 unit(const Vec3& v) { return v * (1 / std::sqrt(std::max(dot(v, v), 1e-20f))); }

// The backdrop as the picture's background; x and y run over the picture, -1 to 1, y up.
Color backdrop(float x, float y) {
  const Color top = {0.60f, 0.68f, 0.76f}, bottom = {0.86f, 0.89f, 0.92f};
  const Color color = mix(bottom, top, smoothstep(-1.0f, 1.1f, y));
  return color * (1 - 0.22f * smoothstep(0.4f, 1.6f, std::sqrt(x * x + y * y)));
}

// A rectangular light around a direction: 1 in its middle, 0 outside.
float soft_box(const Vec3& d, const Vec3& towards, const Vec3& right, float half_width,
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

// Light that comes from a direction.
Color studio(const Vec3& d) {
  Color light = mix({0.30f, 0.36f, 0.42f}, {0.80f, 0.88f, 0.95f}, smoothstep(-0.6f, 0.5f, d.y));
  light = light + Color{5.0f, 4.9f, 4.7f} * soft_box(d, unit({-0.5f, 0.72f, 0.48f}),
                                                     unit({0.48f, 0, 0.5f}), 0.55f, 0.40f);
  light = light + Color{1.6f, 1.8f, 2.0f} *
                      soft_box(d, unit({0.85f, 0.30f, 0.1f}), unit({0.1f, 0, -0.85f}), 0.25f, 0.8f);
  light = light +
          Color{1.4f, 1.5f, 1.6f} * soft_box(d, unit({0, 0.62f, -0.78f}), {1, 0, 0}, 1.4f, 0.45f);
  return light;
}

// Keeps colours below `knee` and bends brighter ones towards 1.
float tone(float x) {
  constexpr float knee = 0.7f;
  return x < knee ? x : knee + (1 - knee) * (1 - std::exp(-(x - knee) / (1 - knee)));
}

Color water(const Vec3& n, const Vec3& v, bool splash) {
  const float facing = std::clamp(dot(n, v), 0.02f, 1.0f);
  const float away = 1 - facing;
  const float fresnel = 0.02f + 0.98f * away * away * away * away * away;
  const Vec3 reflected = n * (2 * facing) + v * -1.0f;

  // The refracted ray: where the light behind the water comes from.
  constexpr float eta = 1 / 1.333f;
  const float k = 1 - eta * eta * (1 - facing * facing);
  const Vec3 refracted = n * (eta * facing - std::sqrt(k)) + v * -eta;
  const Color behind =
      mix({0.42f, 0.47f, 0.52f}, {0.85f, 0.90f, 0.95f}, smoothstep(-0.7f, 0.5f, refracted.y));

  // Long ways through the water swallow red first; a silhouette is a short way.
  const float way = (splash ? 0.35f : 1.0f) * (0.35f + 0.65f * facing);
  const Color swallowed = {std::exp(-3.2f * way), std::exp(-0.95f * way), std::exp(-0.45f * way)};
  const float wrap = 0.5f + 0.5f * dot(n, unit({-0.45f, 0.75f, 0.5f}));
  const Color scattered = Color{0.03f, 0.25f, 0.36f} * (0.15f + 1.0f * wrap * wrap);
  const Color body = behind * swallowed * 0.55f + scattered * (1 - std::exp(-1.6f * way));
  return mix(body, studio(reflected), fresnel);
}

}  // namespace

Picture draw_lit(const Scene& scene) {
  Picture picture(scene.normal.size());
  for (int row = 0; row < scene.height; ++row)
    for (int column = 0; column < scene.width; ++column) {
      const std::size_t k = scene.at(column, row);
      Color color;
      if (scene.covered(k))
        color = water(scene.normal[k], scene.to_eye(column, row),
                      scene.surface.kind[k] == Kind::splash);
      else
        color =
            backdrop(2 * (static_cast<float>(column) + .5f) / static_cast<float>(scene.width) - 1,
                     1 - 2 * (static_cast<float>(row) + .5f) / static_cast<float>(scene.height));
      picture[k] = {tone(color.x), tone(color.y), tone(color.z)};
    }
  return picture;
}

}  // namespace meniscus
