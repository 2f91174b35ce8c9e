// merge_groups: method paper merges triangles of similar normal into groups (paper 2.2, step 3).
#pragma once

#include <vector>

#include "meniscus/parameters.hpp"
#include "stages/sheet/triangulate.hpp"

namespace meniscus {

/// Groups of triangles. Group g has the vertices point[start[g]] .. point[start[g + 1] - 1].
struct Groups {
  std::vector<Vec3d> centre;            // [groups] mean of the member vertices, eye space
  std::vector<Vec3d> normal;            // [groups] unit, towards the camera
  std::vector<double> radius;           // [groups] farthest member, particle radii
  std::vector<std::int32_t> triangles;  // [groups] how many were merged
  std::vector<std::int32_t> start, point;
  std::vector<std::int32_t> group_of_triangle;  // [triangles] -1: ghost
  std::size_t size() const { return centre.size(); }
};

/// Merges edge-neighbours in sweeps: each group chooses the neighbour with the nearest normal
/// among those with n.n' > cosine whose centre is nearer than `distance` (0: however far), and two
/// groups that chose each other merge (ties: lower index). Ends when no two do. The result does not
/// depend on any order. Centres are means of the triangles' centroids, weighed by area.
Groups merge_groups(const Triangulation& mesh, const std::vector<Vec3d>& normals,
                    const MergeParams& params);

}  // namespace meniscus
