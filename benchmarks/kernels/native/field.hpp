// The density field along rays, as field.cl has it: one search of the cells for up to 64 rays, of
// which kWidth take what is near them. Everything has internal linkage.
#pragma once

#include <algorithm>
#include <limits>

#include "kernels/native/cells.hpp"
#include "kernels/native/samples.hpp"

namespace meniscus::bench::native {
namespace {

constexpr float kFieldNorm = 0.318309886f, kSupport = 4.0f, kDeepest = 24.0f;
constexpr float kW0 = 0.243067f / 4096, kW1 = 0.456322f / 65536, kW2 = -0.842290f / 1048576,
                kW3 = 1.142901f / 16777216;
constexpr int kVectors = kWidth == 16 ? 4 : 6, kRowCells = 32, kMostNear = 384;

/// pi C and a quarter of its gradient, see field.cl.
struct FieldAt {
  Floats c{}, gx{}, gy{}, gz{};
};

template <bool WithGradient>
[[gnu::always_inline]] inline void add_share(FieldAt& sum, const Floats& v, const Floats& dx,
                                             const Floats& dy, const Floats& dz, float weight) {
  const Floats vv = weight * (v * v);
  const Floats share = fused(fused(fused(all(kW3), v, all(kW2)), v, all(kW1)), v, all(kW0));
  sum.c = fused(share, vv * v, sum.c);
  if (!WithGradient) return;
  const Floats g = fused(fused(fused(all(-3.0f * kW3), v, all(-2.5f * kW2)), v, all(-2.0f * kW1)),
                         v, all(-1.5f * kW0)) *
                   vv;
  sum.gx = fused(g, dx, sum.gx);
  sum.gy = fused(g, dy, sum.gy);
  sum.gz = fused(g, dz, sum.gz);
}

/// As gradient_of in field.cl; here a zero is always 0.
inline Floats gradient_of(const Floats& sum) { return sum * (4.0f * kFieldNorm); }

/// Rays by their length, and a particle's share along them, see field.cl.
struct Lines {
  Rays r;
  Floats deep, length, ex, ey;
  explicit Lines(const Rays& rays) : r(rays) {
    length = root(r.dx * r.dx + r.dy * r.dy + 1.0f);
    deep = 1.0f / length;
    ex = deep * r.dx;
    ey = deep * r.dy;
  }
};
struct Parabola {
  Floats at, most;
};
[[gnu::always_inline]] inline Parabola parabola_of(const Lines& line, float px, float py,
                                                   float pz) {
  const Floats t = all(-pz);
  const Floats x = fused(t, line.r.dx, line.r.ox) - px, y = fused(t, line.r.dy, line.r.oy) - py;
  const Floats along = fused(x, line.ex, y * line.ey), apart = fused(x, x, y * y);
  return {fused(all(pz), line.length, along), fused(along, along, kSupport * kSupport - apart)};
}

/// Points of rays.
struct Stops {
  Floats l, x, y, z;
  Stops(const Lines& line, const Floats& at) : l(at) {
    const Floats t = line.deep * l;
    x = line.r.ox + t * line.r.dx;
    y = line.r.oy + t * line.r.dy;
    z = -t;
  }
};
template <bool WithGradient>
[[gnu::always_inline]] inline void add_on_lines(FieldAt& sum, const Stops& s, const Parabola& to,
                                                const Cells& cells, const float* weight, int p) {
  const Floats u = s.l + to.at, v = larger(fused(-u, u, to.most), Floats{});
  add_share<WithGradient>(sum, v, s.x - cells.x[p], s.y - cells.y[p], s.z - cells.z[p], weight[p]);
}

/// The field at points that no list is near, cell by cell.
template <bool WithGradient>
FieldAt field_at(const Cells& cells, const float* weight, const Lines& line, const Floats& l) {
  const Stops s(line, l);
  FieldAt field;
  for (unsigned left = (1u << kWidth) - 1; left;) {
    const int first = __builtin_ctz(left);
    const auto cell = [&](int lane, const Floats& p) {
      return cell_of(p[lane], cells.inverse_cell);
    };
    const int cx = cell(first, s.x), cy = cell(first, s.y), cz = cell(first, s.z);
    Ints here{};
    for (int lane = first; lane < kWidth; ++lane)
      if (cell(lane, s.x) == cx && cell(lane, s.y) == cy && cell(lane, s.z) == cz) here[lane] = -1;
    left &= ~bits_of(here);
    FieldAt sum;
    for (int k = cz - 1; k <= cz + 1; ++k)
      for (int j = cy - 1; j <= cy + 1; ++j) {
        const std::int32_t tag = bucket_of(cells, cx, j, k).tag;
        visit_row(cells, cx - 1, j, k, 3, [&](int row_begin, int row_end) {
          for (int p = row_begin; p < row_end; ++p)
            if (same_row(cells.tag[p], tag))
              add_on_lines<WithGradient>(
                  sum, s, parabola_of(line, cells.x[p], cells.y[p], cells.z[p]), cells, weight, p);
        });
      }
    field.c = here ? sum.c : field.c;
    field.gx = here ? sum.gx : field.gx;
    field.gy = here ? sum.gy : field.gy;
    field.gz = here ? sum.gz : field.gz;
  }
  return field;
}

/// Particles near rays or points, in the order in which sums take them.
template <int Most>
struct Listed {
  int count;  // more than Most: not all are there
  std::int32_t item[Most + 16];

