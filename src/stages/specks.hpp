// specks: pinholes and specks of the surface (specks.cl).
#pragma once

#include "stages/samples.hpp"
#include "stages/surface_buffers.hpp"

namespace meniscus {

/// Closes pinholes and removes specks of the surface (kernel close_specks), four times, for holes
/// of a few samples. The first time only in the blocks that are listed: where all samples were
/// interpolated there are none. `least_radius` is the smallest particle's on the screen, pixels.
/// Changes the surface. Does not wait.
void close_specks(Device& device, const SurfaceBuffers& surface, const ListedBlocks& blocks,
                  double least_radius);

}  // namespace meniscus
