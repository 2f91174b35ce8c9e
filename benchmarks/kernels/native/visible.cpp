#include "kernels/native/bins.hpp"

namespace meniscus::bench::native {

void splat_depth(const Bins& in, std::size_t begin, std::size_t end) {
  const Floats beyond = all(std::numeric_limits<float>::infinity());
  Floats u{};
  int top = 0;
  draw_bins(
      in, begin, end,
      [&](int i, int j) {
        u = in.first + in.step * (static_cast<float>(i) + kLanes);
        top = j;
      },
      [&](int particle) { return in.records[8 * particle + 6]; },
      [&](int particle, int row, const Ints& inside, Floats& map) {
        const float* const disc = in.records + std::ptrdiff_t{8} * particle;
        const Floats du = (u - disc[1]) * disc[3];
        const float dv = (in.first + in.step * static_cast<float>(top + row) - disc[2]) * disc[4];
        // Beside the box the root is of no number, and no comparison holds.
        const Floats squared = (inside ? du * du : beyond) + dv * dv;
        Floats front = disc[0] - disc[5] * root(1.0f - squared);
        front = front < 1e-6f ? all(1e-6f) : front;
        map = smaller(front, map);
      });
}

}  // namespace meniscus::bench::native
