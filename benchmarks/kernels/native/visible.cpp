#include "kernels/native/bins.hpp"

namespace meniscus::bench::native {

void splat_depth(const Bins& in, std::size_t begin, std::size_t end) {
  const Floats beyond = all(std::numeric_limits<float>::infinity());
  draw_bins(
      in, begin, end, [&](int particle) { return in.records[8 * particle + 6]; },
      [&](const float* disc, const Floats& u, float v, const Ints& inside, Floats& map) {
        const Floats du = (u - disc[1]) * disc[3];
        const float dv = (v - disc[2]) * disc[4];
        // Beside the box the root is of no number, and no comparison holds.
        const Floats squared = (inside ? du * du : beyond) + dv * dv;
        Floats front = disc[0] - disc[5] * root(1.0f - squared);
        front = front < 1e-6f ? all(1e-6f) : front;
        map = smaller(front, map);
      });
}

}  // namespace meniscus::bench::native
