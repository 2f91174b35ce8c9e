// specks: pinholes and specks of the surface (specks.cl).
#pragma once

#include "stages/sample/samples.hpp"
#include "stages/sample/surface_buffers.hpp"

namespace meniscus {

/// Closes pinholes and removes specks of the surface (kernel close_specks), four times, for holes
/// of a few samples. The first time only in the blocks that are listed: where all samples were
/// interpolated there are none. Beyond depth `large_until` (particle radii) pinholes alone are
/// closed (large_particles_until()). Changes the surface. Does not wait.
void close_specks(Device& device, const SurfaceBuffers& surface, const ListedBlocks& blocks,
                  double large_until);

/// The depth up to which a particle's radius spans two samples of `grid`, particle radii. Farther
/// away what looks like a flaw may be a drop, the tip of an arm or a gap between two of them.
double large_particles_until(const View& view, const SampleGrid& grid);

}  // namespace meniscus
