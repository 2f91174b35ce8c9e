// region: where there is surface (paper 2.4.1).
#pragma once

#include "device/device.hpp"
#include "meniscus/parameters.hpp"
#include "stages/samples.hpp"
#include "stages/surface_buffers.hpp"
#include "stages/triangulate.hpp"

namespace meniscus {

/// Depth of the kept triangles at every sample of the blocks that are `asked` for (particle radii),
/// kNoSurface outside them. Waits. Throws DeviceError.
Buffer<float> draw_triangles(Device& device, const View& view, const Triangulation& mesh,
                             const SampleGrid& grid, const OccupiedBlocks& asked);

}  // namespace meniscus
