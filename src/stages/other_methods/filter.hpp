// filter: the screen-space filters that smooth the depth map of the particles' spheres, each with
// the window or the flow as its authors give it (docs/rivals.md).
#pragma once

#include "device/device.hpp"
#include "meniscus/parameters.hpp"
#include "stages/stage_data.hpp"

namespace meniscus {

/// Each filter takes and returns
///
///   depth  [ny*nx] particle radii; kNoSurface where there is none, and there it stays
///
/// sampled on `grid`, and waits. Sigmas are in particle radii, so that windows shrink with the
/// distance; a two-dimensional window never reaches beyond kWidestWindow samples.
/// Throws InvalidArgument when the map's size is not its grid's, DeviceError.
inline constexpr int kWidestWindow = 64;

/// Bilateral filter: sum of w_j t_j over sum of w_j, w_j a Gaussian of the distance on the screen
/// (sigma) times one of the difference in depth (range), over a disc of 2.5 sigma. `iterations`
/// times; separable: rows, then columns, each time.
Buffer<float> filter_bilateral(Device& device, const View& view, const Buffer<float>& depth,
                               const SampleGrid& grid, const BilateralParams& params);

/// Narrow-range filter (Truong and Yuksel 2018): a Gaussian over the samples within delta of the
/// centre's depth, a range that widens along the way outwards; nearer samples count neither
/// themselves nor with the sample opposite; farther ones count as mu behind the centre.
/// `iterations` times, in two dimensions or along the rows and then the columns, and then the
/// clean-up: two-dimensional, of `cleanup` samples on each side.
Buffer<float> filter_narrow_range(Device& device, const View& view, const Buffer<float>& depth,
                                  const SampleGrid& grid, const NarrowRangeParams& params);

/// Mean curvature flow (van der Laan et al. 2009) for a time of params.time radii^2, in as many
/// explicit steps as params.step of the largest stable one takes. A small bump is smoothed like
/// by a Gaussian with sigma^2 = time.
Buffer<float> flow_curvature(Device& device, const View& view, const Buffer<float>& depth,
                             const SampleGrid& grid, const CurvatureFlowParams& params);

}  // namespace meniscus
