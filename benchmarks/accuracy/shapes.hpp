// Signed distances of simple solids, s: negative inside. Unless it says otherwise a function is
// exact outside its solid and wherever the nearest surface is nearer than every edge.
#pragma once

#include <array>
#include <cmath>
#include <functional>
#include <vector>

#include "stages/vec.hpp"

namespace meniscus::accuracy {

/// Rotation by angles about x, then y, then z (radians); rows are the rotated axes.
struct Rotation {
  Vec3d x, y, z;
  Rotation(double about_x, double about_y, double about_z);
  /// World -> the rotated body's own axes.
  Vec3d local(const Vec3d& v) const { return {dot(x, v), dot(y, v), dot(z, v)}; }
};

double box_distance(const Vec3d& p, const Vec3d& half);

/// Ellipsoid of these half axes; exact everywhere.
double ellipsoid_distance(const Vec3d& p, const Vec3d& half);

/// All points within `radius` of the segment from a to b; exact everywhere.
double capsule_distance(const Vec3d& p, const Vec3d& a, const Vec3d& b, double radius);

/// Half a spherical shell, open towards +z: all points within `thickness` / 2 of the lower half of
/// a sphere, so that its rim is round; exact everywhere.
double bowl_distance(const Vec3d& p, double radius, double thickness);

/// A right prism along y whose cross-section is the convex polygon of these corners (x, z),
/// counter-clockwise seen from -y; the largest distance to a face, which is below the distance
/// outside next to edges.
double prism_distance(const Vec3d& p, const std::vector<std::array<double, 2>>& corners,
                      double half_length);

/// A function whose zero is a surface, and its gradient.
struct Level {
  double value;
  Vec3d gradient;
};

/// Distance to the zero of a smooth function, whose foot is searched for; beyond one s, where that
/// could lead astray, value over slope, where that is above one.
double distance_to_zero(const Vec3d& p, const std::function<Level(const Vec3d&)>& level);

/// A straight wave.
struct Wave {
  double length, amplitude;  // s
  double heading, phase;     // radians
};

/// z above the sum of the waves; for distance_to_zero.
Level above_waves(const Vec3d& p, const std::vector<Wave>& waves);

/// Balls (centre, radius) that melt into each other over `blend` s (the polynomial smooth minimum
/// of two, taken in order); for distance_to_zero.
Level above_balls(const Vec3d& p, const std::vector<std::pair<Vec3d, double>>& balls, double blend);

/// The union of two solids that melt into each other over `blend` s, from their distances: the
/// polynomial smooth minimum.
double melted(double a, double b, double blend);

/// A ball, of which threads are made.
struct Bead {
  Vec3d centre;
  double radius;  // s
};

/// A string of beads: the hull of each with the next; a drop where there is one. Exact everywhere
/// but inside near the joints.
double thread_distance(const Vec3d& p, const std::vector<Bead>& beads);

/// Water behind a broken dam, for distance_to_zero: towards +x its height falls from 12 s to 3 s
/// and ends in a round front that is ahead in the middle (y = 0).
Level above_dam(const Vec3d& p);

}  // namespace meniscus::accuracy
