// blend: the intersections of a ray with the fits it meets, blended (paper 2.4.2, Eqs. 6 and 7). A
// fit is the group around its particle.
#pragma once

#include "device/device.hpp"
#include "meniscus/parameters.hpp"
#include "stages/sample/fit_records.hpp"
#include "stages/sample/samples.hpp"
#include "stages/sample/surface_buffers.hpp"
#include "stages/sample/tile_lists.hpp"

namespace meniscus {

/// Blends the groups at the listed samples, whose reference depths are finite (kernel
/// blend_groups), and writes depth, normal and group there. Does not wait.
void blend_groups(Device& device, const View& view, const SampleLists& lists,
                  const DeviceRecords& records, const FitTiles& tiles,
                  const Buffer<float>& reference, const SurfaceBuffers& surface,
                  const BlendParams& params);

/// The same at a list of points (kernel blend_points), with the lists of `tiles` on `grid`.
///
///   points  [2][n] u then v, pixels
///   surface  receives the n samples; its grid is n x 1
void blend_points(Device& device, const View& view, const DeviceRecords& records,
                  const FitTiles& tiles, const SampleGrid& grid, const Buffer<float>& points,
                  const Buffer<float>& reference, const SurfaceBuffers& surface,
                  const BlendParams& params);

/// The groups of a surface, of which interpolate_samples has left those of samples `every` apart or
/// less to be chosen (kernel choose_groups): for each the heaviest of those at such samples around
/// it. Does not wait.
Buffer<cl_int> choose_groups(Device& device, const View& view, const SurfaceBuffers& surface,
                             const DeviceRecords& records, int every, const BlendParams& params);

}  // namespace meniscus
