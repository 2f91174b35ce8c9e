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

[[gnu::always_inline]] inline void add_moments(Floats* m, const Floats& w, const Floats& x, const Floats& y,
                        const Floats& z) {
  const Floats wx = w * x, wy = w * y, wz = w * z;
  const Floats wxx = wx * x, wyy = wy * y, wzz = wz * z, wxy = wx * y, wyz = wy * z, wzx = wz * x;
  const Floats xx = x * x, yy = y * y, zz = z * z, xy = x * y, yz = y * z, zx = z * x;
  m[M_1] += w;
  m[M_X] += wx;
  m[M_Y] += wy;
  m[M_Z] += wz;
  m[M_XX] += wxx;
  m[M_YY] += wyy;
  m[M_ZZ] += wzz;
  m[M_XY] += wxy;
  m[M_YZ] += wyz;
  m[M_ZX] += wzx;
  m[M_XXX] += wxx * x;
  m[M_YYY] += wyy * y;
  m[M_ZZZ] += wzz * z;
  m[M_XXY] += wxx * y;
  m[M_XXZ] += wxx * z;
  m[M_YYX] += wyy * x;
  m[M_YYZ] += wyy * z;
  m[M_ZZX] += wzz * x;
  m[M_ZZY] += wzz * y;
  m[M_XYZ] += wxy * z;
  m[M_XXXX] += wxx * xx;
  m[M_YYYY] += wyy * yy;
  m[M_ZZZZ] += wzz * zz;
  m[M_XXXY] += wxx * xy;
  m[M_XXXZ] += wxx * zx;
  m[M_YYYX] += wyy * xy;
  m[M_YYYZ] += wyy * yz;
  m[M_ZZZX] += wzz * zx;
  m[M_ZZZY] += wzz * yz;
  m[M_XXYY] += wxx * yy;
  m[M_YYZZ] += wyy * zz;
  m[M_ZZXX] += wzz * xx;
  m[M_XXYZ] += wxx * yz;
  m[M_YYZX] += wyy * zx;
  m[M_ZZXY] += wzz * xy;
}

[[gnu::always_inline]] inline void add_basis(Floats* b, const Floats& w, const Floats& x, const Floats& y,
                      const Floats& z) {
  const Floats wx = w * x, wy = w * y, wz = w * z;
  b[0] += w;
  b[1] += wx;
  b[2] += wy;
  b[3] += wz;
  b[4] += wx * x;
  b[5] += wy * y;
  b[6] += wz * z;
  b[7] += wx * y;
  b[8] += wy * z;
  b[9] += wz * x;
}

[[gnu::always_inline]] inline Floats evaluate(const Floats* a, const Floats& x, const Floats& y, const Floats& z) {
  return a[0] + (a[1] + a[4] * x + a[7] * y) * x + (a[2] + a[5] * y + a[8] * z) * y +
         (a[3] + a[6] * z + a[9] * x) * z;
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
    add_moments(m, w, x, y, z);
    add_moments(m, w, x + dx, y + dy, z + dz);
    add_moments(m, w, x - dx, y - dy, z - dz);
    add_basis(a, w * delta, x + dx, y + dy, z + dz);
    add_basis(a, -w * delta, x - dx, y - dy, z - dz);
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

  Floats sum{}, weight = all(1e-30f);
  for (int k = 0; k < count; ++k) {
    const float* const p = begin + 8 * k;
    const Floats f = evaluate(a, load(p), load(p + slots), load(p + 2 * slots)) / slope;
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
