// How good a mesh of all of a solid is, from every side.
#pragma once

#include <cstdint>

#include "accuracy/scene.hpp"
#include "meniscus/types.hpp"

namespace meniscus::accuracy {

/// Lengths are in s. Places of the mesh within 3/10 s of a crease of the truth count for the crease
/// alone. All are weighed by area.
struct ClosedFigures {
  std::int64_t triangles = 0;
  std::int64_t open_edges = 0;              // with one triangle
  std::int64_t bad_edges = 0;               // with more than two, or two that run the same way
  std::int64_t bad_vertices = 0;            // whose triangles are not one fan
  std::int64_t pieces = 0;                  // of the mesh that hang together
  std::int64_t bubbles = 0;                 // of these, pieces that enclose air
  double distance_rms = 0;                  // of the mesh from the truth
  double distance_999 = 0;                  // 99.9th percentile
  double distance_most = 0;                 // of the farthest place
  double normal_median = 0, normal_95 = 0;  // degrees, vertices' normals
  double within_median = 0, within_95 = 0;  // the same within triangles, interpolated
  double crease_rms = 0;                    // distance near creases; NaN: there are none
  double volume = 0;  // of the mesh over the truth's, less 1 (check_topology: its volume)
};

/// What a mesh is like by itself: counts, and its volume, s^3.
ClosedFigures check_topology(const Mesh& mesh);

/// Measures a mesh against a scene without splash.
ClosedFigures measure_closed(const Scene& scene, double true_volume, const Mesh& mesh);

}  // namespace meniscus::accuracy
