#include "output/spray.hpp"

#include <algorithm>
#include <cmath>

#include "prepare/velocities.hpp"

namespace meniscus {

std::vector<std::int32_t> draw_spray(const View& view, const std::vector<SprayDrop>& spray,
                                     SurfaceMap& image) {
  const SampleGrid& grid = image.grid;
  std::vector<std::int32_t> shown(image.depth.size(), -1);
  for (const SprayDrop& drop : spray) {
    const Vec3d centre = eye_from_world(view, drop.centre);
    if (!(-centre.z > view.near_depth)) continue;
    const PixelPosition at = project(view, centre);
    const double radius = drop.radius / view.radius;
    const double ru = radius * view.u_scale / at.w, rv = radius * view.v_scale / at.w;
    const auto draw = [&](int i, int j, double du, double dv) {
      if (i < 0 || j < 0 || i >= grid.nx || j >= grid.ny) return;
      const double height = std::sqrt(std::max(0.0, 1 - du * du - dv * dv));
      const float depth = static_cast<float>(-centre.z - radius * height);
      const std::size_t s = static_cast<std::size_t>(j) * grid.nx + i;
      if (!(depth > 0) || !(depth < image.depth[s])) return;
      image.depth[s] = depth;
      shown[s] = static_cast<std::int32_t>(&drop - spray.data());
      image.normal[s] = static_cast<Vec3>(normalized({du, -dv, height}));
      image.group[s] = -1;
      image.kind[s] = Kind::splash;
      if (!image.velocity.empty())
        image.velocity[s] = is_known(drop.velocity) ? drop.velocity : Vec3{};
    };
    const auto bound = [&](double pixel, int samples) {
      return static_cast<int>(std::clamp((pixel - grid.first) / grid.step, -1.0, double(samples)));
    };
    bool drawn = false;
    const int j0 = bound(at.v - rv, grid.ny), j1 = bound(at.v + rv, grid.ny);
    const int i0 = bound(at.u - ru, grid.nx), i1 = bound(at.u + ru, grid.nx);
    for (int j = j0; j <= j1; ++j)
      for (int i = i0; i <= i1; ++i) {
        const double du = (grid.first + double{grid.step} * i - at.u) / ru;
        const double dv = (grid.first + double{grid.step} * j - at.v) / rv;
        if (du * du + dv * dv >= 1) continue;
        drawn = true;
        draw(i, j, du, dv);
      }
    if (!drawn)
      draw(static_cast<int>(std::floor((at.u - grid.first) / grid.step + 0.5)),
           static_cast<int>(std::floor((at.v - grid.first) / grid.step + 0.5)), 0, 0);
  }
  return shown;
}

}  // namespace meniscus
