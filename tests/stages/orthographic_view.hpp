// Views without perspective.
#pragma once

#include <array>

#include "stages/view.hpp"

namespace meniscus {

/// Down -z, with these factors from eye to clip space.
inline View orthographic_view(int width, int height, const std::array<double, 3>& scale,
                              double radius = 1) {
  Camera camera;
  camera.width = width;
  camera.height = height;
  camera.view = {1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1};
  camera.projection = {scale[0], 0, 0, 0, 0, scale[1], 0, 0, 0, 0, scale[2], -1, 0, 0, 0, 1};
  return make_view(camera, radius, {0, 0, 0});
}

/// One pixel is one world unit is one radius; (u, v) = (x + width / 2, height / 2 - y).
inline View orthographic_view(int width, int height) {
  return orthographic_view(width, height, {2.0 / width, 2.0 / height, -0.001});
}

}  // namespace meniscus
