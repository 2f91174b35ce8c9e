// The pictures that write_png writes.
#pragma once

#include <cstdint>
#include <functional>
#include <vector>

#include "meniscus/io.hpp"

namespace meniscus {

/// Draws a surface for people.
///
///   surface  its maps and camera; the mesh is not looked at
///   reached  is called with the share that is done, 0 to 1, now and then
///
/// Returns [height][width][3] sRGB bytes, row 0 on top. Throws InvalidArgument when the maps do not
/// match the camera.
std::vector<std::uint8_t> draw_preview(
    const Surface& surface, Preview preview,
    const std::function<void(double)>& reached = [](double) {});

}  // namespace meniscus
