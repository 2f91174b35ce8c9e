// motion_of_samples, on the frame's surface with made-up velocities.
#include <cmath>
#include <memory>

#include "kernels/cases.hpp"
#include "stages/extras/motion.hpp"
#include "stages/frame/bins.hpp"

namespace meniscus::bench {
namespace {

// Particles within the support of each sample, all together.
double count_in_reach(const View& view, const Cells& cells, const SurfaceMap& image) {
  double pairs = 0;
  for (int j = 0; j < image.grid.ny; ++j)
    for (int i = 0; i < image.grid.nx; ++i) {
      const float depth = image.depth[static_cast<std::size_t>(j) * image.grid.nx + i];
      if (!(depth < kNoSurface)) continue;
      const Vec3 at = static_cast<Vec3>(point_at(view, i + 0.5, j + 0.5, depth));
      visit_near(cells, at.x, at.y, at.z, [&](std::int32_t p) {
        const float dx = cells.x[p] - at.x, dy = cells.y[p] - at.y, dz = cells.z[p] - at.z;
        pairs += dx * dx + dy * dy + dz * dz < kDensitySupport * kDensitySupport;
        return true;
      });
    }
  return pairs;
}

}  // namespace

Case prepare_motion(Frame& frame) {
  const SurfaceMap& image = frame.frames(Method::fit).image;
  std::vector<Vec3> velocity;
  for (std::size_t i = 0; i < frame.world.x.size(); ++i)
    velocity.push_back({frame.world.y[i], -frame.world.x[i], std::sin(frame.world.z[i])});
  const auto moving =
      std::make_shared<MovingParticles>(upload_moving(frame.device, frame.projected(), velocity));
  double samples = 0;
  for (const float depth : image.depth) samples += depth < kNoSurface;
  Case result{.unit = "samples", .items = samples};
  // Depths and particles read, velocities written.
  result.bytes = 4 * static_cast<double>(image.grid.size()) +
                 24 * static_cast<double>(moving->velocity.size()) + 12 * samples;
  // A pair: difference 3, square 5, weight 5, nearest 1, sums 7. A sample: its ray's point 4,
  // quotient 4.
  result.operations = 21 * count_in_reach(frame.view, moving->cells, image) + 8 * samples;
  result.launch = [&frame, &image, moving] {
    motion_of_samples(frame.device, frame.view, *moving, image.grid, image.depth);
  };
  return result;
}

}  // namespace meniscus::bench
