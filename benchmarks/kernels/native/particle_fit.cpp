#define MENISCUS_WIDE
#include "kernels/native/lanes.hpp"
#include "kernels/native/native.hpp"

namespace meniscus::bench::native {
namespace {

enum {
  M_1,
  M_X,
  M_Y,
  M_Z,
  M_XX,
  M_YY,
  M_ZZ,
  M_XY,
  M_YZ,
  M_ZX,
  M_XXX,
  M_YYY,
  M_ZZZ,
  M_XXY,
  M_XXZ,
  M_YYX,
  M_YYZ,
  M_ZZX,
  M_ZZY,
  M_XYZ,
  M_XXXX,
  M_YYYY,
  M_ZZZZ,
  M_XXXY,
  M_XXXZ,
  M_YYYX,
  M_YYYZ,
  M_ZZZX,
  M_ZZZY,
  M_XXYY,
  M_YYZZ,
  M_ZZXX,
  M_XXYZ,
  M_YYZX,
  M_ZZXY,
  kMoments
};

// The moment that is the product of basis functions r and s (s <= r), row by row.
constexpr int kProduct[55] = {
    M_1,    M_X,    M_XX,   M_Y,    M_XY,   M_YY,   M_Z,    M_ZX,   M_YZ,   M_ZZ,   M_XX,
    M_XXX,  M_XXY,  M_XXZ,  M_XXXX, M_YY,   M_YYX,  M_YYY,  M_YYZ,  M_XXYY, M_YYYY, M_ZZ,
    M_ZZX,  M_ZZY,  M_ZZZ,  M_ZZXX, M_YYZZ, M_ZZZZ, M_XY,   M_XXY,  M_YYX,  M_XYZ,  M_XXXY,
    M_YYYX, M_ZZXY, M_XXYY, M_YZ,   M_XYZ,  M_YYZ,  M_ZZY,  M_XXYZ, M_YYYZ, M_ZZZY, M_YYZX,
    M_YYZZ, M_ZX,   M_XXZ,  M_XYZ,  M_ZZX,  M_XXXZ, M_YYZX, M_ZZZX, M_XXYZ, M_ZZXY, M_ZZXX};

constexpr int at(int r, int s) { return r * (r + 1) / 2 + s; }

constexpr int kBatch = 16, kChunk = 32;  // lanes; neighbours, see neighbours.cl

struct Point {
  Floats w, x, y, z, dx, dy, dz;
};

// What a point with its three rows adds to either half of the sums.
#define MENISCUS_PRODUCTS                                                                          \
  const Floats &w = p.w, &x = p.x, &y = p.y, &z = p.z, &dx = p.dx, &dy = p.dy, &dz = p.dz;         \
  const Floats xx = x * x, yy = y * y, zz = z * z, xy = x * y, yz = y * z, zx = z * x;             \
  [[maybe_unused]] const Floats exx = fused(dx, dx, xx), eyy = fused(dy, dy, yy),                  \
                                ezz = fused(dz, dz, zz);                                           \
  const Floats exy = fused(dx, dy, xy), eyz = fused(dy, dz, yz), ezx = fused(dz, dx, zx);          \
  [[maybe_unused]] const Floats oxx = (x + x) * dx, oyy = (y + y) * dy, ozz = (z + z) * dz;        \
  const Floats oxy = fused(x, dy, dx * y), oyz = fused(y, dz, dy * z), ozx = fused(z, dx, dz * x); \
  const Floats twice = w + w
#define CUBIC(k, s, q, c) m[k] = fused(s, c, fused(q, d##c, m[k]))
#define QUARTIC(k, A, B) m[k] = fused(w##A, B, fused(p##A, e##B, fused(q##A, o##B, m[k])))

[[gnu::always_inline]] inline void add_first(Floats* m, Floats* b, const Point& p,
                                             const Floats& delta) {
  MENISCUS_PRODUCTS;
  const Floats wxx = w * xx, wyy = w * yy, pxx = twice * exx, pyy = twice * eyy;
  const Floats qxx = twice * oxx, qyy = twice * oyy, sxx = wxx + pxx, syy = wyy + pyy;
  m[M_XX] += sxx;
  m[M_YY] += syy;
  CUBIC(M_XXX, sxx, qxx, x);
  CUBIC(M_YYY, syy, qyy, y);
  CUBIC(M_XXY, sxx, qxx, y);
  CUBIC(M_XXZ, sxx, qxx, z);
  CUBIC(M_YYX, syy, qyy, x);
  CUBIC(M_YYZ, syy, qyy, z);
  QUARTIC(M_XXXX, xx, xx);
  QUARTIC(M_YYYY, yy, yy);
  QUARTIC(M_XXXY, xx, xy);
  QUARTIC(M_XXXZ, xx, zx);
  QUARTIC(M_YYYX, yy, xy);
  QUARTIC(M_YYYZ, yy, yz);
  QUARTIC(M_XXYY, xx, yy);
  QUARTIC(M_YYZZ, yy, zz);
  QUARTIC(M_XXYZ, xx, yz);
  QUARTIC(M_YYZX, yy, zx);
  b[4] = fused(delta, qxx, b[4]);
  b[5] = fused(delta, qyy, b[5]);
}

[[gnu::always_inline]] inline void add_second(Floats* m, Floats* b, const Point& p,
                                              const Floats& delta) {
  MENISCUS_PRODUCTS;
  const Floats thrice = twice + w, pair = twice * delta;
  const Floats wzz = w * zz, pzz = twice * ezz, qzz = twice * ozz, szz = wzz + pzz;
  const Floats qxy = twice * oxy, qyz = twice * oyz, qzx = twice * ozx;
  const Floats sxy = fused(w, xy, twice * exy);
  m[M_1] += thrice;
  m[M_X] = fused(thrice, x, m[M_X]);
  m[M_Y] = fused(thrice, y, m[M_Y]);
  m[M_Z] = fused(thrice, z, m[M_Z]);
  m[M_ZZ] += szz;
  m[M_XY] += sxy;
  m[M_YZ] += fused(w, yz, twice * eyz);
  m[M_ZX] += fused(w, zx, twice * ezx);
  CUBIC(M_ZZZ, szz, qzz, z);
  CUBIC(M_ZZX, szz, qzz, x);
  CUBIC(M_ZZY, szz, qzz, y);
  CUBIC(M_XYZ, sxy, qxy, z);
  QUARTIC(M_ZZZZ, zz, zz);
  QUARTIC(M_ZZZX, zz, zx);
  QUARTIC(M_ZZZY, zz, yz);
  QUARTIC(M_ZZXX, zz, xx);
  QUARTIC(M_ZZXY, zz, xy);
  b[1] = fused(pair, dx, b[1]);
  b[2] = fused(pair, dy, b[2]);
  b[3] = fused(pair, dz, b[3]);
  b[6] = fused(delta, qzz, b[6]);
  b[7] = fused(delta, qxy, b[7]);
  b[8] = fused(delta, qyz, b[8]);
  b[9] = fused(delta, qzx, b[9]);
}
#undef MENISCUS_PRODUCTS
#undef CUBIC
#undef QUARTIC

// Cholesky; returns the smallest pivot.
[[gnu::always_inline]] inline Floats solve(Floats* A, Floats* b) {
  Floats least = all(1e30f);
  unrolled<0, 10>(MENISCUS_STEP(j) {
    Floats d = A[at(j, j)];
    unrolled<0, j>(MENISCUS_STEP(k) { d -= A[at(j, k)] * A[at(j, k)]; });
    least = smaller(least, d);
    const Floats inverse = 1.0f / root(larger(d, all(1e-30f)));
    A[at(j, j)] = inverse;
    unrolled<j + 1, 10>(MENISCUS_STEP(i) {
      Floats s = A[at(i, j)];
      unrolled<0, j>(MENISCUS_STEP(k) { s -= A[at(i, k)] * A[at(j, k)]; });
      A[at(i, j)] = s * inverse;
    });
  });
  unrolled<0, 10>(MENISCUS_STEP(i) {
    Floats s = b[i];
    unrolled<0, i>(MENISCUS_STEP(k) { s -= A[at(i, k)] * b[k]; });
    b[i] = s * A[at(i, i)];
  });
  unrolled<0, 10>(MENISCUS_STEP(n) {
    constexpr int i = 9 - n;
    Floats s = b[i];
    unrolled<i + 1, 10>(MENISCUS_STEP(k) { s -= A[at(k, i)] * b[k]; });
    b[i] = s * A[at(i, i)];
  });
  return least;
}

// The quadric a (in: its right-hand side) of the sums in m.
[[gnu::always_inline]] inline Floats quadric_of(const Floats* m, Floats* a, float ridge) {
  Floats A[55];
  unrolled<0, 55>(MENISCUS_STEP(k) { A[k] = m[kProduct[k]] + 0.0f; });
  unrolled<0, 10>(MENISCUS_STEP(k) { a[k] += 0.0f; });
  const Floats total = m[M_1] * (1.0f / 3.0f);
  unrolled<0, 10>(MENISCUS_STEP(k) {
    constexpr float share = k < 4 ? 0.0f : k < 7 ? 1.0f : 0.5f;
    A[at(k, k)] += total * (share * ridge + 1e-6f);
  });
  return solve(A, a);
}

// What neighbours weigh by their distance, the square of its share of the support, see
// neighbours.cl.
inline Floats parabola(const Floats& squared) {
  constexpr float kReach = 0.85f;  // FIT_REACH of records.h
  return larger(fused(all(-1.0f / (kReach * kReach)), squared, all(1.0f)), Floats{});
}

// kWidth records of four values, row by row, see neighbours.cl.
inline void load_records(const float* record, const std::int32_t* at, Floats* row) {
  typedef float Four __attribute__((vector_size(16)));
  typedef float Eight __attribute__((vector_size(32)));
  const auto fronts = [](const Eight& a, const Eight& b) {
    return __builtin_shufflevector(a, b, 0, 8, 1, 9, 4, 12, 5, 13);
  };
  const auto backs = [](const Eight& a, const Eight& b) {
    return __builtin_shufflevector(a, b, 2, 10, 3, 11, 6, 14, 7, 15);
  };
  const auto first_pairs = [](const Eight& a, const Eight& b) {
    return __builtin_shufflevector(a, b, 0, 1, 8, 9, 4, 5, 12, 13);
  };
  const auto second_pairs = [](const Eight& a, const Eight& b) {
    return __builtin_shufflevector(a, b, 2, 3, 10, 11, 6, 7, 14, 15);
  };
  Eight part[4][kWidth / 8];
  for (int eight = 0; eight < kWidth / 8; ++eight, at += 8) {
    Eight r[4];
    for (int k = 0; k < 4; ++k) {
      Four low, high;
      std::memcpy(&low, record + 4 * static_cast<std::ptrdiff_t>(at[k]), sizeof low);
      std::memcpy(&high, record + 4 * static_cast<std::ptrdiff_t>(at[k + 4]), sizeof high);
      r[k] = __builtin_shufflevector(low, high, 0, 1, 2, 3, 4, 5, 6, 7);
    }
    // Both halves are transposed at once, in two steps.
    const Eight xy0 = fronts(r[0], r[1]), xy1 = fronts(r[2], r[3]);
    const Eight zw0 = backs(r[0], r[1]), zw1 = backs(r[2], r[3]);
    part[0][eight] = first_pairs(xy0, xy1);
    part[1][eight] = second_pairs(xy0, xy1);
    part[2][eight] = first_pairs(zw0, zw1);
    part[3][eight] = second_pairs(zw0, zw1);
  }
  for (int v = 0; v < 4; ++v) std::memcpy(&row[v], part[v], sizeof row[v]);
}

struct Particles {
  Floats x, y, z, u, nx, ny, nz;
};

inline Particles load_particles(const Fits& in, const std::int32_t* at) {
  Floats p[4], n[4];
  load_records(in.place, at, p);
  load_records(in.normal, at, n);
  return {p[0], p[1], p[2], p[3], n[0], n[1], n[2]};
}

// A neighbour as a point of the fit around `own`, and whether it counts.
struct Weighed {
  Point point;
  Ints counts;
};

[[gnu::always_inline]] inline Weighed weigh(const Fits& in, const Particles& own, const Point& p,
                                            const Floats& inverse_rho, const Floats& delta) {
  const Floats x = p.x - own.x, y = p.y - own.y, z = p.z - own.z;
  const Floats squared = fused(x, x, fused(y, y, z * z));
  const Floats same = fused(own.nx, p.dx, fused(own.ny, p.dy, own.nz * p.dz));
  const Floats near = p.w * parabola(squared * (inverse_rho * inverse_rho));
  const Floats h = fused(x, own.nx, fused(y, own.ny, z * own.nz)) /
                   fused(all(in.height_growth), squared, all(in.height));
  const Floats off = smaller(h * h, all(11.5129255f));
  const Floats next =
      near * exp_negative(fused(all(in.falloff), smaller(same - 1.0f, Floats{}), -off));
  const Ints counts = (near >= 1e-6f) & (same >= -0.5f);
  return {{counts ? next : Floats{}, x * inverse_rho, y * inverse_rho, z * inverse_rho,
           delta * p.dx, delta * p.dy, delta * p.dz},
          counts};
}

// The particles' normals become those of the fits, where there are any.
inline void turn_normals(const Fits& in, std::size_t lane, const Particles& own, const Floats* a,
                         const Ints& good) {
  const Floats side = own.nx * a[1] + own.ny * a[2] + own.nz * a[3];
  const Floats size = root(a[1] * a[1] + a[2] * a[2] + a[3] * a[3]);
  const Floats scale = (side < 0.0f ? all(-1.0f) : all(1.0f)) / size;
  const Floats nx = good ? a[1] * scale : own.nx;
  const Floats ny = good ? a[2] * scale : own.ny;
  const Floats nz = good ? a[3] * scale : own.nz;
  for (std::size_t k = 0; k < kWidth; ++k) {
    const std::int32_t i = in.particle[lane + k];
    if (i == in.nobody) continue;
    float* const turned = in.turned + 4 * static_cast<std::ptrdiff_t>(i);
    turned[0] = nx[k];
    turned[1] = ny[k];
    turned[2] = nz[k];
  }
}

void fit_lanes(const Fits& in, std::size_t lane) {
  const std::size_t batch = lane / kBatch, lanes = in.lanes;
  const Particles own = load_particles(in, in.particle + lane);
  const Floats rho = load(in.support + lane), inverse_rho = 1.0f / rho;
  const Floats delta = in.off_surface / rho;
  const std::size_t begin = static_cast<std::size_t>(in.first[batch]) + lane % kBatch;
  const std::int32_t* const neighbour = in.neighbour + begin;
  float* const weight = in.weight + begin;
  const int count = in.length[batch];
  Floats m[kMoments], a[10];
  unrolled<0, kMoments>(MENISCUS_STEP(k) { m[k] = Floats{}; });
  unrolled<0, 10>(MENISCUS_STEP(k) { a[k] = Floats{}; });
  Ints used{};
  Point point[kChunk];
  for (int from = 0; from < count; from += kChunk) {
    const int points = count - from < kChunk ? count - from : kChunk;
    for (int k = 0; k < points; ++k) {
      const Particles p = load_particles(in, neighbour + kBatch * (from + k));
      point[k] = {p.u, p.x, p.y, p.z, p.nx, p.ny, p.nz};
    }
    for (int k = 0; k < points; ++k) {
      const Weighed weighed = weigh(in, own, point[k], inverse_rho, delta);
      point[k] = weighed.point;
      used -= weighed.counts;
      store(weighed.point.w, weight + kBatch * (from + k));
    }
    for (int k = 0; k < points; ++k) add_first(m, a, point[k], delta);
    for (int k = 0; k < points; ++k) add_second(m, a, point[k], delta);
  }
  const Ints few = used < 3;
  if (any(few)) {
    unrolled<0, kMoments>(MENISCUS_STEP(k) { m[k] = few ? Floats{} : m[k]; });
    unrolled<0, 10>(MENISCUS_STEP(k) { a[k] = few ? Floats{} : a[k]; });
  }
  const Floats least = quadric_of(m, a, in.ridge);
  const Floats slope = root(larger(a[1] * a[1] + a[2] * a[2] + a[3] * a[3], all(1e-12f)));
  const Ints good = (used >= 3) & (least > 0.0f) & (slope > 0.2f) & (slope < 5.0f);
  store(good ? Floats{} : all(-1.0f), in.residual + lane);
  store(a[0] * rho / slope, in.quadric + lane);
  for (std::size_t k = 1; k < 4; ++k) {
    a[k] /= slope;
    store(a[k], in.quadric + k * lanes + lane);
  }
  for (std::size_t k = 4; k < 10; ++k) store(a[k] / (slope * rho), in.quadric + k * lanes + lane);
  turn_normals(in, lane, own, a, good);
}

}  // namespace

void fit_particles(const Fits& input, std::size_t begin, std::size_t end) {
  for (std::size_t lane = begin * kBatch; lane < end * kBatch; lane += kWidth)
    fit_lanes(input, lane);
}

}  // namespace meniscus::bench::native
