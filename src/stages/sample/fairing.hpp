// fairing: normals evened out along a sheet (fairing.cl).
#pragma once

#include "stages/sample/surface_buffers.hpp"
#include "stages/stage_data.hpp"

namespace meniscus {

/// Evens out the normals of a surface within about `sigma` particle radii on either side, along
/// rows and then along columns (kernel fair_normals). Depths stay. Does not wait.
void fair_normals(Device& device, const View& view, const SurfaceBuffers& surface, double sigma);

}  // namespace meniscus
