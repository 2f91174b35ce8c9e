// The fits of a tile of samples, as tile_lists.cl has them. Everything has internal linkage.
#pragma once

#include "kernels/native/hits.hpp"

namespace meniscus::bench::native {
namespace {

struct Beam {
  float ox, oy, dx, dy, wide_x, wide_y, spread_x, spread_y, slant, length, per_square;
};

inline void middle_of(const Floats& v, float& middle, float& wide) {
  const float low = -most_lane(-v), high = most_lane(v);
  middle = 0.5f * (low + high);
  wide = 0.5f * (high - low);
}

inline Beam beam_of(const Sample& s) {
  Beam b;
  middle_of(s.sx - s.t * s.dx, b.ox, b.wide_x);
  middle_of(s.sy - s.t * s.dy, b.oy, b.wide_y);
  middle_of(s.dx, b.dx, b.spread_x);
  middle_of(s.dy, b.dy, b.spread_y);
  b.slant = std::sqrt(1.0f + most_lane(s.dx * s.dx + s.dy * s.dy));
  const float square = b.dx * b.dx + b.dy * b.dy + 1.0f;
  b.length = std::sqrt(square);
  b.per_square = 1.0f / square;
  return b;
}

// A tile's fits.
struct List {
  const std::int32_t* fit;
  const float* place;
  std::ptrdiff_t stride;
  int count;
  Floats row(int number, int k) const { return load(place + number * stride + k); }
};

// Which of the kWidth fits from place k of a list a ray of the beam may meet, as bits.
inline unsigned near_beam(const List& list, int k, const Beam& b) {
  const Floats t = -list.row(2, k), reach = list.row(3, k);
  const Floats x = list.row(0, k) - (b.ox + t * b.dx), y = list.row(1, k) - (b.oy + t * b.dy);
  const Floats wide_x = b.wide_x + magnitude(t) * b.spread_x,
               wide_y = b.wide_y + magnitude(t) * b.spread_y;
  const Floats farthest = 1.01f * (reach * b.slant) + 0.01f;
  const Floats off_x = larger(magnitude(x) - wide_x, Floats{}),
               off_y = larger(magnitude(y) - wide_y, Floats{});
  const Floats nx = list.row(4, k), ny = list.row(5, k), nz = list.row(6, k);
  const Floats along = (nx * b.dx + ny * b.dy - nz) * b.per_square;
  const Floats facing = magnitude(along) * b.length;
  const Floats tilt = root(larger(1.0f - facing * facing, Floats{}));
  const Floats kx = nx - along * b.dx, ky = ny - along * b.dy;
  const Floats width = (reach * (facing + b.spread_x + b.spread_y) + list.row(7, k) * tilt) * tilt +
                       wide_x * magnitude(kx) + wide_y * magnitude(ky);
  return bits_of((off_x * off_x + off_y * off_y < farthest * farthest) &
                 (magnitude(x * kx + y * ky) < 1.01f * width + 0.01f) & (kPlaces < list.count - k));
}

// The box of some points, and which of the kWidth fits from place k of a list reach it, as bits.
struct Box {
  float x0, x1, y0, y1, z0, z1;
};

inline Box box_of(const Floats& x, const Floats& y, const Floats& z, const Ints& some) {
  const auto least = [&](const Floats& v) { return -most_lane(some ? -v : all(-kNowhere)); };
  return {least(x), -least(-x), least(y), -least(-y), least(z), -least(-z)};
}

inline unsigned reach_box(const List& list, int k, const Box& b) {
  const Floats x = list.row(0, k), y = list.row(1, k), z = list.row(2, k);
  const Floats reach = 1.01f * list.row(3, k);
  const Floats dx = larger(larger(b.x0 - x, x - b.x1), Floats{});
  const Floats dy = larger(larger(b.y0 - y, y - b.y1), Floats{});
  const Floats dz = larger(larger(b.z0 - z, z - b.z1), Floats{});
  return bits_of((dx * dx + dy * dy + dz * dz < reach * reach) & (kPlaces < list.count - k));
}

struct Listed {
  List met, rim;
};

}  // namespace
}  // namespace meniscus::bench::native
