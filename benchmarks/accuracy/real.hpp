// Real frames, which have no truth: agreement with a reference mesh, and steadiness.
#pragma once

#include "accuracy/figures/statistics.hpp"
#include "accuracy/map.hpp"
#include "accuracy/scene.hpp"
#include "meniscus/types.hpp"

namespace meniscus::accuracy {

/// How near a map is to the one of a reference. Angles between normals in degrees.
struct Agreement {
  double angle_median = kNone, angle_p95 = kNone;  // on smooth parts
  double all_median = kNone, all_p95 = kNone;      // everywhere
  double jump_p999 = kNone;     // on smooth parts: angle between neighbours beyond the reference's
  double smooth_share = kNone;  // percent of the pixels that are compared
  double iou = kNone;
};

/// Compared are pixels where both depths lie within 1.5 s (3 r) of each other. A pixel is on a
/// smooth part when the reference's normals at the 16 points s/2 and s away from it on the screen,
/// in eight directions, are there and turn by less than 15 degrees from its own, their depths
/// within 3 s of its own. Throws InvalidArgument when the maps' sizes differ from the lens's.
Agreement agreement(const Lens& lens, const Map& reference, const Map& map);

/// A camera of the library, its lengths divided by `unit` (world units). Throws InvalidArgument
/// unless its pixels are square and its axis goes through the middle of the image.
Lens lens_of(const Camera& camera, double unit);

/// The particles with lengths divided by `unit` (world units); velocities, too.
Particles in_units(Particles particles, double unit);

/// The particles after they have moved on along their velocities for `time`.
Particles drifted(Particles particles, double time);

/// RMS speed; 0: the particles have no velocities.
double rms_speed(const Particles& particles);

}  // namespace meniscus::accuracy
