// smooth_normals: the triangles' normals, smoothed (paper 2.2, step 3).
#pragma once

#include <vector>

#include "stages/sheet/triangulate.hpp"

namespace meniscus {

/// Bilateral smoothing of the kept triangles' normals around some vertices: each becomes the sum
/// over the triangles that share a vertex with it of area * ((1 + n.n') / 2)^16 * n', normalised.
/// Others' normals are left as they come.
std::vector<Vec3d> smooth_normals(const Triangulation& mesh, int rounds,
                                  const std::vector<std::int32_t>& vertices);

}  // namespace meniscus
