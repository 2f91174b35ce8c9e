#include "kernels/native/lanes.hpp"
#include "kernels/native/native.hpp"

namespace meniscus::bench::native {
namespace {

// The quadratic B-spline on [0, 1).
inline Floats spline(const Floats& x) {
  const Floats y = 1.5f * x;
  return y < 0.5f ? 0.75f - y * y : 0.5f * (1.5f - y) * (1.5f - y);
}

inline Floats gather(const float* values, const std::int32_t* index) {
  Floats v;
  for (int k = 0; k < 8; ++k) v[k] = values[index[k] < 0 ? 0 : index[k]];
  return v;
}

inline Ints used(const std::int32_t* index) {
  Ints v;
  for (int k = 0; k < 8; ++k) v[k] = index[k] >= 0 ? -1 : 0;
  return v;
}

}  // namespace

void weigh_neighbours(const Neighbours& in, std::size_t begin, std::size_t end) {
  const std::size_t n = in.count, slots = in.slots;
  for (std::size_t batch = begin; batch < end; ++batch) {
    const std::int32_t* const centre = in.particle + 8 * batch;
    const Ints lane_used = used(centre);
    const Floats px = gather(in.particles, centre), py = gather(in.particles + n, centre),
                 pz = gather(in.particles + 2 * n, centre);
    const Floats nx = gather(in.normal, centre), ny = gather(in.normal + n, centre),
                 nz = gather(in.normal + 2 * n, centre);
    const Floats inverse_rho = 1.0f / load(in.support + 8 * batch);
    const std::size_t first = static_cast<std::size_t>(in.first[batch]);
    Ints counted{};
    for (int k = 0; k < in.length[batch]; ++k) {
      const std::size_t slot = first + 8 * static_cast<std::size_t>(k);
      const std::int32_t* const j = in.neighbour + slot;
      const Ints there = used(j) & lane_used;
      const Floats x = gather(in.particles, j) - px, y = gather(in.particles + n, j) - py,
                   z = gather(in.particles + 2 * n, j) - pz;
      const Floats mx = gather(in.normal, j), my = gather(in.normal + n, j),
                   mz = gather(in.normal + 2 * n, j);
      const Floats squared = x * x + y * y + z * z;
      const Floats turned = smaller(nx * mx + ny * my + nz * mz - 1.0f, Floats{});
      const Floats near = gather(in.particles + 3 * n, j) *
                          spline(smaller(root(squared) * inverse_rho, all(1.0f))) *
                          exp_negative(in.falloff * turned);
      const Floats h = x * nx + y * ny + z * nz;
      const Floats width = in.height + in.height_growth * squared;
      const Floats weight = larger(exp_negative(-(h * h) / (width * width)), all(1e-5f));
      const Ints counts = there & (near >= 1e-6f);
      counted -= counts;
      store(x * inverse_rho, in.points + slot);
      store(y * inverse_rho, in.points + slots + slot);
      store(z * inverse_rho, in.points + 2 * slots + slot);
      store(mx, in.points + 3 * slots + slot);
      store(my, in.points + 4 * slots + slot);
      store(mz, in.points + 5 * slots + slot);
      store(counts ? near * weight : Floats{}, in.points + 6 * slots + slot);
    }
    const Ints too_few = counted < 3;
    for (int k = 0; k < in.length[batch]; ++k) {
      float* const weight = in.points + 6 * slots + first + 8 * static_cast<std::size_t>(k);
      store(too_few ? Floats{} : load(weight), weight);
    }
  }
}

}  // namespace meniscus::bench::native
