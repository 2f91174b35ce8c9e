// blend: the intersections of a ray with the fits it meets, blended (paper 2.4.2, Eqs. 6 and 7). A
// fit is the group around its particle.
#pragma once

#include "device/device.hpp"
#include "meniscus/parameters.hpp"
#include "stages/particle_fit.hpp"
#include "stages/samples.hpp"
#include "stages/surface_buffers.hpp"

namespace meniscus {

/// Groups as kernel blend_groups takes them: 24 floats each, see blend.cl.
struct GroupRecords {
  std::vector<float> values;      // [groups][24]
  std::vector<double> billboard;  // [groups] radius on which the group counts, particle radii;
                                  // 0: the group has no fit
  std::vector<Vec3d> centre;      // [groups] raised to the surface, eye space
};

/// The weight (1 - D²)³ of kernel blend_groups is as wide as Wendland's function, which method
/// stable has, on this share of its radius.
inline constexpr double kBlendReach = 0.84;

/// The records of fits. A fit's weight reaches `radius` times the share of the full support that
/// its own has, but at least 0.7, and counts e v trust; where it tells that the fluid ends, e u
/// trust (kernel blend_groups).
///
///   trust   [fits] 0 .. 1
///   radius  particle radii
GroupRecords make_records(const ParticleFits& fits, const std::vector<double>& trust,
                          const FitParams& fit, double radius);

/// Which groups' billboards meet each tile of 16 x 16 samples.
struct TileLists {
  int nx = 0, ny = 0;         // tiles
  std::vector<cl_int> start;  // [tiles + 1]
  std::vector<cl_int> group;  // ascending in each tile
};

TileLists list_tiles(const View& view, const GroupRecords& records, const SampleGrid& grid);

/// The fits of each tile on the device, in two lists: those that rays may meet (kernel
/// blend_groups, record 18) and those that may turn away from the eye within their reach (record
/// 17).
struct FitTiles {
  int nx = 0, ny = 0;  // tiles
  Buffer<cl_int> met_start, met, rim_start, rim;
};

FitTiles list_fits(Device& device, const View& view, const GroupRecords& records,
                   const SampleGrid& grid);

/// Blends the groups at the listed samples, whose reference depths are finite (kernel
/// blend_groups), and writes depth, normal and group there. Does not wait.
void blend_groups(Device& device, const View& view, const SampleLists& lists,
                  const Buffer<float>& records, const FitTiles& tiles,
                  const Buffer<float>& reference, const SurfaceBuffers& surface,
                  const BlendParams& params);

/// The same at a list of points (kernel blend_points), with the lists of `tiles` on `grid`.
///
///   points  [2][n] u then v, pixels
///   surface  receives the n samples; its grid is n x 1
void blend_points(Device& device, const View& view, const Buffer<float>& records,
                  const FitTiles& tiles, const SampleGrid& grid, const Buffer<float>& points,
                  const Buffer<float>& reference, const SurfaceBuffers& surface,
                  const BlendParams& params);

}  // namespace meniscus
