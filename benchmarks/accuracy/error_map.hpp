// Where a map is wrong, as a picture.
#pragma once

#include <span>

#include "accuracy/map.hpp"
#include "accuracy/png.hpp"
#include "accuracy/truth.hpp"

namespace meniscus::accuracy {

/// The error along the normal as a PNG: white where there is none, red where the map lies 0.2 s or
/// more in front of the truth, blue where behind; green where the map misses surface, yellow where
/// it has surface that is not there.
Bytes error_map(const Truth& truth, const Map& map);

/// Where maps are unsteady: the largest second difference (see figures/flicker.hpp) at each pixel,
/// white where there is none, red where it is 0.2 s or more, dark where it is not measured.
Bytes change_map(const Lens& lens, std::span<const Map> maps);

}  // namespace meniscus::accuracy
