// region: where there is surface (paper 2.4.1).
#pragma once

#include "device/device.hpp"
#include "meniscus/parameters.hpp"
#include "stages/surface_buffers.hpp"
#include "stages/triangulate.hpp"

namespace meniscus {

/// Depth of the kept triangles at every sample (particle radii), kNoSurface outside them. Does not
/// wait.
Buffer<float> draw_triangles(Device& device, const View& view, const Triangulation& mesh,
                             const SampleGrid& grid);

/// Closes pinholes and removes specks of the surface (kernel close_specks), four times, for holes
/// of a few samples. Changes the surface. Does not wait.
void close_specks(Device& device, const SurfaceBuffers& surface);

}  // namespace meniscus
