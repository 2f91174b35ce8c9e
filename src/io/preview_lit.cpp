// Preview `lit`: water photographed in a studio. All in eye space (x right, y up, z to the viewer),
// so that every camera gets the same light: a bright backdrop, a large soft box above to the left,
// a strip to the right and a wide light from behind that water seen at a grazing angle reflects.
// All lights have wide soft borders: a flaw of the surface bends them instead of sparkling.
#include <cmath>

#include "io/picture.hpp"
#include "io/studio.hpp"

namespace meniscus {
namespace {

constexpr float kReliefRadius = 9;  // particle radii
constexpr Color kDeep = {0.000f, 0.062f, 0.185f}, kShallow = {0.060f, 0.54f, 0.70f};

// The backdrop; x and y run over the picture, -1 to 1, y up.
Color backdrop(float x, float y) {
  const Color color =
      mix({0.86f, 0.89f, 0.915f}, {0.56f, 0.64f, 0.72f}, smoothstep(-1.1f, 1.2f, y));
  const float glow = std::exp(-(0.7f * x * x + (y + 0.1f) * (y + 0.1f)) * 1.1f);
  const float corner = smoothstep(0.7f, 1.7f, std::sqrt(x * x + y * y));
  return (color + Color{0.07f, 0.07f, 0.065f} * glow) * (1 - 0.2f * corner);
}

// One point of the surface; `lit` says how near it lies to the key light, 0 to 1.
Color water(const Vec3& n, const Vec3& v, const Relief& relief, float lit) {
  // Below 0.2 the reflection would flicker from pixel to pixel along silhouettes.
  const float facing = std::clamp(dot(n, v), 0.2f, 1.0f);
  const float away = 1 - facing;
  const float fresnel = 0.02f + 0.98f * away * away * away * away * away;
  const Vec3 reflected = n * (2 * facing) + v * -1.0f;
  const float open = 1 - std::min(1.6f * relief.hollow, 0.75f);

  // What shines through: a drop is a lens, its far side a sphere's.
  const Vec3 inside = refract(v * -1.0f, n, kWater);
  const Vec3 far_normal = n + inside * (-2 * dot(n, inside));
  const Vec3 behind = refract(inside, far_normal * -1.0f, 1 / kWater);
  const Color lens = studio(behind) * Color{0.50f, 0.68f, 0.72f};

  // What the water itself sends back: more and greener where light enters and where it is thin.
  const float bulge = relief.bulge;
  const float wrap = 0.5f + 0.5f * dot(n, kKey);
  const Color depths =
      mix(kDeep, kShallow,
          0.57f * wrap * wrap * wrap + 0.22f * lit + 0.24f * smoothstep(0.1f, 0.8f, bulge));
  const float clear = 0.65f * smoothstep(0.40f, 0.86f, bulge);
  const Color body = mix(depths, lens, clear);
  return mix(body * open, studio(reflected) * (0.4f + 0.6f * open), fresnel);
}

// How near points lie to the key light, 0 to 1 over what is in view.
struct KeyLight {
  double mean = 0, spread = 1;  // along the light's direction, radii

  explicit KeyLight(const Scene& scene) {
    struct Sums {
      double sum = 0, squares = 0, count = 0;
    };
    std::vector<Sums> rows(static_cast<std::size_t>(scene.height));
    parallel_rows(scene.height, [&](int row) {
      Sums& sums = rows[static_cast<std::size_t>(row)];
      for (int column = 0; column < scene.width; ++column) {
        const std::size_t k = scene.at(column, row);
        if (!scene.covered(k)) continue;
        const double along = dot(scene.point[k], kKey);
        sums.sum += along;
        sums.squares += along * along;
        sums.count += 1;
      }
    });
    Sums all;
    for (const Sums& row : rows) {
      all.sum += row.sum;
      all.squares += row.squares;
      all.count += row.count;
    }
    const double count = std::max(all.count, 1.0);
    mean = all.sum / count;
    spread = std::sqrt(std::max(all.squares / count - mean * mean, 1e-6));
  }

  float nearness(const Vec3& point) const {
    return smoothstep(-2, 2, static_cast<float>((dot(point, kKey) - mean) / spread));
  }
};

// The soft shadow of the water on the backdrop, 0 to 1: its silhouette, blurred and let down. Of
// large pictures it is made on squares of pixels, which the blur hides.
struct Shadow {
  int side = 1;  // of a square, pixels
  int width = 0, height = 0;
  std::vector<float> values;  // [height][width]

