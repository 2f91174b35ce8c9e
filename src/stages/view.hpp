// The camera as the stages use it. Inside the pipeline the unit of length is the particle radius:
// eye space is the OpenGL eye space (x right, y up, the camera looks down -z) divided by the
// particle radius, and depth is t = -z > 0. Pixel coordinates (u, v) run from (0, 0) at the upper
// left corner of the image to (width, height); the centre of pixel (i, j) is (i + 0.5, j + 0.5).
#pragma once

#include <array>

#include "meniscus/types.hpp"
#include "stages/vec.hpp"

namespace meniscus {

struct View {
  double radius = 1;          // particle radius, world units
  int width = 0, height = 0;  // pixels
  Vec3d origin;               // world units; subtracted first, so that far scenes keep digits
  std::array<double, 9> rotation{};                 // row-major, world -> eye, rigid
  Vec3d shift;                                      // eye position of `origin`, particle radii
  std::array<double, 4> u_row{}, v_row{}, w_row{};  // u = u_row.(e, 1) / w_row.(e, 1), v alike
  double u_scale = 0, v_scale = 0;                  // a length l at w spans l * u_scale / w pixels
  bool orthographic = false;
  double near_depth = 0;  // particles nearer than this are behind the near plane
  // The ray of pixel (u, v): eye point at depth t is (o.x + t d.x, o.y + t d.y, -t) with
  // o.x = ray[0] + ray[1] u + ray[2] v, o.y = ray[3..5], d.x = ray[6..8], d.y = ray[9..11].
  std::array<double, 12> ray{};
};

/// Prepares a checked camera for particles around `origin` (world units) of `radius` world units.
View make_view(const Camera& camera, double radius, const std::array<double, 3>& origin);

/// Without a camera: eye space is the world's axes around `origin`. Nothing is projected.
View make_world_view(double radius, const std::array<double, 3>& origin);

/// The same in a unit of length that is `factor` times as long.
View coarser(View view, double factor);

struct PixelPosition {
  double u, v;  // pixels
  double w;     // clip w; > 0 in front of a perspective camera, constant for an orthographic one
};

/// Eye space (particle radii) -> pixel coordinates.
inline PixelPosition project(const View& view, const Vec3d& e) {
  const auto dot4 = [&](const std::array<double, 4>& r) {
    return r[0] * e.x + r[1] * e.y + r[2] * e.z + r[3];
  };
  const double w = dot4(view.w_row);
  return {dot4(view.u_row) / w, dot4(view.v_row) / w, w};
}

/// The eye point (particle radii) at depth t > 0 (particle radii) on the ray of pixel (u, v).
inline Vec3d point_at(const View& view, double u, double v, double t) {
  const auto& r = view.ray;
  const double ox = r[0] + r[1] * u + r[2] * v, oy = r[3] + r[4] * u + r[5] * v;
  const double dx = r[6] + r[7] * u + r[8] * v, dy = r[9] + r[10] * u + r[11] * v;
  return {ox + t * dx, oy + t * dy, -t};
}

/// Direction of the ray of pixel (u, v): d(eye point) / d(depth); not of unit length.
inline Vec3d ray_direction(const View& view, double u, double v) {
  const auto& r = view.ray;
  return {r[6] + r[7] * u + r[8] * v, r[9] + r[10] * u + r[11] * v, -1};
}

/// A depth (particle radii) in world units, as maps have it; infinity stays.
inline float world_depth(const View& view, double depth) {
  return static_cast<float>(depth * view.radius);
}

/// An eye-space direction -> world axes.
inline Vec3d world_direction(const View& view, const Vec3d& e) {
  const auto& m = view.rotation;
  return {m[0] * e.x + m[3] * e.y + m[6] * e.z, m[1] * e.x + m[4] * e.y + m[7] * e.z,
          m[2] * e.x + m[5] * e.y + m[8] * e.z};
}

/// Eye space (particle radii) -> world units, and back.
inline Vec3d world_from_eye(const View& view, const Vec3d& eye) {
  return world_direction(view, (eye - view.shift) * view.radius) + view.origin;
}
Vec3d eye_from_world(const View& view, const Vec3d& world);

/// The depth (particle radii) up to which a particle's radius spans `pixels`; infinity or 0 where
/// it spans as many at every depth.
double depth_of_radius(const View& view, double pixels);

}  // namespace meniscus
