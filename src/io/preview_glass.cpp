// Preview `glass`: clear water before a checkered wall. A ray is refracted where it enters the
// fluid, and once more where it leaves it; light on its way is absorbed (Beer and Lambert).
//
// Where the refracted ray leaves the fluid is told by the maps alone, as Wyman (2005) does: it goes
// as far within the fluid as the straight ray does, and the back seen at the pixel that shows that
// place is the back that it leaves through.
#include <algorithm>
#include <cmath>
#include <utility>
#include <vector>

#include "io/picture.hpp"
#include "io/studio.hpp"

namespace meniscus {
namespace {

// Of white light, after as much fluid as a twentieth of the pixels have more of.
constexpr Color kClear = {0.24f, 0.66f, 0.74f};
constexpr Color kScattered = {0.010f, 0.100f, 0.150f};  // what deep water sends back
constexpr int kSquares = 9;                             // of the wall, down the picture

// Where a ray goes that is behind all of the fluid.
struct Sight {
  float x, y;   // of the wall, squares
  float ahead;  // 0 beside it to 1
  Vec3 along;
};

// The wall stands at right angles to the view, behind all of the fluid.
struct Wall {
  float z, square;  // radii; the side of a square
  float centre_x, centre_y;

  explicit Wall(const Scene& scene) {
    const Layers& layers = scene.surface.layers;
    const std::size_t pixels = layers.count.size();
    float farthest = 0;
    for (std::size_t k = 0; k < pixels * static_cast<std::size_t>(layers.most); ++k)
      if (std::isfinite(layers.exit[k])) farthest = std::max(farthest, layers.exit[k]);
    const double depth = std::max(1.04 * farthest / scene.view.radius, 1.0);
    const Vec3d top = point_at(scene.view, 0.5 * scene.width, 0, depth),
                foot = point_at(scene.view, 0.5 * scene.width, scene.height, depth);
    z = static_cast<float>(-depth);
    centre_x = static_cast<float>((top.x + foot.x) / 2);
    centre_y = static_cast<float>((top.y + foot.y) / 2);
    square = static_cast<float>(length(top - foot)) / kSquares;
  }

  // Where a ray from a place meets the wall, and how far it looks ahead; 0: beside it.
  Sight sight_of(const Vec3& at, const Vec3& along) const {
    Sight sight{0, 0, smoothstep(0.02f, 0.25f, -along.z), along};
    if (!(sight.ahead > 0)) return sight;
    const float far = (z - at.z) / along.z;
    sight.x = (at.x + far * along.x - centre_x) / square;
    sight.y = (at.y + far * along.y - centre_y) / square;
    return sight;
  }

  // Its light; `width` of the wall, in squares, goes into one pixel.
  Color light_of(const Sight& sight, float width) const {
    if (!(sight.ahead > 0)) return studio(sight.along);  // rays along the wall see the room
    const float soft = std::min(0.04f + 0.7f * width, 0.5f);
    const auto stripe = [&](float s) {
      const float phase = std::abs(s * 0.5f - std::floor(s * 0.5f) - 0.5f) * 2;
      return 2 * smoothstep(0.5f - soft, 0.5f + soft, phase) - 1;
    };
    const float contrast = 1 - smoothstep(0.2f, 0.9f, width);
    const float dark = 0.5f + 0.5f * contrast * stripe(sight.x) * stripe(sight.y);
    const float out = std::sqrt(sight.x * sight.x + sight.y * sight.y) * 2 / kSquares;
    const Color squares = mix({0.84f, 0.85f, 0.86f}, {0.26f, 0.30f, 0.36f}, dark);
    const Color wall = squares * (1.06f - 0.34f * smoothstep(0, 1.9f, out));
    return mix(studio(sight.along), wall, sight.ahead * (1 - smoothstep(3, 6, out)));
  }
};

// Which light is absorbed: exponents per world unit.
Color absorption_of(const Layers& layers) {
  std::vector<float> thickness;
  for (const float t : layers.thickness)
    if (t > 0 && std::isfinite(t)) thickness.push_back(t);
  if (thickness.empty()) return {};
  const auto place =
      thickness.begin() + static_cast<std::ptrdiff_t>((thickness.size() - 1) * 95 / 100);
  std::nth_element(thickness.begin(), place, thickness.end());
  return {-std::log(kClear.x) / *place, -std::log(kClear.y) / *place, -std::log(kClear.z) / *place};
}

struct Glass {
  const Scene& scene;
  Wall wall{scene};
  Color absorption = absorption_of(scene.surface.layers);

