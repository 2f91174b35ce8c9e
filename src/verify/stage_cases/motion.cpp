// The kernels of motion.cl: points and samples among scattered particles that move.
#include "stages/extras/motion.hpp"

#include "prepare/velocities.hpp"
#include "verify/reference/motion.hpp"
#include "verify/stage_cases/cases.hpp"
#include "verify/stage_cases/inputs.hpp"
#include "verify/stage_cases/worst.hpp"

namespace meniscus::verify {
namespace {

using Known = std::vector<reference::MovingParticle>;

// `shift`: how far the point itself may be off, radii.
void see(Worst& worst, const Vec3& found, const Known& known, const Vec3d& at, double shift) {
  reference::Motion expected;
  expected.weight = 1;  // where no velocity is known nothing moves, exactly
  if (!known.empty()) expected = reference::motion(known, at);
  // The mean of velocities that cancel: the largest of them is about 6.
  const double bound = reference::motion_error(expected, shift);
  worst.see(found.x, expected.velocity.x, bound, 6);
  worst.see(found.y, expected.velocity.y, bound, 6);
  worst.see(found.z, expected.velocity.z, bound, 6);
}

}  // namespace

ReferenceErrors motion_case(Device& device, int size) {
  const auto n = static_cast<std::size_t>(size);
  return motion_errors(device, n, n / 2 + 3, perspective_camera(size < 100 ? 21 : 45, 13));
}

ReferenceErrors motion_errors(Device& device, std::size_t n, std::size_t beside,
                              const Camera& camera) {
  Projected particles = scattered(n, 8, static_cast<unsigned>(n));
  Random random(7);
  std::vector<Vec3> velocity;
  Known known;
  for (std::size_t i = 0; i < n; ++i) {
    particles.index.push_back(static_cast<std::uint32_t>(i));
    velocity.push_back(
        i % 7 == 3 ? kNoVelocity
                   : Vec3{static_cast<float>(random(-5, 5)), static_cast<float>(random(2, 3)), 0});
    if (i % 7 != 3) known.push_back({particles.eye(i), Vec3d(velocity.back())});
  }
  const MovingParticles moving = upload_moving(device, particles, velocity);

  std::vector<Vec3d> points;
  for (std::size_t k = 0; k < beside; ++k)
    points.push_back(
        Vec3d(Vec3{static_cast<float>(random(-12, 12)), static_cast<float>(random(-12, 12)),
                   static_cast<float>(random(-32, -8))}));
  for (std::size_t i = 0; i < n; ++i) points.push_back(particles.eye(i));
  const std::vector<Vec3> of_points = motion_of_points(device, moving, points);
  Worst at_points("motion_of_points", "velocity");
  for (std::size_t k = 0; k < points.size(); ++k) see(at_points, of_points[k], known, points[k], 0);

  // A slope with a jump, holes and loose samples.
  const View view = make_view(camera, 0.5, {0, 0, 0});
  const SampleGrid grid = pixel_grid(view);
  const auto nx = static_cast<std::size_t>(grid.nx);
  std::vector<float> depth(grid.size(), kNoSurface);
  for (std::size_t s = 0; s < grid.size(); ++s)
    if (s % 11 != 0 && s % nx < 40)
      depth[s] =
          static_cast<float>(s % 13 == 0 ? random(10, 40) : 15 + static_cast<double>(s % nx) * 0.3);
  const std::vector<Vec3> of_samples = motion_of_samples(device, view, moving, grid, depth);
  Worst at_samples("motion_of_samples", "velocity");
  for (std::size_t s = 0; s < grid.size(); ++s) {
    const Vec3d at = point_at(view, static_cast<double>(s % nx) + 0.5,
                              static_cast<double>(s / nx) + 0.5, depth[s]);
    // The ray's four numbers round three times each at less than 1 per pixel, twice more with the
    // depth, and all stays below 60 radii.
    if (depth[s] < kNoSurface)
      see(at_samples, of_samples[s], known, at, 8 * kEpsilon * 60);
    else
      see(at_samples, of_samples[s], {}, at, 0);
  }
  return {at_points.error(), at_samples.error()};
}

}  // namespace meniscus::verify
