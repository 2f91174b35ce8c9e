// blend: the intersections of a ray with the fits it meets, blended (paper 2.4.2, Eqs. 6 and 7). A
// fit is the group around its particle.
#pragma once

#include "device/device.hpp"
#include "meniscus/parameters.hpp"
#include "stages/fit/particle_fit.hpp"
#include "stages/sample/samples.hpp"
#include "stages/sample/surface_buffers.hpp"

namespace meniscus {

/// Floats of a fit's record.
inline constexpr std::size_t kFitRecord = records::FIT;

/// Fits as kernel blend_groups takes them, see hits.cl.
struct BlendRecords {
  std::vector<float> record;  // [fits][kFitRecord]
  std::vector<float> foot;  // [fits][4] eye space; reach of the weight, particle radii; 0: does not
                            // count
  std::size_t size() const { return foot.size() / 4; }
};

/// The same on the device.
struct DeviceRecords {
  Buffer<float> record, foot;
};

/// How intersections are blended, as kernels take it.
records::Blending blending_of(const BlendParams& params);

/// The weight (1 - D²)³ of kernel blend_groups is as wide as Wendland's function on this share of
/// its radius.
inline constexpr double kBlendReach = 0.84;

/// Fits that are seen less are not met by rays, they only end sheets.
inline constexpr double kSeen = 1e-3;

/// The records of fits. A fit's weight reaches `radius` times the share of the full support that
/// its own has, but at least 0.7, and counts e v trust; where it tells that the fluid ends, e u
/// trust (kernel blend_groups).
///
///   trust   [fits] 0 .. 1
///   radius  particle radii
BlendRecords make_records(const ParticleFits& fits, const std::vector<double>& trust,
                          const FitParams& fit, double radius);

/// Adds the records of more fits.
void append(BlendRecords& records, const BlendRecords& more);

DeviceRecords upload_records(Device& device, const BlendRecords& records);

/// The radius of a fit's weight: `radius` times its share of the full support; of a group's fit
/// the root of its square and of 1.8 times the square of the group's extent, but at most .8 of its
/// support: beyond it the quadric follows nothing.
double reach_of(const ParticleFits& fits, std::size_t k, const FitParams& fit, double radius);

/// Groups as the kernels of method paper take them.
struct GroupRecords {
  std::vector<float> values;      // [groups][n], see paper.cl
  std::vector<double> billboard;  // [groups] radius on which the group counts, particle radii;
                                  // 0: the group has no fit
  std::vector<Vec3d> centre;      // [groups] raised to the surface, eye space
};

/// Which groups' billboards meet each tile of 16 x 16 samples.
struct TileLists {
  int nx = 0, ny = 0;         // tiles
  std::vector<cl_int> start;  // [tiles + 1]
  std::vector<cl_int> group;  // ascending in each tile
};

TileLists list_tiles(const View& view, const GroupRecords& records, const SampleGrid& grid);

/// The fits of each tile on the device.
struct FitList {
  Buffer<cl_int> start, fit;  // [tiles + 1]; ascending in each tile
  Buffer<float> place;        // [rows][fit.size] where the listed fits lie, see tile_lists.cl
};

/// Those that rays may meet (kernel blend_groups, record 11), and those that may be steep to
/// rays, or turn away from the eye, within their reach (record 13).
struct FitTiles {
  int nx = 0, ny = 0;  // tiles
  FitList met, rim;
};

FitTiles list_fits(Device& device, const View& view, const BlendRecords& records,
                   const SampleGrid& grid);

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
