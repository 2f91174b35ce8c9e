#include <algorithm>
#include <cmath>

#include "base/parallel.hpp"
#include "meniscus/camera.hpp"
#include "meniscus/error.hpp"
#include "meniscus/motion.hpp"
#include "stages/view.hpp"

namespace meniscus {

ScreenMotion screen_motion(const Surface& surface, const Camera& next, double frames_per_second) {
  const std::size_t pixels = surface.depth.size();
  const std::size_t nx = static_cast<std::size_t>(surface.camera.width);
  require(surface.velocity.size() == pixels,
          "screen_motion: the surface has " + std::to_string(surface.velocity.size()) +
              " velocities for " + std::to_string(pixels) +
              " pixels, wanted one each (extract particles that carry velocities)");
  require(frames_per_second > 0 && std::isfinite(frames_per_second),
          "screen_motion: " + std::to_string(frames_per_second) +
              " frames per second, must be > 0 and finite");
  check(surface.camera);
  check(next);
  const double radius = surface.particle_radius > 0 ? surface.particle_radius : 1;
  const View here = make_view(surface.camera, radius, {}), there = make_view(next, radius, {});
  const double u_scale = double(here.width) / there.width,
               v_scale = double(here.height) / there.height;
  ScreenMotion motion{std::vector<std::array<float, 2>>(pixels), frames_per_second};
  constexpr double kMost = 1e6;
  constexpr std::size_t kRows = 16;  // that are worth a thread
  parallel_for(pixels > 0 ? pixels / nx : 0, kRows, [&](std::size_t begin, std::size_t end) {
    for (std::size_t s = begin * nx; s < end * nx; ++s) {
      if (!std::isfinite(surface.depth[s])) continue;
      const double u = static_cast<double>(s % nx) + 0.5, v = static_cast<double>(s / nx) + 0.5;
      const Vec3d now = world_from_eye(here, point_at(here, u, v, surface.depth[s] / radius));
      const Vec3 velocity = surface.velocity[s];
      const auto step = [&](double speed) {  // what is larger might not stay finite
        return std::clamp(speed / frames_per_second, -1e100, 1e100);
      };
      Vec3d then =
          eye_from_world(there, now + Vec3d{step(velocity.x), step(velocity.y), step(velocity.z)});
      then.z = std::min(then.z, -there.near_depth);
      const PixelPosition at = project(there, then);
      motion.pixels[s] = {static_cast<float>(std::clamp(at.u * u_scale - u, -kMost, kMost)),
                          static_cast<float>(std::clamp(at.v * v_scale - v, -kMost, kMost))};
    }
  });
  return motion;
}

}  // namespace meniscus
