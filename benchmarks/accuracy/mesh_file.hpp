// Reading the meshes that other programs write.
#pragma once

#include <string>

#include "meniscus/types.hpp"

namespace meniscus::accuracy {

/// Reads triangles from a binary little-endian PLY: element vertex with x, y, z and, when there,
/// nx, ny, nz (other properties are skipped), then element face with one list. Throws InputError
/// with the file, the place, what was found and what was wanted.
Mesh read_mesh(const std::string& path);

}  // namespace meniscus::accuracy
