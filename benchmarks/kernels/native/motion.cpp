#include <limits>

#include "kernels/native/cells.hpp"
#include "kernels/native/samples.hpp"

namespace meniscus::bench::native {
namespace {

constexpr float kSupport = 4.0f, kFar = 3.0f, kApart = 2.0f;
constexpr float kNowhere = std::numeric_limits<float>::infinity();
constexpr int kRows = 8, kFound = 64;

// The samples of a bin, a row in each vector.
struct Points {
  Floats x[kRows], y[kRows], z[kRows];
  Ints left[kRows];  // those without a result so far
  Ints here[kRows];  // those that search together now
  Floats near[kRows], weight[kRows], vx[kRows], vy[kRows], vz[kRows];  // sums over particles
  Floats mx[kRows], my[kRows], mz[kRows];                              // results
};

// Particles that are found before they are added.
struct Found {
  int count = 0;
  float x[kFound + 16], y[kFound + 16], z[kFound + 16];
  float vx[kFound + 16], vy[kFound + 16], vz[kFound + 16];
};

inline void add_found(Found& found, Points& points) {
  for (int r = 0; r < kRows; ++r) {
    if (!any(points.here[r])) continue;
    const Floats x = points.x[r], y = points.y[r], z = points.z[r];
    Floats near = points.near[r], weight = points.weight[r];
    Floats vx = points.vx[r], vy = points.vy[r], vz = points.vz[r];
    for (int k = 0; k < found.count; ++k) {
      const Floats dx = x - found.x[k], dy = y - found.y[k], dz = z - found.z[k];
      const Floats inner =
          larger(1.0f - (dx * dx + dy * dy + dz * dz) * (1.0f / (kSupport * kSupport)), Floats{});
      const Floats w = (inner * inner) * (inner * inner);
      near = larger(near, inner);
      weight += w;
      vx = fused(w, all(found.vx[k]), vx);
      vy = fused(w, all(found.vy[k]), vy);
      vz = fused(w, all(found.vz[k]), vz);
    }
    points.near[r] = near;
    points.weight[r] = weight;
    points.vx[r] = vx;
    points.vy[r] = vy;
    points.vz[r] = vz;
  }
  found.count = 0;
}

// The square of how far a coordinate lies outside cell i.
inline float outside(float coordinate, int i, float side) {
  const float below = static_cast<float>(i) * side - coordinate, above = -below - side;
  const float apart = below > 0.0f ? below : above > 0.0f ? above : 0.0f;
  return apart * apart;
}

// From the least to the greatest of some coordinates.
struct Extent {
  Floats low = all(kNowhere), high = all(-kNowhere);
  void add(const Floats& x, const Ints& counts) {
    low = counts ? smaller(low, x) : low;
    high = counts ? larger(high, x) : high;
  }
  float middle() const { return 0.5f * (most_lane(high) - most_lane(-low)); }
  float half() const { return 0.5f * (most_lane(high) + most_lane(-low)); }
};

// The sums at the points near the first one that is left; others get anything.
void sum_around(const Motion& in, int first, Points& points) {
  const Cells& cells = in.cells;
  const float x0 = points.x[first / 8][first % 8], y0 = points.y[first / 8][first % 8],
              z0 = points.z[first / 8][first % 8];
  Extent ex, ey, ez;
  for (int r = 0; r < kRows; ++r) {
    const Floats x = points.x[r], y = points.y[r], z = points.z[r];
    const Ints here = points.left[r] & (magnitude(x - x0) <= kApart) &
                      (magnitude(y - y0) <= kApart) & (magnitude(z - z0) <= kApart);
    points.here[r] = here;
    points.near[r] = points.weight[r] = points.vx[r] = points.vy[r] = points.vz[r] = Floats{};
    ex.add(x, here);
    ey.add(y, here);
    ez.add(z, here);
  }
  const float mx = ex.middle(), my = ey.middle(), mz = ez.middle();
  const float wide =
      std::sqrt(ex.half() * ex.half() + ey.half() * ey.half() + ez.half() * ez.half());
  const float reach = kSupport + wide + 0.01f, squared = reach * reach;
  const float c = cells.inverse_cell, side = 1.0f / c;
  const int j0 = cell_of(my - reach, c), j1 = cell_of(my + reach, c);
  const int k0 = cell_of(mz - reach, c), k1 = cell_of(mz + reach, c);
  Found found;
  for (int k = k0; k <= k1; ++k)
    for (int j = j0; j <= j1; ++j) {
      const float rest = squared - outside(mz, k, side) - outside(my, j, side);
      if (rest < 0.0f) continue;
      const float half_row = std::sqrt(rest);
      const int i1 = cell_of(mx + half_row, c);
      for (int i = cell_of(mx - half_row, c); i <= i1; ++i) {
        const Bucket bucket = bucket_of(cells, i, j, k);
        for (int p = bucket.begin; p < bucket.end; p += 8) {
          const Floats x = load(cells.x + p), y = load(cells.y + p), z = load(cells.z + p);
          const Floats dx = x - mx, dy = y - my, dz = z - mz;
          const unsigned take =
              bits_of((dx * dx + dy * dy + dz * dz <= squared) &
                      (load(cells.tag + p) == bucket.tag) & (kPlaces < bucket.end - p));
          if (!take) continue;
          pack(take, x, found.x + found.count);
          pack(take, y, found.y + found.count);
          pack(take, z, found.z + found.count);
          pack(take, load(in.velocity + p), found.vx + found.count);
          pack(take, load(in.velocity + in.count + p), found.vy + found.count);
          pack(take, load(in.velocity + 2 * in.count + p), found.vz + found.count);
          found.count += __builtin_popcount(take);
          if (found.count >= kFound) add_found(found, points);
        }
      }
    }
  add_found(found, points);
}

// The mean velocity at the points that are left, infinity where no particle is near.
void find_motion(const Motion& in, Points& points) {
  for (int first = 0; first < 8 * kRows; ++first) {
    if (!points.left[first / 8][first % 8]) continue;
    sum_around(in, first, points);
    for (int r = 0; r < kRows; ++r) {
      const Ints here = points.here[r];
      const Ints met = points.near[r] >= 1.0f - kFar * kFar / (kSupport * kSupport);
      const Floats share = 1.0f / (met ? points.weight[r] : all(1.0f)), far = all(kNowhere);
      points.mx[r] = here ? met ? points.vx[r] * share : far : points.mx[r];
      points.my[r] = here ? met ? points.vy[r] * share : far : points.my[r];
      points.mz[r] = here ? met ? points.vz[r] * share : far : points.mz[r];
      points.left[r] &= ~here;
    }
  }
}

}  // namespace

void motion_of_samples(const Motion& in, std::size_t begin, std::size_t end) {
  const int bins_x = (in.nx + 7) / 8;
  const std::ptrdiff_t size = std::ptrdiff_t{in.nx} * in.ny;
  for (std::size_t bin = begin; bin < end; ++bin) {
    const int i = static_cast<int>(bin) % bins_x * 8, j = static_cast<int>(bin) / bins_x * 8;
    const int columns = in.nx - i < 8 ? in.nx - i : 8, rows = in.ny - j < 8 ? in.ny - j : 8;
    Points points;
    Ints there{};
    for (int r = 0; r < kRows; ++r) {
      Floats t = all(kNowhere);
      if (r < rows) {
        const float* const from = in.depth + std::ptrdiff_t{j + r} * in.nx + i;
        t = kPlaces < columns ? load(from) : t;
      }
      there |= points.left[r] = t < kNowhere;
      const Rays ray = rays_at(in.ray, in.first + in.step * (static_cast<float>(i) + kLanes),
                               all(in.first + in.step * static_cast<float>(j + r)));
      points.x[r] = ray.ox + t * ray.dx;
      points.y[r] = ray.oy + t * ray.dy;
      points.z[r] = -t;
      points.mx[r] = points.my[r] = points.mz[r] = Floats{};
    }
    if (!any(there)) continue;
    find_motion(in, points);
    for (int r = 0; r < rows; ++r) {
      float* const to = in.motion + std::ptrdiff_t{j + r} * in.nx + i;
      store_first(points.mx[r], to, columns);
      store_first(points.my[r], to + size, columns);
      store_first(points.mz[r], to + 2 * size, columns);
    }
  }
}

}  // namespace meniscus::bench::native
