#include "kernels/native/cells.hpp"
#include "kernels/native/lanes.hpp"

namespace meniscus::bench::native {
namespace {

// The particles of a cell and its 26 neighbours, in the order in which sums take them, without
// those of other cells that share their buckets. Particles of one cell lie in a row, so that the
// list serves one after the other.
struct Near {
  static constexpr int kMost = 4096;
  float x[kMost], y[kMost], z[kMost];
  int count = 0;
  bool whole = true;  // it holds all of them
};

void gather(const Cells& in, int cx, int cy, int cz, Near& near) {
  near.count = 0;
  near.whole = true;
  for (int k = -1; k <= 1; ++k)
    for (int j = -1; j <= 1; ++j)
      for (int i = -1; i <= 1; ++i) {
        const Bucket bucket = bucket_of(in, cx + i, cy + j, cz + k);
        for (int p = bucket.begin; p < bucket.end; ++p) {
          if (in.tag[p] != bucket.tag) continue;
          if (near.count == Near::kMost) {
            near.whole = false;
            return;
          }
          near.x[near.count] = in.x[p];
          near.y[near.count] = in.y[p];
          near.z[near.count] = in.z[p];
          ++near.count;
        }
      }
}

}  // namespace

void measure_gradients(const Field& input, std::size_t begin, std::size_t end) {
  const Cells& in = input.cells;
  Near near;
  int cx = 0, cy = 0, cz = 0;
  bool gathered = false;
  for (std::size_t a = begin; a < end;) {
    const int own_x = cell_of(in.x[a], in.inverse_cell), own_y = cell_of(in.y[a], in.inverse_cell),
              own_z = cell_of(in.z[a], in.inverse_cell);
    if (!gathered || own_x != cx || own_y != cy || own_z != cz) {
      cx = own_x;
      cy = own_y;
      cz = own_z;
      gather(in, cx, cy, cz, near);
      gathered = true;
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
    Floats gx{}, gy{}, gz{}, c{};
    for (int p = 0; p < near.count; ++p) {
      const Floats dx = x - near.x[p], dy = y - near.y[p], dz = z - near.z[p];
      const Floats squared = fused(dx, dx, fused(dy, dy, dz * dz)) * 0.25f;
      // One out of reach adds a zero, which leaves a sum as it is.
      const Floats q = root(squared), r = larger(2.0f - q, Floats{});
      const Ints core = q < 1.0f;
      c += core ? fused(0.75f * squared, q, fused(all(-1.5f), squared, all(1.0f)))
                : 0.25f * r * r * r;
      const Floats slope =
          core ? fused(all(2.25f), q, all(-3.0f)) : -0.75f * r * r / (core ? all(1.0f) : q);
      gx += slope * dx;
      gy += slope * dy;
      gz += slope * dz;
    }
    constexpr float kNorm = 0.318309886f;
    const Floats rows[4] = {gx * (0.25f * kNorm), gy * (0.25f * kNorm), gz * (0.25f * kNorm),
                            near.whole ? c * kNorm : all(-1.0f)};
    for (std::size_t row = 0; row < 4; ++row)
      for (int k = 0; k < lanes; ++k) input.result[row * input.count + a + k] = rows[row][k];
    a += static_cast<std::size_t>(lanes);
  }
}

}  // namespace meniscus::bench::native
