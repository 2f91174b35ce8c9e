#include "accuracy/scene.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "accuracy/random.hpp"
#include "meniscus/error.hpp"

namespace meniscus::accuracy {
namespace {

/// Volume inside a cube: cubes that the surface cannot reach count whole or not at all, the others
/// are split; the smallest count by the share that lies behind the tangent plane.
double volume_in(const Scene& scene, const Vec3d& low, double side) {
  constexpr double kSmallest = 0.125;  // s
  const double half = side / 2;
  const double distance = scene.distance(low + Vec3d{half, half, half});
  if (std::abs(distance) * scene.safe_step > half * std::numbers::sqrt3)
    return distance < 0 ? side * side * side : 0;
  if (side <= kSmallest) return side * side * side * std::clamp(0.5 - distance / side, 0.0, 1.0);
  double sum = 0;
  for (int k = 0; k < 8; ++k)
    sum += volume_in(scene, low + half * Vec3d(k & 1, (k >> 1) & 1, k >> 2), half);
  return sum;
}

}  // namespace

Scene posed(Scene scene, std::uint64_t seed) {
  if (seed == 1) return scene;
  constexpr double kTurn = std::numbers::pi / 6, kRise = std::numbers::pi / 36;
  Random random(~seed * 3);  // another stream than the filling's and the noise's
  const double turn = random.uniform(-kTurn, kTurn), rise = random.uniform(-kRise, kRise);
  const Vec3d arm = scene.eye - scene.target;
  const double flat = std::hypot(arm.x, arm.y), distance = length(arm);
  const double heading = std::atan2(arm.y, arm.x) + turn, height = std::atan2(arm.z, flat) + rise;
  scene.eye =
      scene.target + distance * Vec3d{std::cos(height) * std::cos(heading),
                                      std::cos(height) * std::sin(heading), std::sin(height)};
  return scene;
}

Scene scaled(Scene scene, double scale) {
  constexpr int kWidest = 960;  // pixels
  const double factor = scale * length(scene.eye - scene.target) / scene.focal;
  scene.focal *= factor;
  // Multiples of four keep the shape of 4 : 3 exactly.
  scene.width = 4 * static_cast<int>(std::lround(std::min(factor * scene.width, 1. * kWidest) / 4));
  scene.height = scene.width * 3 / 4;
  return scene;
}

Scene moved_back(Scene scene, double factor) {
  scene.eye = scene.target + factor * (scene.eye - scene.target);
  scene.focal *= factor;
  return scene;
}

Vec3d outward(const std::function<double(const Vec3d&)>& f, const Vec3d& p) {
  constexpr double h = 1e-4;  // s; differences are then good to about 1e-8
  return normalized({f(p + Vec3d{h, 0, 0}) - f(p - Vec3d{h, 0, 0}),
                     f(p + Vec3d{0, h, 0}) - f(p - Vec3d{0, h, 0}),
                     f(p + Vec3d{0, 0, h}) - f(p - Vec3d{0, 0, h})});
}

double volume(const Scene& scene) {
  const Vec3d extent = scene.high - scene.low;
  double side = 1;
  while (side < std::max({extent.x, extent.y, extent.z})) side *= 2;
  return volume_in(scene, scene.low, side);
}

Vec3d Lens::origin(int i, int j) const {
  if (!orthographic) return eye;
  return eye + right * ((i + 0.5 - 0.5 * width) / focal) +
         down * ((j + 0.5 - 0.5 * height) / focal);
}

Vec3d Lens::direction(int i, int j) const {
  if (orthographic) return forward;
  return forward + right * ((i + 0.5 - 0.5 * width) / focal) +
         down * ((j + 0.5 - 0.5 * height) / focal);
}

Vec3d Lens::project(const Vec3d& point) const {
  const Vec3d from_eye = point - eye;
  const double depth = dot(from_eye, forward);
  return {0.5 * width - 0.5 + dot(from_eye, right) * scale(depth),
          0.5 * height - 0.5 + dot(from_eye, down) * scale(depth), depth};
}

std::optional<std::size_t> Lens::pixel(const Vec3d& point) const {
  const Vec3d place = project(point);
  if (!(place.z > 0)) return std::nullopt;
  const double x = std::floor(place.x + 0.5), y = std::floor(place.y + 0.5);
  if (!(x >= 0 && y >= 0 && x < width && y < height)) return std::nullopt;
  return static_cast<std::size_t>(y) * width + static_cast<std::size_t>(x);
}

Lens lens_of(const Scene& scene, bool orthographic, double shift) {
  Lens lens;
  lens.width = scene.width;
  lens.height = scene.height;
  const double distance = length(scene.target - scene.eye);
  lens.forward = (scene.target - scene.eye) / distance;
  lens.right = normalized(cross(lens.forward, {0, 0, 1}));
  lens.down = cross(lens.forward, lens.right);
  lens.eye = scene.eye + shift * lens.right;
  lens.orthographic = orthographic;
  lens.focal = orthographic ? scene.focal / distance : scene.focal;
  return lens;
}

Camera camera_of(const Lens& lens) {
  constexpr double kNear = 1, kFar = 1000;  // s
  const Vec3d &r = lens.right, &d = lens.down, &f = lens.forward, &e = lens.eye;
  Camera camera;
  camera.width = lens.width;
  camera.height = lens.height;
  camera.view = {r.x,  r.y,  r.z,  -dot(r, e),  //
                 -d.x, -d.y, -d.z, dot(d, e),   //
                 -f.x, -f.y, -f.z, dot(f, e),   //
                 0,    0,    0,    1};
  const double x = 2 * lens.focal / lens.width, y = 2 * lens.focal / lens.height;
  const double span = kFar - kNear;
  if (lens.orthographic)
    camera.projection = {x, 0, 0,         0,  //
                         0, y, 0,         0,  //
                         0, 0, -2 / span, -(kFar + kNear) / span,
                         0, 0, 0,         1};
  else
    camera.projection = {x,
                         0,
                         0,
                         0,  //
                         0,
                         y,
                         0,
                         0,  //
                         0,
                         0,
                         -(kFar + kNear) / span,
                         -2 * kFar * kNear / span,
                         0,
                         0,
                         -1,
                         0};
  return camera;
}

}  // namespace meniscus::accuracy
