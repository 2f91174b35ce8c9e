// spray: drops that are too small for the surface, drawn on the image.
#pragma once

#include <cstdint>
#include <vector>

#include "prepare/thin.hpp"
#include "stages/stage_data.hpp"
#include "stages/view.hpp"

namespace meniscus {

/// Draws each drop as a sphere where it lies in front of the image's surface: on the pixels whose
/// centres it covers, or on the one that holds its centre, so that none is lost between pixels. The
/// nearest wins, of equally near ones the first; where the image has velocities, its pixels get
/// the drop's. Changes the image. Returns which drop each of the image's pixels shows, -1: none.
std::vector<std::int32_t> draw_spray(const View& view, const std::vector<SprayDrop>& spray,
                                     SurfaceMap& image);

}  // namespace meniscus
