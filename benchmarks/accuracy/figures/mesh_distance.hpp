// How far the vertices of a mesh are from the true surface.
#pragma once

#include "accuracy/figures/statistics.hpp"
#include "accuracy/truth.hpp"
#include "meniscus/types.hpp"

namespace meniscus::accuracy {

struct MeshDistance {
  double rms = kNone, p95 = kNone, p999 = kNone;  // s; vertices that project on the truth's inside
  double outline_rms = kNone;                     // s; vertices within 1.5 s of outlines, or beyond
};

/// Distances by the scene's distance function. A vertex outside the image does not count, nor one
/// of the spray, which lies within reach of a piece's field, as no point of the solid does.
MeshDistance mesh_distance(const Scene& scene, const Truth& truth, const Mesh& mesh);

}  // namespace meniscus::accuracy
