// What the previews share: colours, the surface as eye sees it, edges.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <functional>
#include <vector>

#include "base/parallel.hpp"
#include "meniscus/types.hpp"
#include "stages/view.hpp"

namespace meniscus {

/// Calls work(row) for each row, on as many threads as there are. Rows must not depend on each
/// other.
template <class Work>
void parallel_rows(int rows, const Work& work) {
  constexpr std::size_t kGrain = 8;
  parallel_for(static_cast<std::size_t>(rows), kGrain, [&](std::size_t begin, std::size_t end) {
    for (std::size_t row = begin; row < end; ++row) work(static_cast<int>(row));
  });
}

/// A colour: x, y, z are red, green, blue in linear light, 1 is display white.
using Color = Vec3;
inline Color operator+(Color a, Color b) { return {a.x + b.x, a.y + b.y, a.z + b.z}; }
inline Color operator*(Color a, Color b) { return {a.x * b.x, a.y * b.y, a.z * b.z}; }
inline Color operator*(Color a, float s) { return {a.x * s, a.y * s, a.z * s}; }
inline Vec3 operator-(const Vec3& a, const Vec3& b) { return {a.x - b.x, a.y - b.y, a.z - b.z}; }
inline float dot(const Vec3& a, const Vec3& b) { return a.x * b.x + a.y * b.y + a.z * b.z; }
inline Color mix(Color a, Color b, float share) { return a * (1 - share) + b * share; }

/// 0 up to `low`, 1 from `high` on, smooth between.
inline float smoothstep(float low, float high, float x) {
  const float s = std::clamp((x - low) / (high - low), 0.0f, 1.0f);
  return s * s * (3 - 2 * s);
}

/// The surface in eye space: lengths in particle radii, see view.hpp.
struct Scene {
  const Surface& surface;
  View view;
  int width, height;
  std::vector<Vec3> normal;  // [height*width] unit, eye axes; zero where there is no surface
  std::vector<Vec3> point;   // [height*width] eye space; zero where there is no surface

  explicit Scene(const Surface& surface_);
  std::size_t at(int column, int row) const {
    return static_cast<std::size_t>(row) * static_cast<std::size_t>(width) +
           static_cast<std::size_t>(column);
  }
  bool covered(std::size_t pixel) const { return std::isfinite(surface.depth[pixel]); }
  float depth(std::size_t pixel) const { return -point[pixel].z; }
  /// Unit vector from the surface point at a pixel to the eye.
  Vec3 to_eye(int column, int row) const;
};

/// Calls work(column, row, pixel) for each pixel of a scene, as parallel_rows() does.
template <class Work>
void parallel_pixels(const Scene& scene, const Work& work) {
  parallel_rows(scene.height, [&](int row) {
    for (int column = 0; column < scene.width; ++column) work(column, row, scene.at(column, row));
  });
}

/// [height*width] colours.
using Picture = std::vector<Color>;

/// How the surface lies around a pixel, over a disc of some particle radii.
struct Relief {
  float hollow = 0;  // 0 flat or bulging, to 1: how much rises before the surface and shades it
  float bulge = 0;   // 0 flat or hollow, to 1: how much falls away, as around a drop or at an edge
};

/// [height*width] the relief on a disc of `radius` particle radii around each pixel.
std::vector<Relief> measure_relief(const Scene& scene, float radius);

/// Water in a studio (preview `lit`). Calls reached(share) with the share that is done, 0 to 1.
Picture draw_lit(const Scene& scene, const std::function<void(double)>& reached);

/// Clear water before a wall (preview `glass`); the scene's surface has layers.
Picture draw_glass(const Scene& scene, const std::function<void(double)>& reached);

/// Foam, spray and bubbles of the scene's surface over a picture of its water.
Picture draw_whitewater_over(const Scene& scene, Picture picture);

/// Blends colours over the silhouettes, depth steps and creases of a scene, whose maps have one
/// sample a pixel: each step of a jagged border is replaced by the straight line that it stands for
/// (Reshetov 2009, Morphological Antialiasing, on depth and normals instead of colour). Pixels that
/// do not touch such a border keep their colour.
Picture smooth_borders(const Scene& scene, Picture picture);

}  // namespace meniscus
