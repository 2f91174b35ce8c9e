#include "accuracy/real.hpp"

#include <array>
#include <string>

#include "meniscus/error.hpp"

namespace meniscus::accuracy {
namespace {

constexpr double kNear = 1.5;        // s; depths farther apart are of other layers
constexpr double kSameSide = 3;      // s; depth difference within a smooth part
constexpr double kSmoothAngle = 15;  // degrees

bool is_smooth(const Lens& lens, const Map& map, int x, int y) {
  constexpr std::array<std::array<int, 2>, 8> kAround{
      {{1, 0}, {1, 1}, {0, 1}, {-1, 1}, {-1, 0}, {-1, -1}, {0, -1}, {1, -1}}};
  const std::size_t p = static_cast<std::size_t>(y) * lens.width + x;
  for (const double away : {0.5, 1.}) {
    const double pixels = away * lens.scale(map.depth[p]);
    for (const auto& [dx, dy] : kAround) {
      const double shrink = dx != 0 && dy != 0 ? std::sqrt(0.5) : 1;
      const int i = x + static_cast<int>(std::lround(dx * shrink * pixels));
      const int j = y + static_cast<int>(std::lround(dy * shrink * pixels));
      if (i < 0 || j < 0 || i >= lens.width || j >= lens.height) return false;
      const std::size_t q = static_cast<std::size_t>(j) * lens.width + i;
      if (!(std::abs(map.depth[p] - map.depth[q]) < kSameSide) ||
          angle_between(Vec3d(map.normal[p]), Vec3d(map.normal[q])) > kSmoothAngle)
        return false;
    }
  }
  return true;
}

}  // namespace

Agreement agreement(const Lens& lens, const Map& reference, const Map& map) {
  const std::size_t pixels = static_cast<std::size_t>(lens.width) * lens.height;
  require(reference.depth.size() == pixels && reference.normal.size() == pixels &&
              map.depth.size() == pixels && map.normal.size() == pixels,
          "agreement: maps of " + std::to_string(reference.depth.size()) + " and " +
              std::to_string(map.depth.size()) + " pixels with normals, wanted " +
              std::to_string(pixels));
  std::vector<double> all, smooth, jumps;
  std::vector<bool> on_smooth(pixels);
  double both = 0, either = 0;
  for (std::size_t p = 0; p < pixels; ++p) {
    const bool ours = finite(map.depth[p]), theirs = finite(reference.depth[p]);
    both += ours && theirs;
    either += ours || theirs;
    if (!ours || !theirs || !(std::abs(map.depth[p] - reference.depth[p]) <= kNear) ||
        map.normal[p] == Vec3{})
      continue;
    all.push_back(angle_between(Vec3d(map.normal[p]), Vec3d(reference.normal[p])));
    on_smooth[p] = is_smooth(lens, reference, static_cast<int>(p % lens.width),
                             static_cast<int>(p / lens.width));
    if (on_smooth[p]) smooth.push_back(all.back());
  }
  for (std::size_t p = 0; p < pixels; ++p)
    for (const std::size_t q : {p + 1, p + lens.width}) {
      if (q >= pixels || (q == p + 1 && q % lens.width == 0) || !on_smooth[p] || !on_smooth[q])
        continue;
      const double own = angle_between(Vec3d(map.normal[p]), Vec3d(map.normal[q]));
      const double wanted = angle_between(Vec3d(reference.normal[p]), Vec3d(reference.normal[q]));
      jumps.push_back(std::max(0., own - wanted));
    }
  Agreement result;
  if (!all.empty())
    result.smooth_share =
        100. * static_cast<double>(smooth.size()) / static_cast<double>(all.size());
  result.angle_median = percentile(smooth, 0.5);
  result.angle_p95 = percentile(smooth, 0.95);
  result.all_median = percentile(all, 0.5);
  result.all_p95 = percentile(all, 0.95);
  result.jump_p999 = percentile(jumps, 0.999);
  if (either > 0) result.iou = both / either;
  return result;
}

Lens lens_of(const Camera& camera, double unit) {
  const auto& v = camera.view;
  const auto& p = camera.projection;
  Lens lens;
  lens.width = camera.width;
  lens.height = camera.height;
  lens.orthographic = p[15] != 0;
  lens.focal = p[0] * camera.width / 2 * (lens.orthographic ? unit : 1);
  const double other = p[5] * camera.height / 2 * (lens.orthographic ? unit : 1);
  const bool middle = lens.orthographic ? p[3] == 0 && p[7] == 0 : p[2] == 0 && p[6] == 0;
  require(middle && std::abs(lens.focal - other) <= 1e-6 * std::abs(lens.focal),
          "lens_of: the camera's focal lengths are " + std::to_string(lens.focal) + " and " +
              std::to_string(other) +
              " pixels, must be equal, and its axis must go through the middle of the image");
  lens.right = {v[0], v[1], v[2]};
  lens.down = -Vec3d{v[4], v[5], v[6]};
  lens.forward = -Vec3d{v[8], v[9], v[10]};
  lens.eye = -(v[3] * lens.right - v[7] * lens.down - v[11] * lens.forward) / unit;
  return lens;
}

Particles in_units(Particles particles, double unit) {
  for (auto* values : {&particles.x, &particles.y, &particles.z, &particles.vx, &particles.vy,
                       &particles.vz, &particles.radius})
    for (float& value : *values) value = static_cast<float>(value / unit);
  particles.particle_radius /= unit;
  return particles;
}

Particles drifted(Particles particles, double time) {
  require(particles.vx.size() == particles.size() && particles.vy.size() == particles.size() &&
              particles.vz.size() == particles.size(),
          "drifted: the particles have no velocities");
  for (std::size_t k = 0; k < particles.size(); ++k) {
    particles.x[k] += static_cast<float>(time * particles.vx[k]);
    particles.y[k] += static_cast<float>(time * particles.vy[k]);
    particles.z[k] += static_cast<float>(time * particles.vz[k]);
  }
  return particles;
}

double rms_speed(const Particles& particles) {
  Moments speed;
  for (std::size_t k = 0; k < particles.vx.size(); ++k)
    speed.add(length(Vec3d(particles.vx[k], particles.vy[k], particles.vz[k])));
  return speed.count > 0 ? speed.rms() : 0;
}

}  // namespace meniscus::accuracy