  explicit Shadow(const Scene& scene);
  std::size_t at(int column, int row) const {
    return static_cast<std::size_t>(row) * static_cast<std::size_t>(width) +
           static_cast<std::size_t>(column);
  }
  // At a pixel, between the middles of four squares.
  float at_pixel(int column, int row) const {
    if (side == 1) return values[at(column, row)];
    const auto place = [&](int pixel, int squares, int& first) {
      const float x = (static_cast<float>(pixel) + .5f) / static_cast<float>(side) - .5f;
      first = std::clamp(static_cast<int>(std::floor(x)), 0, std::max(squares - 2, 0));
      return std::clamp(x - static_cast<float>(first), 0.0f, 1.0f);
    };
    int i = 0, j = 0;
    const float x = place(column, width, i), y = place(row, height, j);
    const int right = std::min(i + 1, width - 1), below = std::min(j + 1, height - 1);
    return (1 - y) * ((1 - x) * values[at(i, j)] + x * values[at(right, j)]) +
           y * ((1 - x) * values[at(i, below)] + x * values[at(right, below)]);
  }
};

Shadow::Shadow(const Scene& scene) {
  constexpr int kLines = 768;  // what needs no squares
  side = std::max(1, scene.height / kLines);
  width = (scene.width + side - 1) / side;
  height = (scene.height + side - 1) / side;
  values.resize(static_cast<std::size_t>(width) * static_cast<std::size_t>(height));
  const int reach = std::max(scene.height / 22 / side, 1), drop = scene.height / 28;
  parallel_rows(height, [&](int row) {
    for (int column = 0; column < width; ++column) {
      int covered = 0, all = 0;
      for (int j = row * side; j < std::min((row + 1) * side, scene.height); ++j)
        for (int i = column * side; i < std::min((column + 1) * side, scene.width); ++i, ++all)
          covered += j >= drop && scene.covered(scene.at(i, j - drop));
      values[at(column, row)] = static_cast<float>(covered) / static_cast<float>(all);
    }
  });
  // Three running means each way are nearly a Gaussian. Lines go side by side, so that columns are
  // read along their rows.
  const auto blur = [&](bool rows) {
    constexpr int kTogether = 16;
    const int length = rows ? width : height, lines = rows ? height : width;
    const int together = rows ? 1 : kTogether;
    const auto place = [&](int k, int line) { return rows ? at(k, line) : at(line, k); };
    parallel_rows((lines + together - 1) / together, [&](int block) {
      const int first_line = block * together, some = std::min(together, lines - first_line);
      const auto count = static_cast<std::size_t>(some);
      std::vector<double> sums((static_cast<std::size_t>(length) + 1) * count);
      for (int k = 0; k < length; ++k) {
        double* const sum = &sums[static_cast<std::size_t>(k) * count];
        const float* const value = &values[place(k, first_line)];
        for (std::size_t i = 0; i < count; ++i) sum[count + i] = sum[i] + value[i];
      }
      for (int k = 0; k < length; ++k) {
        const int first = std::max(k - reach, 0), end = std::min(k + reach + 1, length);
        const double* const low = &sums[static_cast<std::size_t>(first) * count];
        const double* const high = &sums[static_cast<std::size_t>(end) * count];
        float* const value = &values[place(k, first_line)];
        for (std::size_t i = 0; i < count; ++i)
          value[i] = static_cast<float>((high[i] - low[i]) / (end - first));
      }
    });
  };
  for (int round = 0; round < 3; ++round) {
    blur(true);
    blur(false);
  }
}

}  // namespace

Picture draw_lit(const Scene& scene, const std::function<void(double)>& reached) {
  const std::vector<Relief> relief = measure_relief(scene, kReliefRadius);
  reached(0.4);
  const KeyLight light(scene);
  const Shadow shadow(scene);
  reached(0.65);
  Picture picture(scene.normal.size());
  parallel_pixels(scene, [&](int column, int row, std::size_t k) {
    Color color;
    if (scene.covered(k)) {
      color = water(scene.normal[k], scene.to_eye(column, row), relief[k],
                    light.nearness(scene.point[k]));
    } else {
      color = backdrop((2 * static_cast<float>(column) + 1) / static_cast<float>(scene.width) - 1,
                       1 - (2 * static_cast<float>(row) + 1) / static_cast<float>(scene.height));
      color = mix(color, color * Color{0.50f, 0.66f, 0.74f}, 0.75f * shadow.at_pixel(column, row));
    }
    picture[k] = {tone(color.x), tone(color.y), tone(color.z)};
  });
  return picture;
}

}  // namespace meniscus
