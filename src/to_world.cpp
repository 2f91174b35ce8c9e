#include "to_world.hpp"

#include <algorithm>
#include <atomic>

#include "parallel.hpp"

namespace meniscus {

Surface to_world(const View& view, Extraction extraction, Surface surface,
                 const Parameters& params) {
  SurfaceMap& image = extraction.image;
  const std::size_t pixels = image.depth.size(), nx = static_cast<std::size_t>(image.grid.nx);
  surface.depth = std::move(image.depth);  // depth and normals are turned where they are
  surface.normal = std::move(image.normal);
  surface.kind = std::move(image.kind);
  surface.velocity = std::move(image.velocity);  // in world units already
  parallel_both([&] { surface.position.resize(pixels); },  // which write all of it
                [&] {
                  surface.group.resize(pixels);
                  surface.residual.resize(pixels);
                });
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
        const float t = surface.depth[s];
        if (!(t < kNoSurface)) {  // its normal is zero as it came
          surface.depth[s] = kNoSurface;
          continue;
        }
        ++here;
        const double u = static_cast<double>(i) + 0.5;
        surface.depth[s] = static_cast<float>(t * view.radius);
        surface.position[s] =
            static_cast<Vec3>((start + start_step * u) + (along + along_step * u) * double{t});
        surface.normal[s] = static_cast<Vec3>(world_direction(view, Vec3d(surface.normal[s])));
        const std::int32_t g = image.group[s];
        if (g < 0) continue;
        surface.group[s] = static_cast<std::uint32_t>(g) + 1;
        surface.residual[s] = std::max(0.0f, extraction.residual[static_cast<std::size_t>(g)]);
      }
    }
    covered += here;
  });
  surface.mesh = std::move(extraction.mesh);
  surface.counts = std::move(extraction.counts);
  if (params.image) surface.counts.emplace_back("pixels", covered.load());
  const auto none = [&](const char* what) {
    return std::any_of(surface.counts.begin(), surface.counts.end(),
                       [&](const auto& count) { return count.first == what && count.second == 0; });
  };
  if (none("in view"))
    surface.warnings.push_back(none("particles") ? "there are no particles: the surface is empty"
                                                 : "no particle is in view: the surface is empty");
  return surface;
}

}  // namespace meniscus