  Vec3 back_normal(std::size_t pixel) const {
    const Vec3& n = scene.surface.layers.back_normal[pixel];
    const auto& m = scene.view.rotation;
    const Vec3d eye{m[0] * n.x + m[1] * n.y + m[2] * n.z, m[3] * n.x + m[4] * n.y + m[5] * n.z,
                    m[6] * n.x + m[7] * n.y + m[8] * n.z};
    return unit(static_cast<Vec3>(eye));
  }

  // The back's normal where the picture shows a point, or that of `otherwise`.
  Vec3 back_at(const Vec3& point, std::size_t otherwise) const {
    const PixelPosition p = project(scene.view, Vec3d(point));
    if (!(p.w > 0 && p.u >= 0 && p.v >= 0 && p.u < scene.width && p.v < scene.height))
      return back_normal(otherwise);
    const std::size_t pixel = scene.at(static_cast<int>(p.u), static_cast<int>(p.v));
    return back_normal(scene.covered(pixel) ? pixel : otherwise);
  }

  // What a pixel looks at: of the fluid twice refracted.
  Sight sight_at(int column, int row) const {
    const std::size_t k = scene.at(column, row);
    const double u = column + 0.5, v = row + 0.5;
    if (!scene.covered(k))
      return wall.sight_of(static_cast<Vec3>(point_at(scene.view, u, v, 0)),
                           static_cast<Vec3>(normalized(ray_direction(scene.view, u, v))));
    const Layers& layers = scene.surface.layers;
    const Vec3 along = scene.to_eye(column, row) * -1.0f;
    const Vec3 inside = refract(along, scene.normal[k], kWater);
    const float way = (layers.exit[k] - layers.entry[k]) / static_cast<float>(scene.view.radius) /
                      std::max(-along.z, 1e-3f);
    const Vec3 leaves = scene.point[k] + inside * way;
    // Beyond the angle of total reflection refract() goes on along the surface.
    return wall.sight_of(leaves, unit(refract(inside, back_at(leaves, k) * -1.0f, 1 / kWater)));
  }

  // The light of a pixel from what it looks at.
  Color at(int column, int row, const Color& behind) const {
    const std::size_t k = scene.at(column, row);
    if (!scene.covered(k)) return behind;
    const float t = scene.surface.layers.thickness[k];
    const Color left = {std::exp(-absorption.x * t), std::exp(-absorption.y * t),
                        std::exp(-absorption.z * t)};
    const Color through = {behind.x * left.x + kScattered.x * (1 - left.x),
                           behind.y * left.y + kScattered.y * (1 - left.y),
                           behind.z * left.z + kScattered.z * (1 - left.z)};
    const Vec3 &n = scene.normal[k], to_eye = scene.to_eye(column, row);
    const float facing = std::clamp(dot(n, to_eye), 0.0f, 1.0f), away = 1 - facing;
    const float fresnel = 0.02f + 0.98f * away * away * away * away * away;
    return mix(through, studio(n * (2 * facing) + to_eye * -1.0f), fresnel);
  }
};

// How much of the wall goes into a pixel, in squares: from its sight and those beside it. Beyond an
// outline others do not count.
float width_at(const Scene& scene, const std::vector<Sight>& sights, int column, int row) {
  const std::size_t k = scene.at(column, row);
  float width = 0;
  for (const auto& [di, dj] : {std::pair{-1, 0}, {1, 0}, {0, -1}, {0, 1}}) {
    const int i = column + di, j = row + dj;
    if (i < 0 || j < 0 || i >= scene.width || j >= scene.height) continue;
    const std::size_t other = scene.at(i, j);
    if (scene.covered(other) != scene.covered(k)) continue;
    width +=
        std::min(1.0f, std::hypot(sights[other].x - sights[k].x, sights[other].y - sights[k].y)) /
        4;
  }
  return width;
}

}  // namespace

Picture draw_glass(const Scene& scene, const std::function<void(double)>& reached) {
  const Glass glass{scene};
  reached(0.2);
  std::vector<Sight> sights(scene.normal.size());
  parallel_pixels(
      scene, [&](int column, int row, std::size_t k) { sights[k] = glass.sight_at(column, row); });
  reached(0.6);
  Picture picture(scene.normal.size());
  parallel_pixels(scene, [&](int column, int row, std::size_t k) {
    const Color color =
        glass.at(column, row, glass.wall.light_of(sights[k], width_at(scene, sights, column, row)));
    picture[k] = {tone(color.x), tone(color.y), tone(color.z)};
  });
  reached(1);
  return picture;
}

}  // namespace meniscus
