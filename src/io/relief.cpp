// The cheap half of ambient occlusion, and its opposite: what rises and what falls away around a
// pixel, seen on the maps alone. Measured densely on every fourth pixel, or fewer of large
// pictures, and carried to the pixels between along the surface, so that it has no noise and does
// not run over edges.
#include <cmath>

#include "io/picture.hpp"

namespace meniscus {
namespace {

constexpr int kStep = 4;  // pixels between measurements, for each 768 lines of the picture
constexpr int kLines = 768;
constexpr int kSamples = 96;  // of the disc

struct Offset {
  float x, y;  // in disc radii
};

// An even cover of the unit disc (Vogel's sunflower).
std::vector<Offset> disc() {
  std::vector<Offset> offsets;
  for (int k = 0; k < kSamples; ++k) {
    const float r = std::sqrt((static_cast<float>(k) + .5f) / kSamples);
    const float angle = 2.39996323f * static_cast<float>(k);
    offsets.push_back({r * std::cos(angle), r * std::sin(angle)});
  }
  return offsets;
}

Relief measure(const Scene& scene, const std::vector<Offset>& offsets, float radius, int column,
               int row) {
  const std::size_t here = scene.at(column, row);
  const Vec3& center = scene.point[here];
  const Vec3& n = scene.normal[here];
  const double w = scene.view.w_row[2] * center.z + scene.view.w_row[3];
  const auto pixels_x = static_cast<float>(radius * scene.view.u_scale / w);
  const auto pixels_y = static_cast<float>(radius * scene.view.v_scale / w);
  // Beyond every image, and no number, fit no int.
  const auto whole = [](float pixels) {
    constexpr float kBeyond = 1 << 20;
    return std::abs(pixels) < kBeyond ? static_cast<int>(std::lround(pixels)) : 1 << 20;
  };
  Relief sum;
  for (const Offset& offset : offsets) {
    const int i = column + whole(offset.x * pixels_x);
    const int j = row + whole(offset.y * pixels_y);
    if (i < 0 || i >= scene.width || j < 0 || j >= scene.height) continue;
    const std::size_t there = scene.at(i, j);
    if (!scene.covered(there)) {
      sum.bulge += 1;
      continue;
    }
    const float height = dot(scene.point[there] - center, n) / radius;
    // What stands far in front is another body: it shades less the farther it is.
    if (height > 0)
      sum.hollow += height < 1 ? height : 1 / (height * height);
    else
      sum.bulge += std::min(-height, 1.0f);
  }
  return {sum.hollow / kSamples, sum.bulge / kSamples};
}

}  // namespace

std::vector<Relief> measure_relief(const Scene& scene, float radius) {
  const std::vector<Offset> offsets = disc();
  const int step = kStep * std::max(1, scene.height / kLines);
  const int columns = (scene.width + step - 1) / step, rows = (scene.height + step - 1) / step;
  const auto middle = [step](int cell, int side) {
    return std::min(cell * step + step / 2, side - 1);
  };
  const float reach = 1.5f * static_cast<float>(step);
  std::vector<Relief> coarse(static_cast<std::size_t>(columns) * static_cast<std::size_t>(rows));
  const auto coarse_at = [&](int i, int j) -> Relief& {
    return coarse[static_cast<std::size_t>(j) * static_cast<std::size_t>(columns) +
                  static_cast<std::size_t>(i)];
  };
  parallel_rows(rows, [&](int j) {
    for (int i = 0; i < columns; ++i) {
      const int column = middle(i, scene.width), row = middle(j, scene.height);
      if (scene.covered(scene.at(column, row)))
        coarse_at(i, j) = measure(scene, offsets, radius, column, row);
    }
  });

  std::vector<Relief> relief(scene.normal.size());
  parallel_pixels(scene, [&](int column, int row, std::size_t here) {
    if (!scene.covered(here)) return;
    const Vec3& center = scene.point[here];
    const Vec3& n = scene.normal[here];
    float weights = 0;
    Relief sum;
    for (int j = row / step - 1; j <= row / step + 1; ++j)
      for (int i = column / step - 1; i <= column / step + 1; ++i) {
        if (i < 0 || i >= columns || j < 0 || j >= rows) continue;
        const int c = middle(i, scene.width), r = middle(j, scene.height);
        const std::size_t there = scene.at(c, r);
        if (!scene.covered(there)) continue;
        const float x = static_cast<float>(c - column) / reach;
        const float y = static_cast<float>(r - row) / reach;
        const float off = dot(scene.point[there] - center, n);  // the tangent plane
        const float alike = std::max(dot(n, scene.normal[there]), 0.0f);
        const float alike2 = alike * alike, alike8 = alike2 * alike2 * alike2 * alike2;
        const float weight = std::max(1 - x * x, 0.0f) * std::max(1 - y * y, 0.0f) *
                             (alike8 + 1e-4f) * std::max(1 - off * off / 4, 0.0f);
        weights += weight;
        sum.hollow += weight * coarse_at(i, j).hollow;
        sum.bulge += weight * coarse_at(i, j).bulge;
      }
    relief[here] = weights > 1e-6f ? Relief{sum.hollow / weights, sum.bulge / weights}
                                   : measure(scene, offsets, radius, column, row);
  });
  return relief;
}

}  // namespace meniscus
