// draw_whitewater: discs of many sizes, before, on and behind a stepped front, some out of view,
// some larger than the screen.
#include "verify/stage_cases/whitewater.hpp"

#include "stages/extras/whitewater.hpp"
#include "verify/stage_cases/inputs.hpp"

namespace meniscus::verify {
namespace {

constexpr double kRadius = 0.15, kTolerance = 1;  // world units; particle radii

std::vector<reference::Drop> drops_around(std::size_t count, unsigned seed) {
  Random random(seed);
  std::vector<reference::Drop> drops;
  const auto exact = [&](double low, double high) {  // in float
    return double{static_cast<float>(random(low, high))};
  };
  while (drops.size() < count) {
    // From a hundredth of a pixel to a few; every 64th covers much of the screen.
    const double size = drops.size() % 64 == 40 ? 8 : std::exp2(random(-9, 1));
    drops.push_back({{exact(-5, 5), exact(-5, 5), exact(-5, 11)},
                     double{static_cast<float>(size * kRadius)},
                     {exact(-3, 3), exact(-3, 3), exact(-3, 3)}});
  }
  return drops;
}

WhitewaterParticles upload_drops(Device& device, const std::vector<reference::Drop>& drops) {
  std::vector<float> x, y, z, radius, vx, vy, vz;
  const auto add = [](std::vector<float>& to, double value) {
    to.push_back(static_cast<float>(value));
  };
  for (const reference::Drop& drop : drops) {
    add(x, drop.at[0]);
    add(y, drop.at[1]);
    add(z, drop.at[2]);
    add(radius, drop.radius);
    add(vx, drop.velocity.x);
    add(vy, drop.velocity.y);
    add(vz, drop.velocity.z);
  }
  return {upload(device, x),  upload(device, y),  upload(device, z), upload(device, radius),
          upload(device, vx), upload(device, vy), upload(device, vz)};
}

}  // namespace

void WhitewaterErrors::see(const WhitewaterMaps& maps, std::size_t s,
                           const reference::WhitewaterPixel& e, double radius) {
  density.see(maps.density[s], e.density, e.density_error + kEpsilon * e.density, 1);
  coverage.see(maps.coverage[s], 1 - e.left, e.coverage_error + kEpsilon, 1);
  if (e.depth_is_sure())
    depth.see(maps.depth[s], e.depth * radius, (e.depth_error + kEpsilon * e.depth) * radius);
  if (!(e.density > 4 * e.density_error)) return;
  // A quotient's error: those of both, over a divisor that may be a quarter too large.
  const auto mean_error = [&](double mean, double error) {
    return (error + mean * e.density_error) / (0.75 * e.density) + kEpsilon * mean;
  };
  const Vec3d mean = e.velocity / e.density;
  velocity.see(length(Vec3d(maps.velocity[s]) - mean), 0,
               mean_error(length(mean), e.velocity_error), 1);
  if (maps.type == WhitewaterType::bubble)
    behind.see(maps.behind[s], e.behind / e.density * radius,
               mean_error(e.behind / e.density, e.behind_error) * radius, 1);
}

ReferenceErrors whitewater_case(Device& device, int size) {
  WhitewaterErrors errors;
  for (const Camera& camera : {perspective_camera(53, 41), orthographic_camera(45, 31)}) {
    const View view = make_view(camera, kRadius, {0.5, -0.25, 0.125});
    const std::vector<float> front = [&] {
      std::vector<float> depths = patches(pixel_grid(view), 3);  // 20 and 38 radii away
      for (float& t : depths) t = world_depth(view, 1.6 * double{t});
      return depths;
    }();
    const auto drops = drops_around(static_cast<std::size_t>(size), 21);
    for (const WhitewaterType type : {WhitewaterType::spray, WhitewaterType::bubble}) {
      const bool bubbles = type == WhitewaterType::bubble;
      std::vector<double> from, to;
      for (const float world : front) {
        const double t = world / kRadius;
        from.push_back(bubbles ? t - kTolerance : 0);
        to.push_back(bubbles ? 1e30 : t + kTolerance);
      }
      const auto expected = reference::whitewater(camera, kRadius, view.near_depth, drops, from, to,
                                                  bubbles ? kTolerance : 0);
      const WhitewaterSums sums = no_whitewater(device, view, true, bubbles);
      draw_whitewater(device, view, upload_drops(device, drops), drops.size(),
                      shown_depths(device, view, type, front, {}, kTolerance), sums);
      const WhitewaterMaps maps = finish_whitewater(device, view, type, sums);
      for (std::size_t s = 0; s < expected.size(); ++s)
        if (expected[s].sure) errors.see(maps, s, expected[s], kRadius);
    }
  }
  return errors.all();
}

}  // namespace meniscus::verify
