// simplify: fewer triangles where a mesh is flat. Edges collapse, those first whose ends are
// nearest to a common point of the planes around them (quadric error metrics, Garland and Heckbert
// 1997), the volume stays as it is (Lindstrom and Turk 1998), and every vertex of the full mesh is
// kept in mind to the end (as Klein, Liebich and Strasser 1996), so that the distance is known.
#pragma once

#include "meniscus/types.hpp"

namespace meniscus {

/// Collapses edges of a mesh.
///
///   mesh       closed and manifold: every edge has two triangles that run against each other, the
///              triangles around every vertex are one fan
///   tolerance  how far a vertex of `mesh` may be from the mesh returned, of `unit`, > 0
///   unit       about the length of its edges, world units: the particle radius
///
/// Returns a mesh that is closed, manifold and oriented as `mesh`, with the same pieces. Every
/// vertex of `mesh` is within `tolerance` of it, but for the rounding of positions to floats; its
/// normal, unless it lies on a crease, is within 10 degrees of the interpolated one there. Values
/// at vertices are interpolated. The same mesh gives the same bytes with any number of threads.
/// Throws InvalidArgument where an edge of `mesh` has not two triangles.
Mesh simplify(Mesh mesh, double tolerance, double unit);

}  // namespace meniscus
