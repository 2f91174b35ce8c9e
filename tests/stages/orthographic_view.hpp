// A view without perspective.
#pragma once

#include "stages/view.hpp"

namespace meniscus {

/// One pixel is one world unit is one radius; (u, v) = (x + width / 2, height / 2 - y).
inline View orthographic_view(int width, int height) {
  Camera camera;
  camera.width = width;
  camera.height = height;
  camera.view = {1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1};
  camera.projection = {2.0 / width, 0, 0, 0, 0, 2.0 / height, 0, 0, 0, 0, -0.001, -1, 0, 0, 0, 1};
  return make_view(camera, 1, {0, 0, 0});
}

}  // namespace meniscus
