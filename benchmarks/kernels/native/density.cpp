#include <algorithm>
#include <limits>

#include "kernels/native/field.hpp"
#include "kernels/native/lanes.hpp"

namespace meniscus::bench::native {
namespace {

// The particles of the 27 cells around points that are in reach of the points' box, in the order in
// which sums take them, without those of other rows that share their buckets.
struct Around27 {
  static constexpr int kMost = 4096;
  int count;  // more than kMost: not all are there
  float x[kMost + 16], y[kMost + 16], z[kMost + 16];

  bool whole() const { return count <= kMost; }

  void gather(const Cells& in, int cx, int cy, int cz, const Floats& at_x, const Floats& at_y,
              const Floats& at_z) {
    const float x0 = -most_lane(-at_x), x1 = most_lane(at_x), y0 = -most_lane(-at_y),
                y1 = most_lane(at_y), z0 = -most_lane(-at_z), z1 = most_lane(at_z);
    const auto beyond = [](const Floats& p, float low, float high) {
      return larger(larger(low - p, p - high), Floats{});
    };
    count = 0;
    for (int k = cz - 1; k <= cz + 1; ++k)
      for (int j = cy - 1; j <= cy + 1; ++j) {
        const std::int32_t tag = bucket_of(in, cx, j, k).tag;
        visit_row(in, cx - 1, j, k, 3, [&](int begin, int end) {
          for (int p = begin; p < end && whole(); p += 8) {
            const Floats px = load(in.x + p), py = load(in.y + p), pz = load(in.z + p);
            const Floats dx = beyond(px, x0, x1), dy = beyond(py, y0, y1), dz = beyond(pz, z0, z1);
            const unsigned take =
                bits_of((dx * dx + dy * dy + dz * dz < kSupport * kSupport + 0.01f) &
                        (((load(in.tag + p) ^ tag) & ~2047) == 0) & (kPlaces < end - p));
            pack(take, px, x + count);
            pack(take, py, y + count);
            pack(take, pz, z + count);
            count += __builtin_popcount(take);
          }
        });
      }
  }
};

// As slice_of in density.cl.
struct Slice {
  int fewest, sum;
};
Slice slice_of(const Cells& in, int cx, int cy, int cz, int least) {
  Slice s{1 << 30, 0};
  for (int k = cz - 1; k <= cz + 1; ++k)
    for (int j = cy - 1; j <= cy + 1; ++j) {
      const Bucket bucket = bucket_of(in, cx, j, k);
      int count = 0;
      for (int p = bucket.begin; p < bucket.end; p += 8)
        count += __builtin_popcount(
            bits_of((load(in.tag + p) == bucket.tag) & (kPlaces < bucket.end - p)));
      s.fewest = std::min(s.fewest, count);
      s.sum += count;
      if (count < least) return s;
    }
  return s;
}

}  // namespace

void measure_gradients(const Field& input, std::size_t begin, std::size_t end) {
  const Cells& in = input.cells;
  Around27 near;
  int cx = std::numeric_limits<int>::min(), cy = 0, cz = 0;
  bool inside = false;
  Slice before{}, here{}, after{};
  for (std::size_t a = begin; a < end;) {
    const int own_x = cell_of(in.x[a], in.inverse_cell), own_y = cell_of(in.y[a], in.inverse_cell),
              own_z = cell_of(in.z[a], in.inverse_cell);
    if (own_x != cx || own_y != cy || own_z != cz) {
      const bool next = own_x - 1 == cx && own_y == cy && own_z == cz;  // two slices are the same
      cx = own_x;
      cy = own_y;
      cz = own_z;
      before = next ? here : slice_of(in, cx - 1, cy, cz, input.least);
      here = next ? after : slice_of(in, cx, cy, cz, input.least);
      after = slice_of(in, cx + 1, cy, cz, input.least);
      const int fewest = std::min({before.fewest, here.fewest, after.fewest});
      inside = fewest >= input.least && 2 * 27 * fewest >= before.sum + here.sum + after.sum;
    }
    // Up to eight particles of the cell side by side; lanes that are left repeat the first.
    Floats x = all(in.x[a]), y = all(in.y[a]), z = all(in.z[a]);
    int lanes = 1;
    while (lanes < 8 && a + lanes < end && cell_of(in.x[a + lanes], in.inverse_cell) == cx &&
           cell_of(in.y[a + lanes], in.inverse_cell) == cy &&
           cell_of(in.z[a + lanes], in.inverse_cell) == cz) {
      x[lanes] = in.x[a + lanes];
      y[lanes] = in.y[a + lanes];
      z[lanes] = in.z[a + lanes];
      ++lanes;
    }
    FieldAt field;
    if (inside) {
      field.c = all(1.0f / kFieldNorm);
    } else {
      near.gather(in, cx, cy, cz, x, y, z);
      for (int p = 0; p < near.count; ++p)
        add_particle<true>(field, x - near.x[p], y - near.y[p], z - near.z[p], 1.0f);
    }
    const Floats rows[4] = {gradient_of(field.gx), gradient_of(field.gy), gradient_of(field.gz),
                            inside || near.whole() ? field.c * kFieldNorm : all(-1.0f)};
    for (std::size_t row = 0; row < 4; ++row)
      for (int k = 0; k < lanes; ++k) input.result[row * input.count + a + k] = rows[row][k];
    a += static_cast<std::size_t>(lanes);
  }
}

}  // namespace meniscus::bench::native
