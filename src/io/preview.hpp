// The pictures that write_png writes.
#pragma once

#include <cstdint>
#include <vector>

#include "meniscus/io.hpp"

namespace meniscus {

/// Draws a surface for people.
///
///   surface  its maps and camera; the mesh is not looked at
///
/// Returns [height][width][3] sRGB bytes, row 0 on top. Throws InvalidArgument when the maps do not
/// match the camera.
std::vector<std::uint8_t> draw_preview(const Surface& surface, Preview preview);

}  // namespace meniscus
