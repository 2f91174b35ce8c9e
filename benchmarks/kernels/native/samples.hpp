// Samples of a tile's list, kWidth at a time, as samples.cl takes them, and their rays. Everything
// has internal linkage.
#pragma once

#include "kernels/native/lanes.hpp"
#include "kernels/native/native.hpp"

namespace meniscus::bench::native {
namespace {

constexpr int kTile = 16;

struct Rays {
  Floats ox, oy, dx, dy;
};
/// face_eye of samples.cl.
inline void face_eye(const Floats& dx, const Floats& dy, Floats& nx, Floats& ny, Floats& nz) {
  const Floats square = dx * dx + dy * dy + 1.0f;
  const Floats along = nx * dx + ny * dy - nz, most = -0.01f * root(square);
  const Ints turned = (along > most) & (nx * nx + ny * ny + nz * nz > 0.5f);
  if (!any(turned)) return;
  const Floats back = (along - most) / square;
  const Floats x = nx - back * dx, y = ny - back * dy, z = nz + back;
  const Floats size = 1.0f / root(larger(x * x + y * y + z * z, all(1e-30f)));
  nx = turned ? x * size : nx;
  ny = turned ? y * size : ny;
  nz = turned ? z * size : nz;
}

inline Rays rays_at(const float* ray, const Floats& u, const Floats& v) {
  return {ray[0] + ray[1] * u + ray[2] * v, ray[3] + ray[4] * u + ray[5] * v,
          ray[6] + ray[7] * u + ray[8] * v, ray[9] + ray[10] * u + ray[11] * v};
}

struct Lanes {
  std::int32_t at[kWidth];  // lanes that are not in use repeat the first
  Ints used;
  Rays rays;
};

/// The lanes from `place` on of a tile's list, which has more than `place`.
inline void load_lanes(const Lists& lists, int tile, int place, Lanes& lanes) {
  const std::int32_t* const list = lists.sample + std::ptrdiff_t{tile} * kTile * kTile;
  const int left = lists.count[tile] - place;
  for (int k = 0; k < kWidth; ++k) lanes.at[k] = list[k < left ? place + k : place];
  lanes.used = kPlaces < left;
  const int tiles_x = (lists.nx + kTile - 1) / kTile;
  const int top = tile / tiles_x * kTile, corner = top * lists.nx + tile % tiles_x * kTile;
  Ints at;
  std::memcpy(&at, lanes.at, sizeof at);
  // Half a sample keeps the quotient off the next row.
  const Ints row =
      top + __builtin_convertvector((__builtin_convertvector(at - corner, Floats) + 0.5f) /
                                        static_cast<float>(lists.nx),
                                    Ints);
  const Floats u = lists.first + lists.step * __builtin_convertvector(at - row * lists.nx, Floats);
  const Floats v = lists.first + lists.step * __builtin_convertvector(row, Floats);
  lanes.rays = rays_at(lists.ray, u, v);
}

inline Floats gather(const float* values, const std::int32_t* at) {
  Floats v;
  for (int k = 0; k < kWidth; ++k) v[k] = values[at[k]];
  return v;
}

template <class Vector, class T>
inline void scatter(const Vector& v, T* values, const std::int32_t* at, const Ints& wanted) {
  for (int k = 0; k < kWidth; ++k)
    if (wanted[k]) values[at[k]] = v[k];
}

/// smooth_step of prelude.cl.
inline Floats smooth_step(float low, float high, const Floats& x) {
  const Floats t = smaller(larger((x - low) * (1.0f / (high - low)), Floats{}), all(1.0f));
  return t * t * (3.0f - 2.0f * t);
}

}  // namespace
}  // namespace meniscus::bench::native
