// region: where there is surface (paper 2.4.1).
#pragma once

#include "device/device.hpp"
#include "meniscus/parameters.hpp"
#include "stages/sample/samples.hpp"
#include "stages/sample/surface_buffers.hpp"
#include "stages/sheet/triangulate.hpp"

namespace meniscus {

/// The corners of the kept triangles on the device.
struct KeptTriangles {
  Buffer<float> corners;  // [9][stride] u, v (pixels), depth (particle radii) of each corner
  int count = 0, stride = 0;
};
KeptTriangles upload_triangles(Device& device, const Triangulation& mesh);

/// Depth of the kept triangles at every sample of the blocks that are `needed` (particle radii),
/// kNoSurface outside them. Drawn into a map, which is kNoSurface where the device draws by minima.
/// Waits, but for atomic minima. Throws DeviceError.
void draw_triangles(Device& device, const View& view, const KeptTriangles& triangles,
                    const SampleGrid& grid, const OccupiedBlocks& needed,
                    const Buffer<float>& into);

}  // namespace meniscus
