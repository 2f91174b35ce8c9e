// density: the particles' density field, which ends the contour (paper 2.4.1) and draws the splash
// (paper, end of 3).
#pragma once

#include "device/device.hpp"
#include "meniscus/parameters.hpp"
#include "stages/cells.hpp"
#include "stages/surface_buffers.hpp"
#include "stages/visible.hpp"

namespace meniscus {

/// Radius beyond which a particle adds nothing to the density: twice the smoothing length s, which
/// is two particle radii.
inline constexpr float kDensitySupport = 4;

/// A hash grid on the device.
struct DeviceCells {
  Buffer<float> x, y, z;  // [n] eye space in bucket order, particle radii
  Buffer<cl_int> start;   // [buckets + 1]
  float inverse_cell = 1;
  cl_uint mask = 0;
};

DeviceCells upload_cells(Device& device, const Cells& cells);

/// Takes back samples that lie off the kept triangles and where the density is below the contour's
/// (paper 2.4.1). Changes surface.depth. Returns for each sample that has a reference but no
/// surface that reference, and kNoSurface elsewhere. Does not wait.
Buffer<float> cut_contour(Device& device, const View& view, const DeviceCells& cells,
                          const Buffer<float>& triangle_depth, const Buffer<float>& reference,
                          const SurfaceBuffers& surface, const RegionParams& params);

/// Draws the density field's first crossing of params.blob_density around `splash` particles where
/// it lies in front of the surface. Changes the surface. Does not wait.
void draw_splash(Device& device, const View& view, const DeviceCells& cells,
                 const SplatParticles& splash, const SurfaceBuffers& surface,
                 const RegionParams& params);

}  // namespace meniscus
