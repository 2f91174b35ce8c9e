// triangulate: Delaunay of the visible particles on the screen (paper 2.2, steps 1 and 2).
#pragma once

#include <array>
#include <cstddef>
#include <vector>

#include "meniscus/parameters.hpp"
#include "stages/frame/project.hpp"
#include "stages/frame/visible.hpp"

namespace meniscus {

/// A screen position.
struct ScreenPoint {
  double u, v;  // pixels
};

/// Delaunay triangulation of points on the screen, which can lose points again. Cocircular points
/// (lattices) are settled by the lexicographic order of their coordinates, so the triangles depend
/// on the set of points alone, and not on how it came about.
class ScreenDelaunay {
 public:
  /// Of [n] points, finite, in canonical order; of points at one place only the first is used.
  /// So many strips of the screen are triangulated side by side, which touches no result; 0: as
  /// many as pay.
  explicit ScreenDelaunay(std::vector<ScreenPoint> points, std::size_t strips = 0);

  /// Points, as they are counted from now on, around which there may be other triangles than
  /// before, and all triangles around them; both ascending.
  struct Changes {
    std::vector<std::int32_t> points;
    std::vector<std::array<std::int32_t, 3>> triangles;
  };

  /// Leaves out the points with these indices, ascending; the others move up.
  Changes remove(const std::vector<std::int32_t>& indices);

  /// Triangles of point indices, the smallest first, in ascending order, all wound the same way.
  const std::vector<std::array<std::int32_t, 3>>& triangles() const { return triangles_; }

 private:
  std::vector<ScreenPoint> points_;
  std::vector<std::array<std::int32_t, 3>> triangles_;
};

/// The triangles of all points.
inline std::vector<std::array<std::int32_t, 3>> delaunay(const std::vector<ScreenPoint>& points) {
  return ScreenDelaunay(points).triangles();
}

enum class TriangleKind : std::uint8_t {
  dropped,  // an edge too long on the screen: it bridges a gap
  kept,
  ghost,  // too deep a jump: it keeps the region closed but belongs to no sheet
};

/// The visible particles as a triangulated height field over the screen.
struct Triangulation {
  std::vector<std::int32_t> particle;                 // [vertices] index into Projected
  std::vector<Vec3d> position;                        // [vertices] eye space, particle radii
  std::vector<ScreenPoint> screen;                    // [vertices] pixels
  std::vector<float> owned;                           // [vertices] share of the own footprint
  std::vector<std::array<std::int32_t, 3>> triangle;  // vertex indices
  std::vector<TriangleKind> kind;                     // [triangles]
  std::vector<Vec3d> normal;                 // [triangles] unit, towards the camera, eye space
  std::vector<double> area;                  // [triangles] in space, square particle radii
  std::vector<std::int32_t> fan_start, fan;  // kept triangles around each vertex (CSR), ascending
};

/// Triangulates the visible particles, drops triangles with an edge longer than max_edge particle
/// radii on the screen, and makes those whose depth range exceeds d_max ghosts (paper 2.2, step 2).
Triangulation triangulate(const View& view, const Projected& projected, const Visible& visible,
                          const TriangleParams& params);

/// Visible particles and their triangulation.
struct SeenMesh {
  Visible visible;
  Triangulation mesh;
};

/// triangulate() of the visible particles without those of the layer below that show through a gap
/// of the surface: vertices more than 0.9 particle radii plus the ring's own RMS distance behind
/// the plane through their ring of at least four neighbours. Over and over until none is left in
/// such a pit, at most three times: particles side by side in a pit go one after the other.
SeenMesh triangulate_without_pits(const View& view, const Projected& projected,
                                  const Visible& visible, const TriangleParams& params);

}  // namespace meniscus
