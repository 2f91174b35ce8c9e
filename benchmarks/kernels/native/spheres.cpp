#include "kernels/native/bins.hpp"
#include "kernels/native/samples.hpp"

namespace meniscus::bench::native {

void cast_spheres(const Spheres& spheres, std::size_t begin, std::size_t end) {
  const Bins& in = spheres.bins;
  Rays rays[kBin];
  Floats a[kBin];
  draw_bins(
      in, begin, end,
      [&](int i, int j) {
        const Floats u = in.first + in.step * (static_cast<float>(i) + kLanes);
        for (int row = 0; row < kBin; ++row) {
          const Rays& r = rays[row] =
              rays_at(spheres.ray, u, all(in.first + in.step * static_cast<float>(j + row)));
          a[row] = r.dx * r.dx + r.dy * r.dy + 1.0f;
        }
      },
      [&](int particle) {
        const float nearest = in.records[8 * particle + 4];
        return nearest > 1e-6f ? nearest : 1e-6f;
      },
      [&](int particle, int row, const Ints& inside, Floats& map) {
        const float* const s = in.records + std::ptrdiff_t{8} * particle;
        const Rays& r = rays[row];
        const Floats qx = r.ox + s[2] * r.dx - s[0], qy = r.oy + s[2] * r.dy - s[1];
        const Floats b = qx * r.dx + qy * r.dy, c = qx * qx + qy * qy - s[3];
        const Floats discriminant = b * b - a[row] * c;
        if (!any(discriminant >= 0.0f)) return;
        Floats depth = s[2] - (b + root(discriminant)) / a[row];
        depth = depth < 1e-6f ? all(1e-6f) : depth;
        map = (inside & (depth < map)) ? depth : map;
      });
}

}  // namespace meniscus::bench::native
