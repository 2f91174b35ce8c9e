// Where a map is wrong, as a picture.
#pragma once

#include <string>

#include "accuracy/figures.hpp"
#include "accuracy/truth.hpp"

namespace meniscus::accuracy {

/// Writes the error along the normal as a PNG: white where there is none, red where the map lies
/// 0.2 s or more in front of the truth, blue where behind; green where the map misses surface,
/// yellow where it has surface that is not there. Throws OutputError.
void write_error_map(const std::string& path, const Truth& truth, const Map& map);

}  // namespace meniscus::accuracy
