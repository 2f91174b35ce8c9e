#define MENISCUS_WIDE
#include <algorithm>
#include <limits>

#include "kernels/native/field.hpp"
#include "kernels/native/lanes.hpp"

namespace meniscus::bench::native {
namespace {

// Particles are gone through so many at a time; those that are summed at together lie in so many
// cells of a row.
constexpr std::size_t kBlock = 128;
constexpr int kSpan = kWidth * 3 / 8;

// The particles of the cells around points that are in reach of the points' box, in the order in
// which sums take them, without those of other rows that share their buckets.
struct AroundCells {
  static constexpr int kMost = 4096;
  int count;  // more than kMost: not all are there
  float x[kMost + 16], y[kMost + 16], z[kMost + 16];

  bool whole() const { return count <= kMost; }

  void gather(const Cells& in, int cx, int cy, int cz, int wide, const Floats& at_x,
              const Floats& at_y, const Floats& at_z) {
    const float x0 = -most_lane(-at_x), x1 = most_lane(at_x), y0 = -most_lane(-at_y),
                y1 = most_lane(at_y), z0 = -most_lane(-at_z), z1 = most_lane(at_z);
    const auto beyond = [](const Floats& p, float low, float high) {
      return larger(larger(low - p, p - high), Floats{});
    };
    count = 0;
    for (int k = cz - 1; k <= cz + 1; ++k)
      for (int j = cy - 1; j <= cy + 1; ++j) {
        const std::int32_t tag = bucket_of(in, cx, j, k).tag;
        visit_row(in, cx - 1, j, k, wide + 2, [&](int begin, int end) {
          for (int p = begin; p < end && whole(); p += kWidth) {
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
      for (int p = bucket.begin; p < bucket.end; p += kWidth)
        count += __builtin_popcount(
            bits_of((load(in.tag + p) == bucket.tag) & (kPlaces < bucket.end - p)));
      s.fewest = std::min(s.fewest, count);
      s.sum += count;
      if (count < least) return s;
    }
  return s;
}

struct Place {
  int x, y, z;
};
Place cell_at(const Cells& in, std::size_t p) {
  return {cell_of(in.x[p], in.inverse_cell), cell_of(in.y[p], in.inverse_cell),
          cell_of(in.z[p], in.inverse_cell)};
}

// As AMONG_MANY and level_weight in density.cl.
constexpr float kAmongMany = 0.3f;
float level_weight(float density, const Field& input) {
  const float t = std::clamp(2.25f * (density - 0.45f), 0.0f, 1.0f);
  const float share = std::min(kFieldNorm / density, 1.0f);
  const float raised = std::max(kAmongMany + (input.lone - kAmongMany) * share, 1.0f);
  return raised *
         (input.level / (input.level + (0.45f - input.level) * (t * t * (3.0f - 2.0f * t))));
}

// The places in [begin, end) of particles that are not inside the fluid.
std::size_t find_measured(const Field& input, std::size_t begin, std::size_t end,
                          std::size_t* place) {
  const Cells& in = input.cells;
  Place cell{std::numeric_limits<int>::min(), 0, 0};
  Slice before{}, here{}, after{};
  bool inside = false;
  std::size_t count = 0;
  for (std::size_t p = begin; p < end; ++p) {
    const auto [x, y, z] = cell_at(in, p);
    if (x != cell.x || y != cell.y || z != cell.z) {
      const bool next = x - 1 == cell.x && y == cell.y && z == cell.z;  // two slices are the same
      cell = {x, y, z};
      before = next ? here : slice_of(in, x - 1, y, z, input.least);
      here = next ? after : slice_of(in, x, y, z, input.least);
      after = slice_of(in, x + 1, y, z, input.least);
      const int fewest = std::min({before.fewest, here.fewest, after.fewest});
      inside = fewest >= input.least && 2 * 27 * fewest >= before.sum + here.sum + after.sum;
    }
    place[count] = p;
    count += inside ? 0 : 1;
    for (std::size_t row = 0; inside && row < 4; ++row)
      input.result[row * input.count + p] = row < 3 ? 0.0f : 1.0f;
    if (inside) input.weight[p] = level_weight(1, input);
  }
  return count;
}

}  // namespace

void measure_gradients(const Field& input, std::size_t begin, std::size_t end) {
  const Cells& in = input.cells;
  AroundCells near;
  for (std::size_t block = begin; block < end; block += kBlock) {
    std::size_t place[kBlock];
    const std::size_t count = find_measured(input, block, std::min(block + kBlock, end), place);
    for (std::size_t a = 0; a < count;) {
      const Place own = cell_at(in, place[a]);
      // Lanes that are left repeat the first.
      Floats x = all(in.x[place[a]]), y = all(in.y[place[a]]), z = all(in.z[place[a]]);
      int lanes = 0, wide = 1;
      for (; lanes < kWidth && a + lanes < count; ++lanes) {
        const std::size_t p = place[a + lanes];
        const Place cell = cell_at(in, p);
        if (cell.x < own.x || cell.x >= own.x + kSpan || cell.y != own.y || cell.z != own.z) break;
        wide = cell.x - own.x + 1;
        x[lanes] = in.x[p];
        y[lanes] = in.y[p];
        z[lanes] = in.z[p];
      }
      near.gather(in, own.x, own.y, own.z, wide, x, y, z);
      FieldAt field;
      for (int p = 0; p < near.count; ++p)
        add_particle<true>(field, x - near.x[p], y - near.y[p], z - near.z[p], 1.0f);
      const Floats rows[4] = {gradient_of(field.gx), gradient_of(field.gy), gradient_of(field.gz),
                              near.whole() ? field.c * kFieldNorm : all(-1.0f)};
      for (std::size_t row = 0; row < 4; ++row)
        for (int k = 0; k < lanes; ++k)
          input.result[row * input.count + place[a + k]] = rows[row][k];
      for (int k = 0; k < lanes; ++k) input.weight[place[a + k]] = level_weight(rows[3][k], input);
      a += static_cast<std::size_t>(lanes);
    }
  }
}

}  // namespace meniscus::bench::native
