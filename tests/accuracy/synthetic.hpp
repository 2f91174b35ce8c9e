// Truths made by hand: a flat wall that faces an orthographic camera.
#pragma once

#include <cmath>
#include <functional>
#include <limits>

#include "accuracy/figures/statistics.hpp"
#include "accuracy/map.hpp"
#include "accuracy/truth.hpp"

namespace meniscus::accuracy {

inline constexpr int kWidth = 160, kHeight = 200;
inline constexpr double kScale = 16;  // pixels per s
inline constexpr double kWall = 10;   // s; its depth
inline constexpr double kNothing = std::numeric_limits<double>::infinity();

inline Lens wall_lens() {
  Lens lens;
  lens.width = kWidth;
  lens.height = kHeight;
  lens.orthographic = true;
  lens.focal = kScale;
  lens.right = {1, 0, 0};
  lens.down = {0, 0, -1};
  lens.forward = {0, 1, 0};
  return lens;
}

inline std::size_t pixel(int x, int y) { return static_cast<std::size_t>(y) * kWidth + x; }

/// The wall where `inside(x, y)`, all of one class.
inline Truth wall(const std::function<bool(int, int)>& inside, PixelClass pixel_class) {
  constexpr std::size_t pixels = kWidth * kHeight;
  Truth truth;
  truth.lens = wall_lens();
  truth.depth.assign(pixels, kNothing);
  truth.normal.assign(pixels, {});
  truth.class_of.assign(pixels, PixelClass::none);
  truth.piece.assign(pixels, -1);
  for (int y = 0; y < kHeight; ++y)
    for (int x = 0; x < kWidth; ++x) {
      if (!inside(x, y)) continue;
      truth.depth[pixel(x, y)] = kWall;
      truth.normal[pixel(x, y)] = {0, -1, 0};
      truth.class_of[pixel(x, y)] = pixel_class;
    }
  return truth;
}

inline Truth whole_wall(PixelClass pixel_class = PixelClass::interior) {
  return wall([](int, int) { return true; }, pixel_class);
}

/// The wall's normal, turned.
inline Vec3 turned(double degrees) {
  return static_cast<Vec3>(Vec3d{std::sin(degrees * kDegree), -std::cos(degrees * kDegree), 0});
}

}  // namespace meniscus::accuracy
