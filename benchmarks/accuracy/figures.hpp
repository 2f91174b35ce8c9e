// How far an extracted map is from the truth. Lengths are in s, angles in degrees. A figure that
// has nothing to measure (no crease, no flicker run) is NaN.
#pragma once

#include <limits>
#include <span>
#include <string>
#include <vector>

#include "accuracy/truth.hpp"
#include "meniscus/types.hpp"

namespace meniscus::accuracy {

/// A map as the library returns it: depth in world units (+infinity: none), normals in world axes
/// (zero or missing: none).
struct Map {
  std::vector<float> depth;
  std::vector<Vec3> normal;
};

/// Errors are positive where the map lies behind the truth. Depth errors and errors along the
/// normal are clamped to +-2 s, so that a single wrong layer does not hide all else. Angles are
/// between the truth's normal and, for `angle`, the map's own, for `slope`, the one that the map's
/// depths have by differences.
struct Figures {
  static constexpr double kNone = std::numeric_limits<double>::quiet_NaN();
  // Interior pixels (see PixelClass)
  double normal_rms = kNone;   // error along the normal
  double normal_p95 = kNone;   // ... 95th percentile of its absolute value
  double normal_bias = kNone;  // ... mean
  double depth_rms = kNone;
  double outliers = kNone;  // percent of the pixels whose depth is wrong by more than s
  double angle_median = kNone, angle_p95 = kNone;
  double slope_median = kNone, slope_p95 = kNone;
  // Pixels near creases
  double crease_rms = kNone;                          // depth
  double crease_angle = kNone, crease_slope = kNone;  // medians
  // Pixels near outlines
  double outline_rms = kNone;   // depth
  double outline_miss = kNone;  // mean distance between the outlines, both ways
  // The whole mask
  double iou = kNone;     // intersection over union
  double holes = kNone;   // enclosed gaps that mostly lie on the truth's surface
  double specks = kNone;  // per megapixel: see count_specks
  // Moving camera
  double flicker = kNone;  // RMS change of the depth error for a step of 0.3 pixels
};

/// Throws InvalidArgument when the map has another size than the truth.
Figures compare(const Truth& truth, const Map& map);

/// Pieces of at most 8 pixels, where neighbouring pixels hang together unless their depths differ
/// by more than s or only one has surface. Pieces where the truth has such pieces too do not
/// count.
int count_specks(const Truth& truth, const Map& map);

/// RMS change of the depth error from each frame to the next, over pixels that are interior in
/// both. The frames are of one scene whose camera moves.
double flicker(std::span<const Truth> truths, std::span<const Map> maps);

/// Unit normals (world axes) of a depth map by differences across each pixel, zero where there are
/// none.
std::vector<Vec3d> normals_of_depth(const Lens& lens, const std::vector<float>& depth);

/// Name, unit and place of each figure, in the order of the tables.
struct FigureField {
  std::string name, unit;
  double Figures::*value;
  int digits;  // behind the point
};
const std::vector<FigureField>& figure_fields();

/// The mean of each figure over those that are not NaN.
Figures mean(std::span<const Figures> figures);

}  // namespace meniscus::accuracy
