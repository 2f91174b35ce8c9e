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

Blended blend_at(const Blend& in, const Sample& s, const Listed& listed) {
  const Floats none{}, one = all(1.0f), tiny = all(kTiny);
  const float *const records = in.records, *const feet = in.feet;
  const auto fit_at = [records](int fit) { return records + std::ptrdiff_t{fit} * kRecord; };
  const auto foot_of = [feet](int fit) { return feet + std::ptrdiff_t{fit} * 4; };
  const auto same = [&](const Floats& cosine) {
    return smooth_step(in.same_low, in.same_high, cosine);
  };
  const Beam beam = beam_of(s);
  Hit cache[kCached];
  std::int32_t cached_group[kCached];
  int kept = 0, rest = listed.met.count;
  Blended out;
  Floats best{}, ax{}, ay{}, az{}, trust{}, firm{}, height{};
  Sheet A, B, C;
  // Half of the fits near the beam are met beyond their reach, and which could not be foreseen:
  // first all that rays meet, without a branch, then the weights of those that count.
  for (int from = 0; from < listed.met.count; from += kBlock) {
    const int to = from + kBlock < listed.met.count ? from + kBlock : listed.met.count;
    std::int32_t place[kBlock + kWidth];  // in the list
    Entry entry[kBlock];
    int near = 0, count = 0;
    for (int k = from; k < to; k += kWidth) {
      const unsigned bits = find_near(listed.met, k, beam);
      pack(bits, k + kPlaces, place + near);
      near += __builtin_popcount(bits);
    }
    for (int n = 0; n < near; ++n) {
      const std::int32_t at = place[n], fit = listed.met.fit[at];  // before `count` is waited for
      place[count] = at;
      entry[count] = entry_of(fit_at(fit), foot_of(fit), s, in.d_max);
      count += entry[count].counts();
    }
    for (int n = 0; n < count; ++n) {
      const int fit = listed.met.fit[place[n]];
      const float* const g = fit_at(fit);
      Hit hit;
      if (!weigh(g, foot_of(fit), s, in.d_max, entry[n], hit)) continue;
      firm = fused(hit.weight, all(g[14]), firm);
      fade(entry[n], hit);
      if (kept < kCached) {
        cache[kept] = hit;
        cached_group[kept++] = fit;
      } else if (rest == listed.met.count) {
        rest = place[n];
      }
      const Ints better = hit.weight > best;
      best = better ? hit.weight : best;
      out.group = better ? Ints{} + fit : out.group;
      ax = better ? hit.gx : ax;
      ay = better ? hit.gy : ay;
      az = better ? hit.gz : az;
      trust = fused(hit.weight, all(g[12]), trust);
      height = fused(hit.weight, entry[n].height, height);
      add_hit(A, foot_of(fit), s, hit, one);
    }
  }
  if (!any(best > 0.0f)) return out;

  // How far a hit's gradient agrees with the sheet's; round fits agree by so much more.
  const auto alike = [&](const Hit& hit, const float* g) {
    return g[15] + dot_of(hit.gx, hit.gy, hit.gz, ax, ay, az);
  };
  const auto turn_to = [](const Floats& nx, const Floats& ny, const Floats& nz, Floats& x,
                          Floats& y, Floats& z) {
    const Floats size = square_of(nx, ny, nz), scale = inverse_root(size, kTiny);
    x = size > kTiny ? nx * scale : x;
    y = size > kTiny ? ny * scale : y;
    z = size > kTiny ? nz * scale : z;
  };
  // Calls visit(hit, record, foot) for the hits in the cache and those that are found again.
  const auto each_hit = [&](auto&& visit) {
    for (int k = 0; k < kept; ++k)
      visit(cache[k], fit_at(cached_group[k]), foot_of(cached_group[k]));
    for (int k = rest; k < listed.met.count; ++k) {
      const int fit = listed.met.fit[k];
      const float *const g = fit_at(fit), *const foot = foot_of(fit);
      const Entry entry = entry_of(g, foot, s, in.d_max);
      Hit hit;
      if (!entry.counts() || !weigh(g, foot, s, in.d_max, entry, hit)) continue;
      fade(entry, hit);
      visit(hit, g, foot);
    }
  };
  bool one_sheet = rest == listed.met.count;
  for (int round = 0; round < 2; ++round) {
    if (one_sheet) {
      Floats least = one;
      for (int k = 0; k < kept; ++k) {
        const Floats agrees = alike(cache[k], fit_at(cached_group[k]));
        least = smaller(least, cache[k].weight > 0.0f ? agrees : one);
      }
      one_sheet = !any(same(least) < 1.0f);
    }
    Floats nx = A.nx, ny = A.ny, nz = A.nz;
    if (!one_sheet) {
      nx = ny = nz = none;
      each_hit([&](const Hit& hit, const float* g, const float*) {
        const Floats a = hit.weight * same(alike(hit, g));
        nx = fused(a, hit.gx, nx);
        ny = fused(a, hit.gy, ny);
        nz = fused(a, hit.gz, nz);
      });
    }
    turn_to(nx, ny, nz, ax, ay, az);
  }
  Floats third{};
  if (!one_sheet) {
    A = Sheet{};
    Floats bx{}, by{}, bz{}, most{};
    each_hit([&](const Hit& hit, const float* g, const float* foot) {
      const Floats share = same(alike(hit, g)), left = (1.0f - share) * hit.weight;
      add_hit(A, foot, s, hit, share);
      add_hit(B, foot, s, hit, 1.0f - share);
      const Ints better = left > most;
      most = better ? left : most;
      bx = better ? hit.gx : bx;
      by = better ? hit.gy : by;
      bz = better ? hit.gz : bz;
    });
    const Floats length = root(square_of(B.nx, B.ny, B.nz)) / larger(B.w, tiny);
    third = (1.0f - smooth_step(0.95f, 0.98f, length)) *
            smooth_step(0.003f, 0.02f, B.w / larger(A.w + B.w, tiny));
    if (any(third > 0.0f)) {
      const auto of_b = [&](const Hit& hit, const float* g) {
        return same(g[15] + dot_of(hit.gx, hit.gy, hit.gz, bx, by, bz));
      };
      Floats nx{}, ny{}, nz{};
      each_hit([&](const Hit& hit, const float* g, const float*) {
        const Floats w = (1.0f - same(alike(hit, g))) * hit.weight * of_b(hit, g);
        nx = fused(w, hit.gx, nx);
        ny = fused(w, hit.gy, ny);
        nz = fused(w, hit.gz, nz);
      });
      turn_to(nx, ny, nz, bx, by, bz);
      B = Sheet{};
      each_hit([&](const Hit& hit, const float* g, const float* foot) {
        const Floats others = 1.0f - same(alike(hit, g)), other = third * (1.0f - of_b(hit, g));
        add_hit(B, foot, s, hit, others * (1.0f - other));
        add_hit(C, foot, s, hit, others * other);
      });
    }
  }

  const Floats weights = A.w + B.w + C.w;
  const Middle a = middle_of(A), b = middle_of(B), c = middle_of(C);
  Ints edge{};
  Shares shares{};
  if (!one_sheet) {
    const Floats per_all = 1.0f / larger(weights, tiny);
    const Floats some_b = smooth_step(0.003f, 0.02f, B.w * per_all);
    const Ints convex = convex_between(a, b), only_b = ~(A.w > 1e-9f * B.w);
    edge = (B.w > 0.03f * A.w) & convex & (magnitude(a.z - b.z) <= in.crease);
    if (any(third > 0.0f)) {
      const Floats some_c = smooth_step(0.003f, 0.02f, C.w * per_all);
      shares = shares_in_corner(a, b, c, some_b, some_c, only_b, in.crease);
      edge |= (C.w > 0.03f * A.w) & convex_between(a, c) & (magnitude(a.z - c.z) <= in.crease);
    } else {
      shares.b = only_b ? one : takes_over(a.z, b.z, convex, some_b, in.crease);
    }
    const Floats apart = magnitude(a.z - b.z);
    const Ints beside =
        convex & (apart <= in.crease) & ~only_b & (some_b > 0.0f) & (apart > kMeeting);
    if (any(beside)) {
      const Ints is_near = a.z < b.z;
      const Middle near = either_sheet(a, b, is_near), deep = either_sheet(b, a, is_near);
      const Floats held = held_by(in, s, listed.rim, near, deep, weights, beside);
      shares.b = is_near ? shares.b * (1.0f - held)
                         : fused(held, some_b * (1.0f - shares.c) - shares.b, shares.b);
    }
  }
  const Floats of_a = one - shares.b - shares.c, of_b = shares.b, of_c = shares.c;
  out.depth = best > 0.0f ? s.t + a.z * of_a + b.z * of_b + c.z * of_c : out.depth;
  add_normal(A, a.z, of_a, out);
  if (!one_sheet) {
    add_normal(B, b.z, of_b, out);
    add_normal(C, c.z, of_c, out);
  }
  const Floats size = inverse_root(square_of(out.nx, out.ny, out.nz), kTiny);
  out.nx *= size;
  out.ny *= size;
  out.nz *= size;
  face_eye(s.dx, s.dy, out.nx, out.ny, out.nz);

  const Floats end = out.depth - s.t, ex = s.sx + end * s.dx, ey = s.sy + end * s.dy;
  Floats wr{}, fr{}, crx{}, cry{}, crz{}, nrx{}, nry{}, nrz{}, within{}, beyond{};
  Floats outside{}, strong{}, strong_outside{};
  Turning turning;
  const Floats mx = fused(a.cx, of_a, fused(b.cx, of_b, c.cx * of_c)),
               my = fused(a.cy, of_a, fused(b.cy, of_b, c.cy * of_c)),
               mz = fused(a.cz, of_a, fused(b.cz, of_b, c.cz * of_c));
  const Floats steep = steep_for(s);
  const Box box = box_of(ex, ey, -out.depth, out.depth < kNowhere);
  for (int k = 0; k < listed.rim.count; k += kWidth)
    for (unsigned near = near_box(listed.rim, k, box); near; near &= near - 1) {
      const int fit = listed.rim.fit[k + __builtin_ctz(near)];
      const float *const g = fit_at(fit), *const foot = foot_of(fit);
      FaceValue face;
      if (!face_at(g, foot, ex, ey, -out.depth, face)) continue;
      const auto& [f, gx, gy, gz, counts, per_slope] = face;
      const Floats cosine = dot_of(gx, gy, gz, out.nx, out.ny, out.nz);
      const Floats weight = counts * (1.0f - same(cosine));
      const Floats along = fused(gx, s.dx, fused(gy, s.dy, -gz));
      if (g[15] > 0.5f * kRoundest) {
        const Floats belongs =
            same(g[15] + cosine) * smooth_step(0.5f * kRoundest, kRoundest, all(g[15]));
        turning.add(g, s, face, along, along > steep ? counts * belongs : none);
      }
      const Floats tx = foot[0] - mx, ty = foot[1] - my, tz = foot[2] - mz;
      const Ints convex = (dot_of(tx, ty, tz, out.nx, out.ny, out.nz) < 0.0f) &
                          (dot_of(tx, ty, tz, gx, gy, gz) > 0.0f);
      const Floats hidden = convex & (along > steep) ? weight : none;
      within += f > 0.0f ? none : hidden;
      beyond += f > 0.0f ? hidden : none;
      const Floats w = along > 0.0f ? weight : none;
      const Floats out_w = f < 0.0f ? none : w;
      wr += w;
      outside += out_w;
      strong = fused(w, all(g[13]), strong);
      strong_outside = fused(out_w, all(g[13]), strong_outside);
      fr = fused(w, larger(f, all(kWithin)), fr);
      crx = fused(w, all(foot[0]), crx);
      cry = fused(w, all(foot[1]), cry);
      crz = fused(w, all(foot[2]), crz);
      nrx = fused(w, gx, nrx);
      nry = fused(w, gy, nry);
      nrz = fused(w, gz, nrz);
    }
  const Floats vr = 1.0f / larger(wr, tiny);
  const Floats rx = crx * vr - mx, ry = cry * vr - my, rz = crz * vr - mz;
  const Ints credible = strong_outside * wr > kCredible * (strong * outside);
  const Ints ended = (wr > 1e-3f) & (fr > 0.0f) & credible &
                     (rx * out.nx + ry * out.ny + rz * out.nz < 0.0f) &
                     (rx * nrx + ry * nry + rz * nrz > 0.0f);
  out.trust =
      smaller(1.001f * weights / larger(trust, tiny), one) * smooth_step(0.002f, 0.015f, firm);
  const Floats least = out.trust >= 1.0f ? all(kVouchingSure) : all(kVouching);
  edge |= (within > least) & (within > beyond);
  const Floats entering =
      dot_of(A.nx + B.nx + C.nx, A.ny + B.ny + C.ny, A.nz + B.nz + C.nz, s.dx, s.dy, all(-1.0f));
  const Ints over = (height > kOver * weights) | (turning.height_over(weights, entering) > kOver);
  const Ints passed = over & (out.trust > kSurelyOver);
  out.trust = over & ~passed ? none : out.trust;
  const Floats one_face = 1.0f - smooth_step(0.003f, 0.02f, (B.w + C.w) / larger(weights, tiny));
  const Floats doubt = (1.0f - out.trust) * (1.0f - smooth_step(0.8f, 1.4f, firm) * one_face);
  out.trust = over | ended ? out.trust : 1.0f - doubt;
  out.trust += passed ? all(8.0f) : ended ? all(4.0f) : edge ? all(2.0f) : none;
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
