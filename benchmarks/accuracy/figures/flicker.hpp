// How steady maps are from frame to frame.
#pragma once

#include <optional>
#include <span>

#include "accuracy/figures/statistics.hpp"
#include "accuracy/map.hpp"
#include "accuracy/motion.hpp"
#include "accuracy/scene.hpp"
#include "accuracy/truth.hpp"

namespace meniscus::accuracy {

/// RMS and 99.9th percentile of a change, s.
struct Flicker {
  double rms = kNone, p999 = kNone;
};

/// The change of the depth error from each frame to the next, over pixels that are interior in
/// both, clamped to 2 s. One truth a frame (a camera that moves), or one for all (particles that
/// move). Throws InvalidArgument when there are other numbers of truths and maps.
Flicker flicker(std::span<const Truth> truths, std::span<const Map> maps);

/// The same along points of the water: each pixel's error in one frame is compared with the error
/// where the point that the truth shows there has gone in the next, between the pixels. One truth
/// and one map a frame.
Flicker flicker(std::span<const Truth> truths, std::span<const Map> maps, const Motion& motion);

/// The second difference of three depths (s) in time; nothing unless all are there and none is more
/// than s from the next.
std::optional<double> second_difference(double first, double middle, double last);

/// |z0 - 2 z1 + z2| of the depths, over pixels that are covered in three successive frames, their
/// depths at most s apart: what is left of a real motion when its velocity is taken out. Depths in
/// s. Throws InvalidArgument when the maps' sizes differ.
Flicker second_difference(std::span<const Map> maps);

/// The same along the surface's normal in the middle frame: times the cosine between it and the ray
/// of the pixel. Where rays graze the surface, depths change much when the surface hardly moves.
/// Pixels without a normal there do not count. The cameras' lens is `lens`.
Flicker second_difference_along_normal(const Lens& lens, std::span<const Map> maps);

}  // namespace meniscus::accuracy
