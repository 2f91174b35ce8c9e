// Seeing a triangle mesh through a lens.
#pragma once

#include "accuracy/map.hpp"
#include "accuracy/scene.hpp"
#include "meniscus/types.hpp"

namespace meniscus::accuracy {

/// Depth and normal of the nearest triangle at the pixel centres, from either side. The normal is
/// the vertices' normals interpolated, or the triangle's where the mesh has none. The mesh and the
/// lens have the same unit of length.
Map ray_cast(const Mesh& mesh, const Lens& lens);

/// The vertices of the mesh that the lens sees: at most `slack` behind the depth of their pixel.
Mesh visible_vertices(const Mesh& mesh, const Lens& lens, const Map& map, double slack);

}  // namespace meniscus::accuracy
