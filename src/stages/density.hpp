// density: the particles' density field, which ends the contour (paper 2.4.1) and draws the splash
// (paper, end of 3).
#pragma once

#include "device/device.hpp"
#include "meniscus/parameters.hpp"
#include "stages/cells.hpp"
#include "stages/samples.hpp"
#include "stages/surface_buffers.hpp"
#include "stages/visible.hpp"

namespace meniscus {

/// Radius beyond which a particle adds nothing to the density: twice the smoothing length s, which
/// is two particle radii.
inline constexpr float kDensitySupport = 4;

/// A ray that passes every particle at more than this many of its radii does not meet the levelled
/// field's surface, which lies one radius outside the particles, a little more between two.
inline constexpr double kCoreFootprint = 1.4;

/// A hash grid on the device.
struct DeviceCells {
  Buffer<float> x, y, z;  // [n] eye space in bucket order, particle radii
  Buffer<float> weight;   // [n] a particle's share in the field is multiplied by this
  Buffer<cl_uint> tag;    // [n] of each particle's cell (cells.hpp)
  Buffer<cl_int> start;   // [buckets + 1]
  float inverse_cell = 1;
  cl_uint mask = 0;
};

/// Uploads cells of side kDensitySupport; every weight is 1.
DeviceCells upload_cells(Device& device, const Cells& cells);

/// The density at eye-space points (particle radii). Waits.
std::vector<float> measure_density(Device& device, const DeviceCells& cells,
                                   const std::vector<Vec3d>& points);

/// Gradient (1 / particle radii) and value of the field at the particles' own positions, [4][n] in
/// bucket order: x, y, z, density. Does not wait.
Buffer<float> measure_gradients(Device& device, const DeviceCells& cells);

/// Cells whose weights even the field's level out: params.blob_density for a lone particle, 0.45
/// inside the fluid. Does not wait.
///
///   field  of measure_gradients over these cells
DeviceCells level_cells(Device& device, const DeviceCells& cells, const Buffer<float>& field,
                        const RegionParams& params);

/// Decides what each listed sample of a layer shows (kernel settle_samples): the blend where its
/// groups are trusted and it lies on a kept triangle or in the fluid (paper 2.4.1), the levelled
/// density field where they are not and `core` is finite, nothing outside the fluid. Changes the
/// surface. Returns for each listed sample that has a reference but shows nothing that reference,
/// and kNoSurface elsewhere. Does not wait.
Buffer<float> settle_samples(Device& device, const View& view, const SampleLists& lists,
                             const DeviceCells& cells, const DeviceCells& levelled,
                             const Buffer<float>& triangle_depth, const Buffer<float>& reference,
                             const Buffer<float>& core, const SurfaceBuffers& surface,
                             const RegionParams& params, bool only_gaps);

/// The same at a list of points (pixels, [2][n] u then v) whose samples `surface` holds, on a grid
/// of n x 1: what lies near each point's reference depth, without triangles that vouch.
void settle_points(Device& device, const View& view, const DeviceCells& cells,
                   const DeviceCells& levelled, const Buffer<float>& points,
                   const Buffer<float>& reference, const SurfaceBuffers& surface,
                   const RegionParams& params);

/// Where rays may meet the levelled field around splash particles: the nearest front and the
/// farthest back of spheres that hold it.
struct SplashExtent {
  Buffer<float> from, to;  // [samples] particle radii; kNoSurface and 0 where nothing is
};

/// Does not wait.
SplashExtent splash_extent(Device& device, const SplatParticles& splash, const SampleGrid& grid);

/// Draws the first crossing of the levelled field within `extent` where it lies in front of the
/// surface, at the listed samples. Changes the surface. Does not wait.
void draw_splash(Device& device, const View& view, const SampleLists& lists,
                 const DeviceCells& levelled, const SplashExtent& extent,
                 const SurfaceBuffers& surface, const RegionParams& params);

}  // namespace meniscus
