// layers: where the ray of each pixel enters and leaves a mesh of the fluid, and how that goes with
// the front that the pixel shows. The mesh is closed but for what the front shows.
//
// The mesh is drawn as it is: its vertices at 4096ths of a pixel, so that whether a triangle covers
// a pixel's centre is decided in whole numbers, and triangles that share an edge never both cover
// it nor both leave it out. So a ray leaves a closed mesh as often as it enters it, and intervals
// between the two are found by counting; what it leaves more often, it entered at the front.
//
// The front is right about where there is fluid first: the first interval begins there. What the
// mesh has before the front is left out, what it has behind a pixel without a front, too. Where the
// mesh has nothing near the front, as at the rim of a drop, the front is a film of its own.
#pragma once

#include <vector>

#include "stages/closed/dual_mesh.hpp"
#include "stages/stage_data.hpp"

namespace meniscus {

/// The layers along the rays through pixel centres; `most` are kept of each.
///
///   mesh   in the view's eye space: positions, normals and triangles. Triangles that reach behind
///          the eye are left out
///   front  [pixels] depths that the pixels show, world units; kNoSurface. They become the first
///          entries: room for `most` times as many saves a copy
Layers trace_layers(const View& view, const DualMesh& mesh, std::vector<float> front, int most);

}  // namespace meniscus
