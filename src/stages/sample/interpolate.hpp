// interpolate: samples between those of a coarser lattice (kernels compare_corners and
// interpolate_samples).
#pragma once

#include "stages/sample/samples.hpp"
#include "stages/sample/surface_buffers.hpp"

namespace meniscus {

/// Among samples up to this far apart, in radii of the smallest particle, its sphere covers one at
/// least: they are at most sqrt(2) apart.
inline constexpr double kWidestCell = 4.0 / 3;

/// From the surface at every second of the samples that are asked for, the `every`th ones of each
/// row and column, the others: written where the corners of the lattice's cell, or of a cell beside
/// it, show one smooth surface: each within `tolerance` (particle radii) of the planes that touch
/// it at the others, with normals less than 26 degrees apart, in the smallest cells 32; and all
/// planes within half the tolerance, over the cell's side in particle radii, of the same depth.
///
///   open          [samples] in and out: finite, the reference, where the front layer shows nothing
///                 and it is not known yet what does
///   surface       in and out; which groups are interpolated samples' is up to choose_groups
///                 (blend.hpp)
///   least_radius  the smallest particle's on the screen, pixels: where the lattice's samples are
///                 at most kWidestCell of it apart, nothing hides between four that show nothing
///
/// Returns the samples that must be evaluated, the others that may show something, and notes their
/// blocks. Does not wait.
LayerSamples interpolate_samples(Device& device, const View& view, const FrontMaps& fronts,
                                 const Buffer<float>& open, const SurfaceBuffers& surface,
                                 double tolerance, double least_radius, const ListedBlocks& blocks,
                                 int every = 1);

}  // namespace meniscus