  bool whole() const { return count <= Most; }
  /// Appends the lanes that are set in `bits`.
  void add(unsigned bits, const Ints& items) {
    pack(bits, items, item + count);
    count += __builtin_popcount(bits);
  }
};

/// An axis, and how far from it particles reach a ray.
struct Axis {
  float x, y, z, ex, ey, ez, per_length, reach;
};

inline Axis axis_of(const Rays* rays, const Ints* wanted, int vectors, float low, float high) {
  Floats ax{}, ay{}, bx{}, by{}, lanes{};
  for (int v = 0; v < vectors; ++v) {
    const Rays& r = rays[v];
    ax += wanted[v] ? r.ox + low * r.dx : Floats{};
    ay += wanted[v] ? r.oy + low * r.dy : Floats{};
    bx += wanted[v] ? r.ox + high * r.dx : Floats{};
    by += wanted[v] ? r.oy + high * r.dy : Floats{};
    lanes += wanted[v] ? all(1.0f) : Floats{};
  }
  const float share = 1.0f / sum_of(lanes);
  const float x0 = share * sum_of(ax), y0 = share * sum_of(ay), x1 = share * sum_of(bx),
              y1 = share * sum_of(by);
  Floats wide{};
  for (int v = 0; v < vectors; ++v) {
    const Rays& r = rays[v];
    const Floats px = r.ox + low * r.dx - x0, py = r.oy + low * r.dy - y0,
                 qx = r.ox + high * r.dx - x1, qy = r.oy + high * r.dy - y1;
    const Floats apart = larger(px * px + py * py, qx * qx + qy * qy);
    wide = larger(wide, wanted[v] ? apart : Floats{});
  }
  Axis b = {x0, y0, -low, x1 - x0, y1 - y0, low - high, 0, 0};
  const float squared = b.ex * b.ex + b.ey * b.ey + b.ez * b.ez;
  b.per_length = 1.0f / (squared > 1e-12f ? squared : 1e-12f);
  b.reach = kSupport + std::sqrt(most_lane(wide)) + 0.01f;
  return b;
}

inline Ints near_axis(const Axis& b, const Floats& x, const Floats& y, const Floats& z,
                      float reach) {
  const Floats dx = x - b.x, dy = y - b.y, dz = z - b.z;
  const Floats along = fused(dx, all(b.ex), fused(dy, all(b.ey), dz * b.ez));
  const Floats s = -smaller(larger(along * b.per_length, Floats{}), all(1.0f));
  const Floats qx = fused(s, all(b.ex), dx), qy = fused(s, all(b.ey), dy),
               qz = fused(s, all(b.ez), dz);
  return fused(qx, qx, fused(qy, qy, qz * qz)) <= reach * reach;
}

template <int Most>
void search_cells(const Cells& cells, const Axis& b, Listed<Most>& found) {
  const float c = cells.inverse_cell, side = 1.0f / c, last = b.z + b.ez;
  const float rise = b.reach * std::sqrt((b.ex * b.ex + b.ey * b.ey) * b.per_length);
  const float per_depth = 1.0f / std::fmax(-b.ez, 1e-6f);
  const auto clamped = [](float s) { return std::fmin(std::fmax(s, 0.0f), 1.0f); };
  found.count = 0;
  for (int k = cell_of(last - b.reach, c), k1 = cell_of(b.z + b.reach, c); k <= k1; ++k) {
    const float z0 = static_cast<float>(k) * side, z1 = z0 + side;
    const float from = clamped((b.z - z1 - rise) * per_depth);
    const float to = clamped((b.z - z0 + rise) * per_depth);
    const auto [x0, x1] = std::minmax({b.x + from * b.ex, b.x + to * b.ex});
    const auto [y0, y1] = std::minmax({b.y + from * b.ey, b.y + to * b.ey});
    const float dz = std::fmax(std::fmax(z0 - b.z, last - z1), 0.0f);
    const float wide = std::sqrt(std::fmax(b.reach * b.reach - dz * dz, 0.0f));
    for (int j = cell_of(y0 - wide, c), j1 = cell_of(y1 + wide, c); j <= j1; ++j) {
      const float dy = std::fmax(
          std::fmax(static_cast<float>(j) * side - y1, y0 - static_cast<float>(j + 1) * side),
          0.0f);
      const float half_row = std::sqrt(std::fmax(wide * wide - dy * dy, 0.0f));
      const int i0 = cell_of(x0 - half_row, c), i1 = cell_of(x1 + half_row, c);
      for (int i = i0; i <= i1; i += kRowCells) {
        const int count = std::min(i1 - i + 1, kRowCells);
        const std::int32_t tag = bucket_of(cells, i, j, k).tag;
        visit_row(cells, i, j, k, count, [&](int begin, int end) {
          for (int p = begin; p < end && found.whole(); p += kWidth) {
            const Floats px = load(cells.x + p), py = load(cells.y + p), pz = load(cells.z + p);
            const Ints tags = load(cells.tag + p);
            const unsigned take =
                bits_of(near_axis(b, px, py, pz, b.reach) & (((tags ^ tag) & ~2047) == 0) &
                        (((tags - tag) & 2047) < count) & (kPlaces < end - p));
            if (take) found.add(take, p + kPlaces);
          }
        });
        if (!found.whole()) return;
      }
    }
  }
}

/// Rays that share a search, between the depths that any lane asks for.
struct Around {
  int vectors = 0;
  Rays rays[kVectors];
  Ints wanted[kVectors];
  Floats from, to;
  float low, high;
  bool searched = false;
  Listed<kMostNear> found;
};

/// What is near rays between two lengths of them.
struct Near : Listed<kMostNear> {
  Parabola parabola[kMostNear];
};

/// Lanes will ask for what is near between these depths, where wanted.
inline void need_between(const Floats& from, const Floats& to, const Ints& wanted, Around& around) {
  around.from = wanted ? smaller(around.from, from) : around.from;
  around.to = wanted ? larger(around.to, to) : around.to;
}

inline void look_around(const Cells& cells, Around& around) {
  around.low = -most_lane(-around.from);
  around.high = most_lane(around.to);
  for (int again = 0; again < 2; ++again) {
    search_cells(cells,
                 axis_of(around.rays, around.wanted, around.vectors, around.low, around.high),
                 around.found);
    if (around.found.whole() || around.high <= around.low + kDeepest) break;
    around.high = around.low + kDeepest;
  }
  around.searched = true;
}

/// Lists the particles within the support of a wanted ray between two lengths of it.
inline void list_near(const Cells& cells, Around& around, const Lines& line, const Ints& wanted,
                      const Floats& from, const Floats& to, Near& near) {
  constexpr float kFar = std::numeric_limits<float>::infinity(), kRoom = 0.005f;
  const float low = -most_lane(wanted ? -(line.deep * from) : all(-kFar));
  const float high = most_lane(wanted ? line.deep * to : all(-kFar));
  if (!around.searched) look_around(cells, around);
  const Listed<kMostNear>* found = &around.found;
  if (!found->whole() || low < around.low - kRoom || high > around.high + kRoom) {
    search_cells(cells, axis_of(&line.r, &wanted, 1, low, high), near);
    found = &near;
    if (!near.whole()) return;
  }
  const Floats middle = 0.5f * (from + to), extent = wanted ? 0.5f * (to - from) : all(-kFar);
  int count = 0;
  const float depths = kSupport + 0.01f;
  int begin = 0, end = found->count;
  while (begin < end && -cells.z[found->item[begin]] > high + depths) ++begin;
  while (begin < end && -cells.z[found->item[end - 1]] < low - depths) --end;
  for (int k = begin; k < end; ++k) {
    const int p = found->item[k];
    const Parabola to_it = parabola_of(line, cells.x[p], cells.y[p], cells.z[p]);
    const Floats beyond = larger(magnitude(middle + to_it.at) - extent, Floats{});
    near.item[count] = p;
    near.parabola[count] = to_it;
    count += any(fused(-beyond, beyond, to_it.most) > -0.016f);
  }
  near.count = count;
}

/// The field at points of rays between these lengths.
template <bool WithGradient>
[[gnu::always_inline]] inline FieldAt field_near(const Cells& cells, const float* weight,
                                                 const Near& near, const Lines& line,
                                                 const Floats& l) {
  if (!near.whole()) return field_at<WithGradient>(cells, weight, line, l);
  const Stops s(line, l);
  FieldAt field;
  for (int k = 0; k < near.count; ++k)
    add_on_lines<WithGradient>(field, s, near.parabola[k], cells, weight, near.item[k]);
  return field;
}

}  // namespace
}  // namespace meniscus::bench::native
