// Where a ray meets a fit, as hits.cl has it. Everything has internal linkage.
#pragma once

#include <limits>

#include "kernels/native/lanes.hpp"
#include "kernels/native/samples.hpp"

namespace meniscus::bench::native {
namespace {

constexpr int kRecord = 16;  // FIT of records.h
constexpr float kPull = 0.75f, kRoundPull = -0.2f, kRoundest = 0.9f, kGraze = 0.3f;
constexpr float kNowhere = std::numeric_limits<float>::infinity(), kTiny = 1e-30f;

inline Floats inverse_root(const Floats& squared, float least) {
  return 1.0f / root(larger(squared, all(least)));
}

struct Sample {
  Floats sx, sy, t, dx, dy;
};

struct Hit {
  Floats tau, weight, gx, gy, gz, pull;
};

inline Floats bend_along(const float* g, const Sample& s) {
  const Floats x = fused(all(g[4]), s.dx, fused(all(g[7]), s.dy, all(-g[9]))),
               y = fused(all(g[5]), s.dy, all(-g[8]));
  return fused(x, s.dx, fused(y, s.dy, all(g[6])));
}

[[gnu::always_inline]] inline void gradient_at(const float* g, const Floats& x, const Floats& y,
                                               const Floats& z, Floats& gx, Floats& gy,
                                               Floats& gz) {
  const Floats xy = all(g[7]), yz = all(g[8]), zx = all(g[9]);
  gx = fused(all(g[4]), x + x, fused(xy, y, fused(zx, z, all(g[1]))));
  gy = fused(all(g[5]), y + y, fused(xy, x, fused(yz, z, all(g[2]))));
  gz = fused(all(g[6]), z + z, fused(yz, y, fused(zx, x, all(g[3]))));
}

[[gnu::always_inline]] inline Floats value_at(const float* g, const Floats& x, const Floats& y,
                                              const Floats& z, const Floats& gx, const Floats& gy,
                                              const Floats& gz) {
  return fused(all(0.5f), fused(gx + g[1], x, fused(gy + g[2], y, (gz + g[3]) * z)), all(g[0]));
}

[[gnu::always_inline]] inline Floats dot_of(const Floats& ax, const Floats& ay, const Floats& az,
                                            const Floats& bx, const Floats& by, const Floats& bz) {
  return fused(ax, bx, fused(ay, by, az * bz));
}
[[gnu::always_inline]] inline Floats square_of(const Floats& x, const Floats& y, const Floats& z) {
  return dot_of(x, y, z, x, y, z);
}

// Where rays enter a fit's fluid or graze it, and how far from its foot, in reaches: infinite where
// they do neither; and how high above it they pass.
struct Entry {
  Floats tau, squared, height;
  bool counts() const { return any(squared < 1.0f); }
};

[[gnu::always_inline]] inline Entry entry_of(const float* g, const float* foot, const Sample& s,
                                             float d_max) {
  const Floats x = s.sx - foot[0], y = s.sy - foot[1], z = -s.t - foot[2];
  Floats gx, gy, gz;
  gradient_at(g, x, y, z, gx, gy, gz);
  const Floats C = value_at(g, x, y, z, gx, gy, gz);
  const Floats B = fused(gx, s.dx, fused(gy, s.dy, -gz));
  const Floats A = bend_along(g, s);
  const Floats D = fused(B, B, -4.0f * A * C);
  const Ints falls = B < 0.0f;
  const Floats sum = magnitude(B) + root(D);
  const Floats least = -0.25f * D / A;
  const Ints bent = A > 0.0f, grazed = bent & (least > 0.0f) & (least < kGraze);
  const Floats entered = (falls ? 2.0f * C : -sum) / (falls ? sum : 2.0f * A);
  const Floats tau = grazed ? -0.5f * B / A : entered;
  const Ints met = magnitude(tau) <= (grazed ? all(1.0f) : all(4.0f)) * d_max;
  Entry entry;
  entry.tau = met ? tau : Floats{};
  const Floats px = fused(entry.tau, s.dx, x), py = fused(entry.tau, s.dy, y), pz = z - entry.tau;
  entry.squared = met ? square_of(px, py, pz) * g[10] : all(kNowhere);
  entry.height = bent ? larger(least, all(-kGraze)) : all(-kGraze);
  return entry;
}

// Returns whether any of the rays has weight there.
[[gnu::always_inline]] inline bool weigh(const float* g, const float* foot, const Sample& s,
                                         float d_max, const Entry& entry, Hit& hit) {
  const Floats none{}, one = all(1.0f), tau = entry.tau;
  const Floats x = s.sx - foot[0], y = s.sy - foot[1], z = -s.t - foot[2];
  const Floats near = larger(one - entry.squared, none);
  Floats gx, gy, gz;
  gradient_at(g, fused(tau, s.dx, x), fused(tau, s.dy, y), z - tau, gx, gy, gz);
  const Floats slope = 1.0f / root(larger(square_of(gx, gy, gz), all(1e-20f)));
  const Floats facing = fused(gx, s.dx, fused(gy, s.dy, -gz)) * slope;
  const Ints met = magnitude(tau) * smaller(2.0f * magnitude(facing), one) <= d_max;
  const Floats steep = met ? near * near * g[11] : none;
  hit.tau = tau;
  hit.weight = steep * near;
  hit.gx = gx * slope;
  hit.gy = gy * slope;
  hit.gz = gz * slope;
  hit.pull = 6.0f * g[10] * (g[15] * ((kPull - kRoundPull) / kRoundest) - kPull) * steep * facing;
  return any(hit.weight > 0.0f);
}

[[gnu::always_inline]] inline void fade(const Entry& entry, Hit& hit) {
  const Floats rest = 1.0f - larger(entry.height, Floats{}) * (1.0f / kGraze);
  hit.weight *= rest * rest;
  hit.pull *= rest * rest;
}

}  // namespace
}  // namespace meniscus::bench::native
