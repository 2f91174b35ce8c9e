// What is measured.
#pragma once

#include <vector>

#include "meniscus/types.hpp"

namespace meniscus::accuracy {

/// A map as the library returns it: depth in world units (+infinity: none), normals in world axes
/// (zero or missing: none).
struct Map {
  std::vector<float> depth;
  std::vector<Vec3> normal;
};

}  // namespace meniscus::accuracy
