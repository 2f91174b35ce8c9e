#include "output/to_world.hpp"

#include <algorithm>
#include <atomic>
#include <cmath>

#include "base/large_pages.hpp"
#include "base/parallel.hpp"
#include "device/stage_clock.hpp"

namespace meniscus {

namespace {

// Makes the maps of `image` and returns how many of its pixels show something.
std::int64_t fill_maps(Device& device, const View& view, const SurfaceBuffers& image,
                       const std::vector<float>& residuals, const Aovs& aovs, Surface& surface) {
  const std::size_t pixels = image.grid.size(), nx = static_cast<std::size_t>(image.grid.nx);
  // By this thread, which finds the room of the frame before again.
  reserve_in_large_pages(surface.depth, pixels);
  if (aovs.normal) reserve_in_large_pages(surface.normal, pixels);
  if (aovs.position) reserve_in_large_pages(surface.position, pixels);
  parallel_both(  // while the device still works
      [&] {
        surface.depth.resize(pixels, kNoSurface);
        if (aovs.position) surface.position.resize(pixels);
        if (aovs.kind) surface.kind.resize(pixels);
      },
      [&] {
        if (aovs.normal) surface.normal.resize(pixels);
        if (aovs.group) surface.group.resize(pixels);
        if (aovs.residual) surface.residual.resize(pixels);
      });
  const ShownView shown(device, image, aovs.normal, aovs.kind);
  const float *const depth = shown.depth, *const normal = shown.normal;
  const HostView group(device, aovs.group || aovs.residual ? image.group : Buffer<cl_int>{});
  std::atomic<std::int64_t> covered{0};
  constexpr std::size_t kRows = 32;  // that are worth a thread
  parallel_for(pixels > 0 ? pixels / nx : 0, kRows, [&](std::size_t begin, std::size_t end) {
    std::int64_t here = 0;
    for (std::size_t j = begin; j < end; ++j) {
      // The rays of a row in world space: starts and directions are affine in u.
      const double v = static_cast<double>(j) + 0.5;
      const auto start_at = [&](double u) { return world_from_eye(view, point_at(view, u, v, 0)); };
      const auto direction_at = [&](double u) {
        return world_direction(view, ray_direction(view, u, v)) * view.radius;
      };
      const Vec3d start = start_at(0), start_step = start_at(1) - start;
      const Vec3d along = direction_at(0), along_step = direction_at(1) - along;
      for (std::size_t i = 0; i < nx; ++i) {
        const std::size_t s = j * nx + i;
        const float t = depth[s];
        if (!(t < kNoSurface)) continue;  // as made
        ++here;
        const double u = static_cast<double>(i) + 0.5;
        surface.depth[s] = world_depth(view, t);
        if (aovs.position)
          surface.position[s] =
              static_cast<Vec3>((start + start_step * u) + (along + along_step * u) * double{t});
        if (aovs.normal)
          surface.normal[s] = static_cast<Vec3>(world_direction(
              view, Vec3d(Vec3{normal[s], normal[pixels + s], normal[2 * pixels + s]})));
        if (aovs.kind) surface.kind[s] = shown.kind ? kind_of(shown.kind[s]) : Kind::surface;
        const std::int32_t g = group.size() > 0 ? group[s] : -1;
        if (g < 0) continue;
        if (aovs.group) surface.group[s] = static_cast<std::uint32_t>(g) + 1;
        if (aovs.residual)
          surface.residual[s] = std::max(0.0f, residuals[static_cast<std::size_t>(g)]);
      }
    }
    covered += here;
  });
  return covered;
}

}  // namespace

Surface to_world(Device& device, const View& view, Extraction extraction, Surface surface,
                 const Parameters& params, Notices& notices, std::vector<StageTime>* timings) {
  StageClock clock(device, timings);
  clock.start("download");
  const std::int64_t covered =
      fill_maps(device, view, extraction.image, extraction.residual, params.aovs, surface);
  clock.stop();
  surface.velocity = std::move(extraction.velocity);  // in world units already
  surface.attributes = std::move(extraction.attributes);
  surface.layers = std::move(extraction.layers);
  surface.mesh = std::move(extraction.mesh);
  surface.disorder = extraction.disorder.amount;
  Counts& counts = surface.counts;
  counts = extraction.counts;
  if (params.image) counts.pixels = covered;
  const std::int64_t in_view = counts.in_view + std::max<std::int64_t>(counts.spray, 0);
  if (in_view == 0)
    notices.add(counts.particles == 0
                    ? Notice{.code = Code::no_particles,
                             .text = "there are no particles: the surface is empty"}
                    : Notice{.code = Code::none_in_view,
                             .text = "no particle is in view: the surface is empty "
                                     "(check where the camera is and looks)",
                             .count = counts.particles});
  else if (in_view > 0 && params.image && covered == 0)
    notices.add(
        {.code = Code::none_shown,
         .text = "no pixel shows the particles in view (" + std::to_string(in_view) +
                 "): the surface is empty (check the particle radius, and that no stray particle "
                 "has moved the camera away)",
         .count = in_view});
  return surface;
}

}  // namespace meniscus
