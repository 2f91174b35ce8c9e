#include "kernels/native/lanes.hpp"
#include "kernels/native/native.hpp"

namespace meniscus::bench::native {
namespace {

enum {
  M_1, M_X, M_Y, M_Z, M_XX, M_YY, M_ZZ, M_XY, M_YZ, M_ZX,
  M_XXX, M_YYY, M_ZZZ, M_XXY, M_XXZ, M_YYX, M_YYZ, M_ZZX, M_ZZY, M_XYZ,
  M_XXXX, M_YYYY, M_ZZZZ, M_XXXY, M_XXXZ, M_YYYX, M_YYYZ, M_ZZZX, M_ZZZY,
  M_XXYY, M_YYZZ, M_ZZXX, M_XXYZ, M_YYZX, M_ZZXY, kMoments
};

// The moment that is the product of basis functions r and s (s <= r), row by row.
constexpr int kProduct[55] = {
    M_1,
    M_X,  M_XX,
    M_Y,  M_XY,  M_YY,
    M_Z,  M_ZX,  M_YZ,  M_ZZ,
    M_XX, M_XXX, M_XXY, M_XXZ, M_XXXX,
    M_YY, M_YYX, M_YYY, M_YYZ, M_XXYY, M_YYYY,
    M_ZZ, M_ZZX, M_ZZY, M_ZZZ, M_ZZXX, M_YYZZ, M_ZZZZ,
    M_XY, M_XXY, M_YYX, M_XYZ, M_XXXY, M_YYYX, M_ZZXY, M_XXYY,
    M_YZ, M_XYZ, M_YYZ, M_ZZY, M_XXYZ, M_YYYZ, M_ZZZY, M_YYZX, M_YYZZ,
    M_ZX, M_XXZ, M_XYZ, M_ZZX, M_XXXZ, M_YYZX, M_ZZZX, M_XXYZ, M_ZZXY, M_ZZXX};

constexpr int at(int r, int s) { return r * (r + 1) / 2 + s; }

// A point with its three rows.
[[gnu::always_inline]] inline void add_point(Floats* m, Floats* b, const Floats& w,
                                             const Floats& delta, const Floats& x, const Floats& y,
                                             const Floats& z, const Floats& dx, const Floats& dy,
                                             const Floats& dz) {
  const Floats xx = x * x, yy = y * y, zz = z * z, xy = x * y, yz = y * z, zx = z * x;
  const Floats exx = fused(dx, dx, xx), eyy = fused(dy, dy, yy), ezz = fused(dz, dz, zz);
  const Floats exy = fused(dx, dy, xy), eyz = fused(dy, dz, yz), ezx = fused(dz, dx, zx);
  const Floats oxx = (x + x) * dx, oyy = (y + y) * dy, ozz = (z + z) * dz;
  const Floats oxy = fused(x, dy, dx * y), oyz = fused(y, dz, dy * z), ozx = fused(z, dx, dz * x);
  const Floats twice = w + w, thrice = twice + w;
  const Floats wxx = w * xx, wyy = w * yy, wzz = w * zz;
  const Floats pxx = twice * exx, pyy = twice * eyy, pzz = twice * ezz;
  const Floats qxx = twice * oxx, qyy = twice * oyy, qzz = twice * ozz;
  const Floats qxy = twice * oxy, qyz = twice * oyz, qzx = twice * ozx;
  const Floats sxx = wxx + pxx, syy = wyy + pyy, szz = wzz + pzz;
  const Floats sxy = fused(w, xy, twice * exy), syz = fused(w, yz, twice * eyz),
               szx = fused(w, zx, twice * ezx);
  m[M_1] += thrice;
  m[M_X] += thrice * x;
  m[M_Y] += thrice * y;
  m[M_Z] += thrice * z;
  m[M_XX] += sxx;
  m[M_YY] += syy;
  m[M_ZZ] += szz;
  m[M_XY] += sxy;
  m[M_YZ] += syz;
  m[M_ZX] += szx;
  const auto cubic = [m](int k, const Floats& sum, const Floats& odd, const Floats& c,
                         const Floats& d) __attribute__((always_inline)) {
    m[k] += fused(sum, c, odd * d);
  };
  cubic(M_XXX, sxx, qxx, x, dx);
  cubic(M_YYY, syy, qyy, y, dy);
  cubic(M_ZZZ, szz, qzz, z, dz);
  cubic(M_XXY, sxx, qxx, y, dy);
  cubic(M_XXZ, sxx, qxx, z, dz);
  cubic(M_YYX, syy, qyy, x, dx);
  cubic(M_YYZ, syy, qyy, z, dz);
  cubic(M_ZZX, szz, qzz, x, dx);
  cubic(M_ZZY, szz, qzz, y, dy);
  cubic(M_XYZ, sxy, qxy, z, dz);
#define QUARTIC(k, A, B) m[k] += fused(w##A, B, fused(p##A, e##B, q##A * o##B))
  QUARTIC(M_XXXX, xx, xx);
  QUARTIC(M_YYYY, yy, yy);
  QUARTIC(M_ZZZZ, zz, zz);
  QUARTIC(M_XXXY, xx, xy);
  QUARTIC(M_XXXZ, xx, zx);
  QUARTIC(M_YYYX, yy, xy);
  QUARTIC(M_YYYZ, yy, yz);
  QUARTIC(M_ZZZX, zz, zx);
  QUARTIC(M_ZZZY, zz, yz);
  QUARTIC(M_XXYY, xx, yy);
  QUARTIC(M_YYZZ, yy, zz);
  QUARTIC(M_ZZXX, zz, xx);
  QUARTIC(M_XXYZ, xx, yz);
  QUARTIC(M_YYZX, yy, zx);
  QUARTIC(M_ZZXY, zz, xy);
#undef QUARTIC
  const Floats pair = twice * delta;
  b[1] += pair * dx;
  b[2] += pair * dy;
  b[3] += pair * dz;
  b[4] += delta * qxx;
  b[5] += delta * qyy;
  b[6] += delta * qzz;
  b[7] += delta * qxy;
  b[8] += delta * qyz;
  b[9] += delta * qzx;
}

[[gnu::always_inline]] inline Floats evaluate(const Floats* a, const Floats& x, const Floats& y, const Floats& z) {
  const Floats gx = fused(a[4], x, fused(a[7], y, a[1])), gy = fused(a[5], y, fused(a[8], z, a[2])),
               gz = fused(a[6], z, fused(a[9], x, a[3]));
  return fused(gx, x, fused(gy, y, fused(gz, z, a[0])));
}

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

void fit_batch(const Fits& in, std::size_t batch) {
  const std::size_t item = 8 * batch, slots = in.slots;
  const float* const begin = in.points + in.first[batch];
  const int count = in.length[batch];
  const Floats R = load(in.scale + item);
  const Floats delta = in.off_surface / R, inverse_tau = R / in.tau;
  Floats m[kMoments], a[10];
  unrolled<0, kMoments>(MENISCUS_STEP(k) { m[k] = Floats{}; });
  unrolled<0, 10>(MENISCUS_STEP(k) { a[k] = Floats{}; });
  for (int k = 0; k < count; ++k) {
    const float* const p = begin + 8 * k;
    const Floats x = load(p), y = load(p + slots), z = load(p + 2 * slots);
    const Floats dx = delta * load(p + 3 * slots), dy = delta * load(p + 4 * slots),
                 dz = delta * load(p + 5 * slots);
    const Floats w = load(p + 6 * slots);
    add_point(m, a, w, delta, x, y, z, dx, dy, dz);
  }
  Floats A[55];
  unrolled<0, 55>(MENISCUS_STEP(k) { A[k] = m[kProduct[k]]; });
  const Floats total = m[M_1] * (1.0f / 3.0f);
  unrolled<0, 10>(MENISCUS_STEP(k) {
    constexpr float share = k < 4 ? 0.0f : k < 7 ? 1.0f : 0.5f;
    A[at(k, k)] += total * (share * in.ridge + 1e-6f);
  });
  const Floats least = solve(A, a);
  const Floats slope = root(larger(a[1] * a[1] + a[2] * a[2] + a[3] * a[3], all(1e-12f)));

  const Floats steep = 1.0f / slope;
  Floats sum{}, weight = all(1e-30f);
  for (int k = 0; k < count; ++k) {
    const float* const p = begin + 8 * k;
    const Floats f = evaluate(a, load(p), load(p + slots), load(p + 2 * slots)) * steep;
    const Floats behind = larger(-f, Floats{}) * inverse_tau;
    const Floats w = load(p + 6 * slots) * larger(exp_negative(-behind * behind), all(1e-4f));
    sum += w * f * f;
    weight += w;
  }
  const Floats residual = R * root(sum / weight);
  const Floats good =
      (least > 0.0f) & (slope > 0.2f) & (slope < 5.0f) ? all(1.0f) : Floats{};
  store(good * (residual + 1.0f) - 1.0f, in.quality + item);
  store(slope, in.quality + in.lanes + item);
  store(a[0] * R / slope, in.quadric + item);
  for (std::size_t k = 1; k < 4; ++k) store(a[k] / slope, in.quadric + k * in.lanes + item);
  for (std::size_t k = 4; k < 10; ++k)
    store(a[k] / (slope * R), in.quadric + k * in.lanes + item);
}

}  // namespace

void fit_groups(const Fits& input, std::size_t begin, std::size_t end) {
  for (std::size_t batch = begin; batch < end; ++batch) fit_batch(input, batch);
}

}  // namespace meniscus::bench::native
