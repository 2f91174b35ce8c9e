// How far an extracted map is from the truth. Lengths are in s, angles in degrees. A figure that
// has nothing to measure (no crease, no flicker run) is NaN.
#pragma once

#include <span>
#include <string>
#include <vector>

#include "accuracy/figures/statistics.hpp"
#include "accuracy/map.hpp"
#include "accuracy/truth.hpp"
#include "meniscus/types.hpp"

namespace meniscus::accuracy {

/// Errors are positive where the map lies behind the truth. Depth errors and errors along the
/// normal are clamped to +-2 s, so that a single wrong layer does not hide all else. Angles are
/// between the truth's normal and, for `angle`, the map's own, for `slope`, the one that the map's
/// depths have by differences.
struct Figures {
  // Interior pixels (see PixelClass)
  double normal_rms = kNone;   // error along the normal
  double normal_p95 = kNone;   // ... 95th percentile of its absolute value
  double normal_bias = kNone;  // ... mean
  double depth_rms = kNone;
  double outliers = kNone;  // percent of the pixels whose depth is wrong by more than s
  double angle_median = kNone, angle_p95 = kNone;
  double slope_median = kNone, slope_p95 = kNone;
  double jump_p999 = kNone;  // angle between neighbouring pixels' normals, less the truth's own
  double rough = kNone;      // ... mean
  double torn = kNone;       // percent of the pixels, those near creases too: see torn_share
  // Pixels near creases
  double crease_rms = kNone;                          // depth
  double crease_angle = kNone, crease_slope = kNone;  // medians
  double crease_jag = kNone, crease_lost = kNone;     // see figures/lines.hpp
  // Pixels near outlines
  double outline_rms = kNone;   // depth
  double rim_angle = kNone;     // median
  double outline_miss = kNone;  // mean distance between the outlines, both ways
  double outline_jag = kNone, outline_lost = kNone;
  // The whole mask
  double iou = kNone;      // intersection over union
  double holes = kNone;    // enclosed gaps that mostly lie on the truth's surface
  double specks = kNone;   // per megapixel: see count_specks
  double averted = kNone;  // covered pixels whose normal does not face the eye
  // Pieces of splash: see figures/splash.hpp
  double splash_covered = kNone, splash_missing = kNone;
  double splash_doubled = kNone, splash_closed = kNone;
  // Change of the depth error from frame to frame: see figures/flicker.hpp
  double flicker = kNone, flicker_p999 = kNone;  // the camera moves 0.3 pixels
  double jitter = kNone, jitter_p999 = kNone;    // the particles move 0.01 s
  double moved = kNone, moved_p999 = kNone;      // the water moves as a whole: see motion.hpp
  double bent = kNone, bent_p999 = kNone;        // ... and bends
  // The mesh: see figures/mesh_distance.hpp
  double mesh_rms = kNone, mesh_p95 = kNone, mesh_p999 = kNone, mesh_outline = kNone;
};

/// All but flicker and mesh, which need more than one map. Throws InvalidArgument when the
/// map has another size than the truth.
Figures compare(const Truth& truth, const Map& map);

/// Pieces of at most 8 pixels, where neighbouring pixels hang together unless their depths differ
/// by more than s or only one has surface. Pieces where the truth has such pieces too do not
/// count.
int count_specks(const Truth& truth, const Map& map);

/// Share of the pixels away from outlines, percent, that show nothing or something that is over s
/// away, or have a neighbour that shows nothing or is over s away in depth: away from outlines the
/// truth has no such neighbours.
double torn_share(const Truth& truth, const Map& map);

/// Throws InvalidArgument when the map has another size than the truth.
void require_same_size(const Truth& truth, const Map& map);

/// Unit normals (world axes) of a depth map by differences across each pixel, zero where there are
/// none.
std::vector<Vec3d> normals_of_depth(const Lens& lens, const std::vector<float>& depth);

/// Which values of a figure are good.
enum class Better { low, high, near_zero, neither };

/// Name, unit and place of each figure, in the order of the tables.
struct FigureField {
  std::string name, unit;
  double Figures::*value;
  int digits;  // behind the point
  Better better;
  std::string meaning;  // a plain sentence
};
const std::vector<FigureField>& figure_fields();

/// The mean of each figure over those that are not NaN.
Figures mean(std::span<const Figures> figures);

}  // namespace meniscus::accuracy
