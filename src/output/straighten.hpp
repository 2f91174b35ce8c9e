// straighten: edges of a closed mesh as straight as the faces beside them are flat. The particles
// of a liquid's edge do not lie in a row, so that the implicit function has chips and teeth there,
// one cell large. The normals of triangles are filtered, each by those that agree with what is
// flattest around it, and vertices follow (guided normal filtering, Zhang, Deng, Zhang, Bouaziz and
// Liu 2015; vertices as Sun, Rosin, Martin and Langbein 2007).
#pragma once

#include "meniscus/types.hpp"

namespace meniscus {

/// Moves vertices on and beside edges that have something flat near them; drops, arms and smooth
/// faces stay. Triangles stay, too.
///
///   mesh  closed and manifold
///   cell  about the length of its edges, world units
///   unit  the particle radius, world units
///
/// Moved vertices have the normals of the filtered triangles around them. The same mesh gives the
/// same bytes with any number of threads.
void straighten_edges(Mesh& mesh, double cell, double unit);

}  // namespace meniscus
