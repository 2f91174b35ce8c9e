#include "kernels/native/lanes.hpp"
#include "kernels/native/native.hpp"

namespace meniscus::bench::native {
namespace {

// The quadratic B-spline on [0, 1).
inline Floats spline(const Floats& x) {
  const Floats y = 1.5f * x;
  return y < 0.5f ? 0.75f - y * y : 0.5f * (1.5f - y) * (1.5f - y);
}

// Seven rows of eight records of 8 floats, see particle_fit.cl.
struct Particles {
  Floats x, y, z, u, nx, ny, nz;
};

inline Particles load_particles(const float* record, const std::int32_t* index) {
  Floats r[8], lo[4], hi[4];
  for (int k = 0; k < 8; ++k)
    r[k] = load(record + 8 * static_cast<std::ptrdiff_t>(index[k] < 0 ? 0 : index[k]));
  // Transposed in three steps: pairs, fours, eights.
  for (int k = 0; k < 4; ++k) {
    lo[k] = __builtin_shufflevector(r[2 * k], r[2 * k + 1], 0, 8, 1, 9, 4, 12, 5, 13);
    hi[k] = __builtin_shufflevector(r[2 * k], r[2 * k + 1], 2, 10, 3, 11, 6, 14, 7, 15);
  }
  const auto low_halves = [](const Floats& a, const Floats& b) {
    return __builtin_shufflevector(a, b, 0, 1, 8, 9, 4, 5, 12, 13);
  };
  const auto high_halves = [](const Floats& a, const Floats& b) {
    return __builtin_shufflevector(a, b, 2, 3, 10, 11, 6, 7, 14, 15);
  };
  const auto front = [](const Floats& a, const Floats& b) {
    return __builtin_shufflevector(a, b, 0, 1, 2, 3, 8, 9, 10, 11);
  };
  const auto back = [](const Floats& a, const Floats& b) {
    return __builtin_shufflevector(a, b, 4, 5, 6, 7, 12, 13, 14, 15);
  };
  const Floats x0 = low_halves(lo[0], lo[1]), x1 = low_halves(lo[2], lo[3]);
  const Floats y0 = high_halves(lo[0], lo[1]), y1 = high_halves(lo[2], lo[3]);
  const Floats z0 = low_halves(hi[0], hi[1]), z1 = low_halves(hi[2], hi[3]);
  const Floats u0 = high_halves(hi[0], hi[1]), u1 = high_halves(hi[2], hi[3]);
  return {front(x0, x1), front(y0, y1), front(z0, z1), front(u0, u1),
          back(x0, x1),  back(y0, y1),  back(z0, z1)};
}

inline Ints used(const std::int32_t* index) {
  Ints v;
  for (int k = 0; k < 8; ++k) v[k] = index[k] >= 0 ? -1 : 0;
  return v;
}

}  // namespace

void weigh_neighbours(const Neighbours& in, std::size_t begin, std::size_t end) {
  const std::size_t slots = in.slots;
  for (std::size_t batch = begin; batch < end; ++batch) {
    const std::int32_t* const centre = in.particle + 8 * batch;
    const Ints lane_used = used(centre);
    const Particles own = load_particles(in.record, centre);
    const Floats inverse_rho = 1.0f / load(in.support + 8 * batch);
    const std::size_t first = static_cast<std::size_t>(in.first[batch]);
    Ints counted{};
    for (int k = 0; k < in.length[batch]; ++k) {
      const std::size_t slot = first + 8 * static_cast<std::size_t>(k);
      const std::int32_t* const j = in.neighbour + slot;
      const Ints there = used(j) & lane_used;
      const Particles p = load_particles(in.record, j);
      const Floats x = p.x - own.x, y = p.y - own.y, z = p.z - own.z;
      const Floats squared = x * x + y * y + z * z;
      const Floats turned = smaller(own.nx * p.nx + own.ny * p.ny + own.nz * p.nz - 1.0f, Floats{});
      const Floats near = p.u * spline(smaller(root(squared) * inverse_rho, all(1.0f))) *
                          exp_negative(in.falloff * turned);
      const Floats h = x * own.nx + y * own.ny + z * own.nz;
      const Floats width = in.height + in.height_growth * squared;
      const Floats weight = larger(exp_negative(-(h * h) / (width * width)), all(1e-5f));
      const Ints counts = there & (near >= 1e-6f);
      counted -= counts;
      store(x * inverse_rho, in.points + slot);
      store(y * inverse_rho, in.points + slots + slot);
      store(z * inverse_rho, in.points + 2 * slots + slot);
      store(p.nx, in.points + 3 * slots + slot);
      store(p.ny, in.points + 4 * slots + slot);
      store(p.nz, in.points + 5 * slots + slot);
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
