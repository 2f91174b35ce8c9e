// settle: what each sample shows, the blend or the density field (paper 2.4.1 and, for the splash,
// the end of 3).
#pragma once

#include "stages/frame/density.hpp"
#include "stages/frame/visible.hpp"
#include "stages/sample/samples.hpp"
#include "stages/sample/surface_buffers.hpp"

namespace meniscus {

/// The density field by which samples are settled: the particles with equal weights, and with those
/// that level it (level_cells()); its levels; the particles' disorder (relax.hpp).
struct SettlingField {
  const DeviceCells &cells, &levelled;
  const RegionParams& params;
  double disorder;
};

/// Decides what each listed sample of a layer shows (kernel settle_samples): the blend where its
/// groups are trusted and it lies on a kept triangle or in the fluid (paper 2.4.1), the levelled
/// density field where they are not, nothing outside the fluid. Changes the surface. `behind`
/// holds, for samples that look again, the reference at which they showed nothing, else kNoSurface;
/// it receives for each listed sample that has a reference but shows nothing that reference,
/// kNoSurface for all other listed ones. The more disorder particles have, the more
/// blend and field may differ before the field is believed. Does not wait.
void settle_samples(Device& device, const View& view, const SampleLists& lists,
                    const SettlingField& field, const Buffer<float>& triangle_depth,
                    const Buffer<float>& reference, const SurfaceBuffers& surface,
                    const Buffer<float>& behind, bool only_gaps);

/// The same at a list of points (pixels, [2][n] u then v) whose samples `surface` holds, on a grid
/// of n x 1: what lies near each point's reference depth, without triangles that vouch.
void settle_points(Device& device, const View& view, const SettlingField& field,
                   const Buffer<float>& points, const Buffer<float>& reference,
                   const SurfaceBuffers& surface);

/// What listed samples show at last: those that show nothing, as settle_samples() decides with
/// `only_gaps`; then the splash in front of that, as draw_splash() draws it. Does not wait.
void settle_gaps(Device& device, const View& view, const SampleLists& lists,
                 const SettlingField& field, const Buffer<float>& triangle_depth,
                 const Buffer<float>& reference, const Extent& splash,
                 const SurfaceBuffers& surface, const Buffer<float>& behind);

/// The fronts of the seen particles, and where rays may meet the levelled field around splash
/// particles: within spheres that hold it (splat_fronts_and_extent()).
void draw_fronts(Device& device, const SampleGrid& grid, const SplatParticles& seen,
                 double footprint, double bulge, const Fronts& fronts, const SplatParticles& splash,
                 const Extent& extent);

/// Draws the first crossing of the levelled field within `extent` where it lies in front of the
/// surface, at those of the listed samples whose extent begins before it, and where `open`, if
/// given, is not finite. Changes the surface. Does not wait.
void draw_splash(Device& device, const View& view, const SampleLists& lists,
                 const DeviceCells& levelled, const Extent& extent, const SurfaceBuffers& surface,
                 const RegionParams& params, const Buffer<float>* open = nullptr);

}  // namespace meniscus
