#include "kernels/native/bins.hpp"

namespace meniscus::bench::native {

void draw_triangles(const Triangles& triangles, std::size_t begin, std::size_t end) {
  draw_bins(
      triangles.bins, begin, end, [](int) { return -std::numeric_limits<float>::infinity(); },
      [&](const float* r, const Floats& u, float v, const Ints& inside, Floats& map) {
        const Floats du = u - r[0];
        const float dv = v - r[1];
        const Floats l1 = (du * r[5] - r[4] * dv) * r[6], l2 = (r[2] * dv - du * r[3]) * r[6];
        const Floats l0 = 1.0f - l1 - l2;
        const Ints met = inside & (l0 >= -1e-5f) & (l1 >= -1e-5f) & (l2 >= -1e-5f);
        Floats depth = l0 * r[7] + l1 * r[8] + l2 * r[9];
        if (triangles.perspective) depth = 1.0f / depth;
        map = (met & (depth > 0.0f) & (depth < map)) ? depth : map;
      });
}

}  // namespace meniscus::bench::native
