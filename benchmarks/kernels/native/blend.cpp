#define MENISCUS_WIDE
#include <limits>

#include "kernels/native/samples.hpp"

namespace meniscus::bench::native {
namespace {

constexpr int kRecord = 16;  // FIT of records.h
constexpr int kCached = 48;
constexpr int kBlock = 128;  // fits of a list that are met before they are weighed
constexpr float kPull = 0.75f, kRoundPull = -0.2f, kRoundest = 0.9f;  // of hits.cl
constexpr float kGraze = 0.3f, kOver = 0.06f, kSurelyOver = 0.8f, kWithin = -0.05f, kSteep = 0.5f,
                kVouching = 1e-3f, kVouchingSure = 3e-4f, kCredible = 0.05f, kMeeting = 0.1f,
                kLeastBend = 0.02f;
constexpr float kNowhere = std::numeric_limits<float>::infinity(), kTiny = 1e-30f;

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
inline unsigned find_near(const List& list, int k, const Beam& b) {
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

inline unsigned near_box(const List& list, int k, const Box& b) {
  const Floats x = list.row(0, k), y = list.row(1, k), z = list.row(2, k);
  const Floats reach = 1.01f * list.row(3, k);
  const Floats dx = larger(larger(b.x0 - x, x - b.x1), Floats{});
  const Floats dy = larger(larger(b.y0 - y, y - b.y1), Floats{});
  const Floats dz = larger(larger(b.z0 - z, z - b.z1), Floats{});
  return bits_of((dx * dx + dy * dy + dz * dz < reach * reach) & (kPlaces < list.count - k));
}

struct Sheet {
  Floats w{}, t{}, cx{}, cy{}, cz{}, nx{}, ny{}, nz{}, vx{}, vy{}, vz{}, ux{}, uy{}, uz{};
};

[[gnu::always_inline]] inline void add_hit(Sheet& sum, const float* foot, const Sample& s,
                                           const Hit& hit, const Floats& share) {
  const Floats w = share * hit.weight;
  sum.w += w;
  sum.t = fused(w, hit.tau, sum.t);
  sum.cx = fused(w, all(foot[0]), sum.cx);
  sum.cy = fused(w, all(foot[1]), sum.cy);
  sum.cz = fused(w, all(foot[2]), sum.cz);
  sum.nx = fused(w, hit.gx, sum.nx);
  sum.ny = fused(w, hit.gy, sum.ny);
  sum.nz = fused(w, hit.gz, sum.nz);
  const Floats v = share * hit.pull, u = v * hit.tau;
  const Floats px = fused(hit.tau, s.dx, s.sx - foot[0]), py = fused(hit.tau, s.dy, s.sy - foot[1]),
               pz = -s.t - foot[2] - hit.tau;
  sum.vx = fused(v, px, sum.vx);
  sum.vy = fused(v, py, sum.vy);
  sum.vz = fused(v, pz, sum.vz);
  sum.ux = fused(u, px, sum.ux);
  sum.uy = fused(u, py, sum.uy);
  sum.uz = fused(u, pz, sum.uz);
}

inline Floats inverse_root(const Floats& squared, float least) {
  return 1.0f / root(larger(squared, all(least)));
}

struct Blended {
  Floats depth = all(kNowhere), nx{}, ny{}, nz{}, trust{};
  Ints group = Ints{} - 1;
};

// A sheet's depth behind the reference, the middle of its feet, and the direction of its gradients.
struct Middle {
  Floats z, cx, cy, cz, nx, ny, nz;
};

inline Middle middle_of(const Sheet& s) {
  const Floats v = 1.0f / larger(s.w, all(kTiny)),
               size = inverse_root(square_of(s.nx, s.ny, s.nz), kTiny);
  return {s.t * v, s.cx * v, s.cy * v, s.cz * v, s.nx * size, s.ny * size, s.nz * size};
}

inline Ints convex_between(const Middle& a, const Middle& b) {
  return dot_of(b.cx - a.cx, b.cy - a.cy, b.cz - a.cz, a.nx - b.nx, a.ny - b.ny, a.nz - b.nz) <
         0.0f;
}

inline Floats takes_over(const Floats& a, const Floats& b, const Ints& convex, const Floats& share,
                         float crease) {
  const Floats meeting = convex ? larger(a, b) : smaller(a, b);
  return (meeting == b) & (magnitude(a - b) <= crease) ? share : Floats{};
}

// How much of what a ray meets is of sheets B and C.
struct Shares {
  Floats b, c;
};

inline Shares shares_in_corner(const Middle& a, const Middle& b, const Middle& c,
                               const Floats& some_b, const Floats& some_c, const Ints& only_b,
                               float crease) {
  const Floats one = all(1.0f);
  const Ints ab = convex_between(a, b), ac = convex_between(a, c), bc = convex_between(b, c);
  const auto b_on = [&](const Floats& depth, const Floats& other) {
    return only_b ? one : takes_over(depth, other, ab, some_b, crease);
  };
  const Floats b1 = b_on(a.z, b.z);
  const Floats c1 = takes_over(a.z + (b.z - a.z) * b1, c.z, ac, some_c, crease);
  const Floats c2 = takes_over(a.z, c.z, ac, some_c, crease);
  const Floats b2 = b_on(a.z + (c.z - a.z) * c2, b.z);
  const Floats c3 = takes_over(b.z, c.z, bc, some_c, crease);
  const Floats b3 = b_on(a.z, b.z + (c.z - b.z) * c3);
  const Ints odd_ac = (ab == bc) & (ab != ac), odd_bc = (ab == ac) & (ab != bc);
  return {odd_bc   ? b3 * (one - c3)
          : odd_ac ? b2
                   : b1 * (one - c1),
          odd_bc   ? b3 * c3
          : odd_ac ? c2 * (one - b2)
                   : c1};
}

inline void add_normal(const Sheet& s, const Floats& z, const Floats& share, Blended& out) {
  const Floats gx = s.nx + (z * s.vx - s.ux), gy = s.ny + (z * s.vy - s.uy),
               gz = s.nz + (z * s.vz - s.uz);
  const Floats scale = share / root(larger(square_of(gx, gy, gz), all(kTiny)));
  out.nx = fused(gx, scale, out.nx);
  out.ny = fused(gy, scale, out.ny);
  out.nz = fused(gz, scale, out.nz);
}

struct Listed {
  List met, rim;
};

// A fit at a point, and its weight where the fluid ends.
struct FaceValue {
  Floats f, gx, gy, gz, weight, per_slope;
};

// Returns whether any of the points is within the fit's reach.
[[gnu::always_inline]] inline bool face_at(const float* g, const float* foot, const Floats& x,
                                           const Floats& y, const Floats& z, FaceValue& face) {
  const Floats px = x - foot[0], py = y - foot[1], pz = z - foot[2];
  const Floats squared = square_of(px, py, pz) * g[10];
  if (!any(squared < 1.0f)) return false;
  gradient_at(g, px, py, pz, face.gx, face.gy, face.gz);
  const Floats slope = inverse_root(square_of(face.gx, face.gy, face.gz), 1e-20f);
  face.f = value_at(g, px, py, pz, face.gx, face.gy, face.gz) * slope;
  face.gx *= slope;
  face.gy *= slope;
  face.gz *= slope;
  const Floats q = larger(1.0f - squared, Floats{});
  face.per_slope = slope;
  face.weight = g[13] * q * q * q * larger(1.0f - 0.25f * face.f * face.f, Floats{});
  return true;
}

inline Floats steep_for(const Sample& s) {
  return -kSteep * root(square_of(s.dx, s.dy, all(1.0f)));
}

// Sums over round fits of the sheet that is shown, as far as they are steep to the ray or turn
// away.
struct Turning {
  Floats w{}, f{}, along{}, bend{};

  void add(const float* g, const Sample& s, const FaceValue& face, const Floats& slope,
           const Floats& weight) {
    w += weight;
    f = fused(weight, face.f, f);
    along = fused(weight, slope, along);
    bend = fused(weight, bend_along(g, s) * face.per_slope, bend);
  }
  // How high above their mean, and that of what the ray meets, the ray passes.
  Floats height_over(const Floats& met, const Floats& entering) const {
    const Floats per = 1.0f / larger(w + met, all(kTiny));
    const Floats mean = f * per, slope = (along + entering) * per;
    return mean - 0.25f * slope * slope / larger(bend * per, all(kLeastBend));
  }
};

inline Middle either_sheet(const Middle& a, const Middle& b, const Ints& first) {
  return {first ? a.z : b.z,   first ? a.cx : b.cx, first ? a.cy : b.cy, first ? a.cz : b.cz,
          first ? a.nx : b.nx, first ? a.ny : b.ny, first ? a.nz : b.nz};
}

Floats held_by(const Blend& in, const Sample& s, const List& rim, const Middle& near,
               const Middle& deep, const Floats& weights, const Ints& wanted) {
  const Floats none{}, steep = steep_for(s);
  const Floats x = s.sx + near.z * s.dx, y = s.sy + near.z * s.dy, z = -(s.t + near.z);
  const Box box = box_of(x, y, z, wanted);
  Floats within{}, beyond{};
  for (int k = 0; k < rim.count; k += kWidth)
    for (unsigned found = near_box(rim, k, box); found; found &= found - 1) {
      const std::ptrdiff_t fit = rim.fit[k + __builtin_ctz(found)];
      const float* const foot = in.feet + 4 * fit;
      FaceValue face;
      if (!face_at(in.records + kRecord * fit, foot, x, y, z, face)) continue;
      const auto along = [&](const Floats& vx, const Floats& vy, const Floats& vz) {
        return dot_of(face.gx, face.gy, face.gz, vx, vy, vz);
      };
      const Floats cosine =
          larger(along(near.nx, near.ny, near.nz), along(deep.nx, deep.ny, deep.nz));
      const Floats nx = foot[0] - near.cx, ny = foot[1] - near.cy, nz = foot[2] - near.cz;
      const Floats dx = foot[0] - deep.cx, dy = foot[1] - deep.cy, dz = foot[2] - deep.cz;
      const Ints convex =
          (dot_of(nx, ny, nz, near.nx, near.ny, near.nz) < 0.0f) & (along(nx, ny, nz) > 0.0f);
      const Ints concave =
          (dot_of(dx, dy, dz, deep.nx, deep.ny, deep.nz) > 0.0f) & (along(dx, dy, dz) < 0.0f);
      const Floats forward = fused(face.gx, s.dx, fused(face.gy, s.dy, -face.gz));
      const Floats weight = face.weight * (1.0f - smooth_step(in.same_low, in.same_high, cosine));
      const Floats holds = convex & concave & (forward > steep) ? weight : none;
      within += face.f > 0.0f ? none : holds;
      beyond += face.f > 0.0f ? holds : none;
    }
  const Floats share = smooth_step(0.0003f, 0.002f, within / larger(weights, all(kTiny)));
  return wanted & (within > beyond) ? share : none;
}

// The hits that are kept; others, from place `rest` of the list on, are found again.
struct Cache {
  Hit hit[kCached];
  std::int32_t fit[kCached];
  int kept = 0, rest;
};

// All that rays meet, but the hits themselves.
struct Met {
  Sheet sum;  // as if it were of one sheet
  Floats best{}, trust{}, firm{}, height{};
  Floats ax{}, ay{}, az{};  // the heaviest hit's gradient
  Ints group = Ints{} - 1;  // and its fit
};

// The samples of a blend, and the fits of their tile.
struct Blender {
  const Blend& in;
  const Sample& s;
  const Listed& listed;

  const float* fit_at(int fit) const { return in.records + std::ptrdiff_t{fit} * kRecord; }
  const float* foot_of(int fit) const { return in.feet + std::ptrdiff_t{fit} * 4; }
  Floats same(const Floats& cosine) const { return smooth_step(in.same_low, in.same_high, cosine); }

  // Calls visit(hit, record, foot) for all hits.
  template <class Visit>
  [[gnu::always_inline]] void each_hit(const Cache& cache, const Visit& visit) const {
    for (int k = 0; k < cache.kept; ++k)
      visit(cache.hit[k], fit_at(cache.fit[k]), foot_of(cache.fit[k]));
    for (int k = cache.rest; k < listed.met.count; ++k) {
      const int fit = listed.met.fit[k];
      const float *const g = fit_at(fit), *const foot = foot_of(fit);
      const Entry entry = entry_of(g, foot, s, in.d_max);
      Hit hit;
      if (!entry.counts() || !weigh(g, foot, s, in.d_max, entry, hit)) continue;
      fade(entry, hit);
      visit(hit, g, foot);
    }
  }
};

[[gnu::always_inline]] inline void add_met(const Blender& by, int place, const Entry& entry,
                                           Cache& cache, Met& met) {
  const int fit = by.listed.met.fit[place];
  const float *const g = by.fit_at(fit), *const foot = by.foot_of(fit);
  Hit hit;
  if (!weigh(g, foot, by.s, by.in.d_max, entry, hit)) return;
  met.firm = fused(hit.weight, all(g[14]), met.firm);
  fade(entry, hit);
  if (cache.kept < kCached) {
    cache.hit[cache.kept] = hit;
    cache.fit[cache.kept++] = fit;
  } else if (cache.rest == by.listed.met.count) {
    cache.rest = place;
  }
  const Ints better = hit.weight > met.best;
  met.best = better ? hit.weight : met.best;
  met.group = better ? Ints{} + fit : met.group;
  met.ax = better ? hit.gx : met.ax;
  met.ay = better ? hit.gy : met.ay;
  met.az = better ? hit.gz : met.az;
  met.trust = fused(hit.weight, all(g[12]), met.trust);
  met.height = fused(hit.weight, entry.height, met.height);
  add_hit(met.sum, foot, by.s, hit, all(1.0f));
}

// Half of the fits near the beam are met beyond their reach, and which could not be foreseen: first
// all that rays meet, without a branch, then the weights of those that count.
[[gnu::always_inline]] inline void meet_all(const Blender& by, Cache& cache, Met& met) {
  const List& list = by.listed.met;
  const Beam beam = beam_of(by.s);
  cache.rest = list.count;
  for (int from = 0; from < list.count; from += kBlock) {
    const int to = from + kBlock < list.count ? from + kBlock : list.count;
    std::int32_t place[kBlock + kWidth];  // in the list
    Entry entry[kBlock];
    int near = 0, count = 0;
    for (int k = from; k < to; k += kWidth) {
      const unsigned bits = find_near(list, k, beam);
      pack(bits, k + kPlaces, place + near);
      near += __builtin_popcount(bits);
    }
    for (int n = 0; n < near; ++n) {
      const std::int32_t at = place[n], fit = list.fit[at];  // before `count` is waited for
      place[count] = at;
      entry[count] = entry_of(by.fit_at(fit), by.foot_of(fit), by.s, by.in.d_max);
      count += entry[count].counts();
    }
    for (int n = 0; n < count; ++n) add_met(by, place[n], entry[n], cache, met);
  }
}

// A sheet's gradient.
struct Axis {
  Floats x{}, y{}, z{};

  // How far a hit's gradient agrees with it; round fits agree by so much more.
  Floats alike(const Hit& hit, const float* g) const {
    return g[15] + dot_of(hit.gx, hit.gy, hit.gz, x, y, z);
  }
  void add(const Hit& hit, const Floats& weight) {
    x = fused(weight, hit.gx, x);
    y = fused(weight, hit.gy, y);
    z = fused(weight, hit.gz, z);
  }
  void take(const Hit& hit, const Ints& better) {
    x = better ? hit.gx : x;
    y = better ? hit.gy : y;
    z = better ? hit.gz : z;
  }
  // Takes the direction of a sum of gradients.
  void turn_to(const Axis& sum) {
    const Floats size = square_of(sum.x, sum.y, sum.z), scale = inverse_root(size, kTiny);
    x = size > kTiny ? sum.x * scale : x;
    y = size > kTiny ? sum.y * scale : y;
    z = size > kTiny ? sum.z * scale : z;
  }
};

// What rays meet in one sheet, in two, or in three.
struct Sheets {
  Sheet A, B, C;
  bool one = false;  // all is of A
  Floats third{};    // how far there is C
};

// Two rounds of mean shift. Returns whether all hits are of the sheet around the axis.
[[gnu::always_inline]] inline bool find_axis(const Blender& by, const Cache& cache, const Met& met,
                                             Axis& axis) {
  bool one_sheet = cache.rest == by.listed.met.count;
  for (int round = 0; round < 2; ++round) {
    if (one_sheet) {
      Floats least = all(1.0f);
      for (int k = 0; k < cache.kept; ++k) {
        const Floats agrees = axis.alike(cache.hit[k], by.fit_at(cache.fit[k]));
        least = smaller(least, cache.hit[k].weight > 0.0f ? agrees : all(1.0f));
      }
      one_sheet = !any(by.same(least) < 1.0f);
    }
    Axis sum{met.sum.nx, met.sum.ny, met.sum.nz};
    if (!one_sheet) {
      sum = {};
      by.each_hit(cache, [&](const Hit& hit, const float* g, const float*) {
        sum.add(hit, hit.weight * by.same(axis.alike(hit, g)));
      });
    }
    axis.turn_to(sum);
  }
  return one_sheet;
}

// Sheet A lies around the axis. Where what is not of A faces two ways, it makes sheets B and C.
[[gnu::always_inline]] inline void split(const Blender& by, const Cache& cache, const Axis& axis,
                                         Sheets& sheets) {
  Sheet &A = sheets.A, &B = sheets.B, &C = sheets.C;
  A = Sheet{};
  Axis other;
  Floats most{};
  by.each_hit(cache, [&](const Hit& hit, const float* g, const float* foot) {
    const Floats share = by.same(axis.alike(hit, g)), left = (1.0f - share) * hit.weight;
    add_hit(A, foot, by.s, hit, share);
    add_hit(B, foot, by.s, hit, 1.0f - share);
    const Ints better = left > most;
    most = better ? left : most;
    other.take(hit, better);
  });
  const Floats length = root(square_of(B.nx, B.ny, B.nz)) / larger(B.w, all(kTiny));
  const Floats third = (1.0f - smooth_step(0.95f, 0.98f, length)) *
                       smooth_step(0.003f, 0.02f, B.w / larger(A.w + B.w, all(kTiny)));
  sheets.third = third;
  if (!any(third > 0.0f)) return;
  Axis sum;
  by.each_hit(cache, [&](const Hit& hit, const float* g, const float*) {
    const Floats rest = 1.0f - by.same(axis.alike(hit, g));
    sum.add(hit, rest * hit.weight * by.same(other.alike(hit, g)));
  });
  other.turn_to(sum);
  B = Sheet{};
  by.each_hit(cache, [&](const Hit& hit, const float* g, const float* foot) {
    const Floats rest = 1.0f - by.same(axis.alike(hit, g));
    const Floats of_c = third * (1.0f - by.same(other.alike(hit, g)));
    add_hit(B, foot, by.s, hit, rest * (1.0f - of_c));
    add_hit(C, foot, by.s, hit, rest * of_c);
  });
}

[[gnu::always_inline]] inline Sheets sheets_of(const Blender& by, const Cache& cache,
                                               const Met& met) {
  Sheets sheets;
  sheets.A = met.sum;
  Axis axis{met.ax, met.ay, met.az};
  sheets.one = find_axis(by, cache, met, axis);
  if (!sheets.one) split(by, cache, axis, sheets);
  return sheets;
}

// The middles of the sheets, and what of them is shown.
struct Meeting {
  Middle a, b, c;
  Floats weights;
  Shares shares{};
  Ints edge{};  // convex
};

// Two sheets or three meet.
[[gnu::always_inline]] inline void share_out(const Blender& by, const Sheets& sheets, Meeting& m) {
  const float crease = by.in.crease;
  const Sheet &A = sheets.A, &B = sheets.B, &C = sheets.C;
  const Floats per_all = 1.0f / larger(m.weights, all(kTiny));
  const Floats some_b = smooth_step(0.003f, 0.02f, B.w * per_all);
  const Ints convex = convex_between(m.a, m.b), only_b = ~(A.w > 1e-9f * B.w);
  const Floats apart = magnitude(m.a.z - m.b.z);
  m.edge = (B.w > 0.03f * A.w) & convex & (apart <= crease);
  if (any(sheets.third > 0.0f)) {
    const Floats some_c = smooth_step(0.003f, 0.02f, C.w * per_all);
    m.shares = shares_in_corner(m.a, m.b, m.c, some_b, some_c, only_b, crease);
    m.edge |= (C.w > 0.03f * A.w) & convex_between(m.a, m.c) & (magnitude(m.a.z - m.c.z) <= crease);
  } else {
    m.shares.b = only_b ? all(1.0f) : takes_over(m.a.z, m.b.z, convex, some_b, crease);
  }
  // A third face may hold the nearer of A and B.
  const Ints beside = convex & (apart <= crease) & ~only_b & (some_b > 0.0f) & (apart > kMeeting);
  if (!any(beside)) return;
  const Ints is_near = m.a.z < m.b.z;
  const Middle near = either_sheet(m.a, m.b, is_near), deep = either_sheet(m.b, m.a, is_near);
  const Floats held = held_by(by.in, by.s, by.listed.rim, near, deep, m.weights, beside);
  m.shares.b = is_near ? m.shares.b * (1.0f - held)
                       : fused(held, some_b * (1.0f - m.shares.c) - m.shares.b, m.shares.b);
}

[[gnu::always_inline]] inline Meeting meeting_of(const Blender& by, const Sheets& sheets) {
  Meeting m{middle_of(sheets.A), middle_of(sheets.B), middle_of(sheets.C),
            sheets.A.w + sheets.B.w + sheets.C.w};
  if (!sheets.one) share_out(by, sheets, m);
  return m;
}

// Sets depth and normal. Returns the middle of what is shown.
[[gnu::always_inline]] inline Axis show(const Sample& s, const Met& met, const Sheets& sheets,
                                        const Meeting& m, Blended& out) {
  const auto& [a, b, c, weights, shares, edge] = m;
  const Floats of_a = all(1.0f) - shares.b - shares.c, of_b = shares.b, of_c = shares.c;
  out.group = met.group;
  out.depth = met.best > 0.0f ? s.t + a.z * of_a + b.z * of_b + c.z * of_c : out.depth;
  add_normal(sheets.A, a.z, of_a, out);
  if (!sheets.one) {
    add_normal(sheets.B, b.z, of_b, out);
    add_normal(sheets.C, c.z, of_c, out);
  }
  const Floats size = inverse_root(square_of(out.nx, out.ny, out.nz), kTiny);
  out.nx *= size;
  out.ny *= size;
  out.nz *= size;
  face_eye(s.dx, s.dy, out.nx, out.ny, out.nz);
  return {fused(a.cx, of_a, fused(b.cx, of_b, c.cx * of_c)),
          fused(a.cy, of_a, fused(b.cy, of_b, c.cy * of_c)),
          fused(a.cz, of_a, fused(b.cz, of_b, c.cz * of_c))};
}

// Sums over the steep and hidden faces at the point that is shown.
struct Hidden {
  // Of hidden faces, sheet R: weights, values, feet and gradients; how much those weigh that the
  // point lies outside of; both times their own weight in the blend.
  Floats w{}, f{}, cx{}, cy{}, cz{}, nx{}, ny{}, nz{}, outside{}, strong{}, strong_outside{};
  Floats within{}, beyond{};  // what faces weigh that the point lies in, and outside of
  Turning turning;
};

[[gnu::always_inline]] inline void add_face(const Blender& by, int fit, const FaceValue& face,
                                            const Axis& middle, const Floats& steep,
                                            const Blended& shown, Hidden& sum) {
  const float *const g = by.fit_at(fit), *const foot = by.foot_of(fit);
  const Floats none{};
  const auto& [f, gx, gy, gz, counts, per_slope] = face;
  const Floats cosine = dot_of(gx, gy, gz, shown.nx, shown.ny, shown.nz);
  const Floats weight = counts * (1.0f - by.same(cosine));
  const Floats along = fused(gx, by.s.dx, fused(gy, by.s.dy, -gz));
  if (g[15] > 0.5f * kRoundest) {
    const Floats belongs =
        by.same(g[15] + cosine) * smooth_step(0.5f * kRoundest, kRoundest, all(g[15]));
    sum.turning.add(g, by.s, face, along, along > steep ? counts * belongs : none);
  }
  const Floats tx = foot[0] - middle.x, ty = foot[1] - middle.y, tz = foot[2] - middle.z;
  const Ints convex = (dot_of(tx, ty, tz, shown.nx, shown.ny, shown.nz) < 0.0f) &
                      (dot_of(tx, ty, tz, gx, gy, gz) > 0.0f);
  const Floats holds = convex & (along > steep) ? weight : none;
  sum.within += f > 0.0f ? none : holds;
  sum.beyond += f > 0.0f ? holds : none;
  const Floats w = along > 0.0f ? weight : none;
  const Floats outside = f < 0.0f ? none : w;
  sum.w += w;
  sum.outside += outside;
  sum.strong = fused(w, all(g[13]), sum.strong);
  sum.strong_outside = fused(outside, all(g[13]), sum.strong_outside);
  sum.f = fused(w, larger(f, all(kWithin)), sum.f);
  sum.cx = fused(w, all(foot[0]), sum.cx);
  sum.cy = fused(w, all(foot[1]), sum.cy);
  sum.cz = fused(w, all(foot[2]), sum.cz);
  sum.nx = fused(w, gx, sum.nx);
  sum.ny = fused(w, gy, sum.ny);
  sum.nz = fused(w, gz, sum.nz);
}

[[gnu::always_inline]] inline Hidden hidden_at(const Blender& by, const Axis& middle,
                                               const Blended& shown) {
  const List& rim = by.listed.rim;
  const Sample& s = by.s;
  const Floats end = shown.depth - s.t, x = s.sx + end * s.dx, y = s.sy + end * s.dy,
               z = -shown.depth;
  const Floats steep = steep_for(s);
  const Box box = box_of(x, y, z, shown.depth < kNowhere);
  Hidden sum;
  for (int k = 0; k < rim.count; k += kWidth)
    for (unsigned near = near_box(rim, k, box); near; near &= near - 1) {
      const int fit = rim.fit[k + __builtin_ctz(near)];
      FaceValue face;
      if (face_at(by.fit_at(fit), by.foot_of(fit), x, y, z, face))
        add_face(by, fit, face, middle, steep, shown, sum);
    }
  return sum;
}

// Whether hidden faces end the surface: it lies outside of them, and meets them in a convex edge.
inline Ints ended_by(const Hidden& r, const Axis& middle, const Blended& shown) {
  const Floats per = 1.0f / larger(r.w, all(kTiny));
  const Floats x = r.cx * per - middle.x, y = r.cy * per - middle.y, z = r.cz * per - middle.z;
  const Ints credible = r.strong_outside * r.w > kCredible * (r.strong * r.outside);
  return (r.w > 1e-3f) & (r.f > 0.0f) & credible &
         (x * shown.nx + y * shown.ny + z * shown.nz < 0.0f) &
         (x * r.nx + y * r.ny + z * r.nz > 0.0f);
}

// The trust of what is shown, and its mark.
[[gnu::always_inline]] inline Floats trust_of(const Sample& s, const Met& met, const Sheets& sheets,
                                              const Meeting& m, const Hidden& hidden,
                                              const Ints& ended) {
  const Floats none{}, one = all(1.0f), tiny = all(kTiny), weights = m.weights;
  const Sheet &A = sheets.A, &B = sheets.B, &C = sheets.C;
  Floats trust = smaller(1.001f * weights / larger(met.trust, tiny), one) *
                 smooth_step(0.002f, 0.015f, met.firm);
  const Floats least = trust >= 1.0f ? all(kVouchingSure) : all(kVouching);
  const Ints edge = m.edge | ((hidden.within > least) & (hidden.within > hidden.beyond));
  const Floats entering =
      dot_of(A.nx + B.nx + C.nx, A.ny + B.ny + C.ny, A.nz + B.nz + C.nz, s.dx, s.dy, all(-1.0f));
  const Ints over =
      (met.height > kOver * weights) | (hidden.turning.height_over(weights, entering) > kOver);
  const Ints passed = over & (trust > kSurelyOver);
  trust = over & ~passed ? none : trust;
  const Floats one_face = 1.0f - smooth_step(0.003f, 0.02f, (B.w + C.w) / larger(weights, tiny));
  const Floats doubt = (1.0f - trust) * (1.0f - smooth_step(0.8f, 1.4f, met.firm) * one_face);
  trust = over | ended ? trust : 1.0f - doubt;
  return trust + (passed ? all(8.0f) : ended ? all(4.0f) : edge ? all(2.0f) : none);
}

Blended blend_at(const Blend& in, const Sample& s, const Listed& listed) {
  const Blender by{in, s, listed};
  Blended out;
  Cache cache;
  Met met;
  meet_all(by, cache, met);
  if (!any(met.best > 0.0f)) return out;
  const Sheets sheets = sheets_of(by, cache, met);
  const Meeting meeting = meeting_of(by, sheets);
  const Axis middle = show(s, met, sheets, meeting, out);
  const Hidden hidden = hidden_at(by, middle, out);
  out.trust = trust_of(s, met, sheets, meeting, hidden, ended_by(hidden, middle, out));
  return out;
}

}  // namespace

void blend_groups(const Blend& in, std::size_t begin, std::size_t end) {
  for (std::size_t k = begin; k < end; ++k) {
    const int tile = static_cast<int>(k);
    const auto list = [k](const FitList& fits) {
      const std::int32_t first = fits.start[k];
      return List{fits.fit + first, fits.place + first, fits.stride, fits.start[k + 1] - first};
    };
    const Listed listed = {list(in.met), list(in.rim)};
    for (int place = 0; place < in.lists.count[k]; place += kWidth) {
      Lanes lanes;
      load_lanes(in.lists, tile, place, lanes);
      const Rays& r = lanes.rays;
      const Floats t = gather(in.reference, lanes.at);
      const Blended b = blend_at(in, {r.ox + t * r.dx, r.oy + t * r.dy, t, r.dx, r.dy}, listed);
      scatter(b.depth, in.depth, lanes.at, lanes.used);
      scatter(b.nx, in.normal, lanes.at, lanes.used);
      scatter(b.ny, in.normal + in.samples, lanes.at, lanes.used);
      scatter(b.nz, in.normal + 2 * in.samples, lanes.at, lanes.used);
      scatter(b.trust, in.trust, lanes.at, lanes.used);
      scatter(b.group, in.group, lanes.at, lanes.used);
    }
  }
}

}  // namespace meniscus::bench::native
