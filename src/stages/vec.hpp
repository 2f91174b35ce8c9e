// The little vector arithmetic that host stages need. Plain code in one fixed order, so that the
// bits do not depend on how a library was vectorised.
#pragma once

#include <algorithm>
#include <cmath>

#include "meniscus/types.hpp"

namespace meniscus {

/// A vector of three doubles, eye space unless its name says otherwise.
struct Vec3d {
  double x = 0, y = 0, z = 0;
  Vec3d() = default;
  Vec3d(double x_, double y_, double z_) : x(x_), y(y_), z(z_) {}
  explicit Vec3d(const Vec3& v) : x(v.x), y(v.y), z(v.z) {}
  explicit operator Vec3() const {
    return {static_cast<float>(x), static_cast<float>(y), static_cast<float>(z)};
  }
  bool operator==(const Vec3d&) const = default;
};

inline Vec3d operator+(const Vec3d& a, const Vec3d& b) { return {a.x + b.x, a.y + b.y, a.z + b.z}; }
inline Vec3d operator-(const Vec3d& a, const Vec3d& b) { return {a.x - b.x, a.y - b.y, a.z - b.z}; }
inline Vec3d operator-(const Vec3d& a) { return {-a.x, -a.y, -a.z}; }
inline Vec3d operator*(const Vec3d& a, double s) { return {a.x * s, a.y * s, a.z * s}; }
inline Vec3d operator*(double s, const Vec3d& a) { return a * s; }
inline Vec3d operator/(const Vec3d& a, double s) { return {a.x / s, a.y / s, a.z / s}; }
inline Vec3d& operator+=(Vec3d& a, const Vec3d& b) { return a = a + b; }
inline double dot(const Vec3d& a, const Vec3d& b) { return a.x * b.x + a.y * b.y + a.z * b.z; }
inline Vec3d cross(const Vec3d& a, const Vec3d& b) {
  return {a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x};
}
inline double length(const Vec3d& a) { return std::sqrt(dot(a, a)); }

/// a / |a|, or `otherwise` where |a| is too small to have a direction.
inline Vec3d normalized(const Vec3d& a, const Vec3d& otherwise = {0, 0, 1}) {
  const double l = length(a);
  return l > 1e-12 ? a / l : otherwise;
}

/// Appends a position to the arrays x, y and z that particles are in.
template <class P>
void add_position(P& particles, const Vec3d& at) {
  particles.x.push_back(static_cast<float>(at.x));
  particles.y.push_back(static_cast<float>(at.y));
  particles.z.push_back(static_cast<float>(at.z));
}

/// From `regular` at a disorder of 0 to `irregular` at 1 (relax.hpp).
inline double between(double regular, double irregular, double disorder) {
  return regular + disorder * (irregular - regular);
}

/// 0 below `low`, 1 above `high`, a straight line between.
inline double ramp(double low, double high, double x) {
  return std::clamp((x - low) / (high - low), 0.0, 1.0);
}

/// The same with a cubic with level ends between.
inline double smooth_step(double low, double high, double x) {
  const double t = ramp(low, high, x);
  return t * t * (3 - 2 * t);
}

}  // namespace meniscus
