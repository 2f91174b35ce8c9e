// fit.cl: one implicit quadric per group by weighted least squares (paper 2.3, Eq. 2). Functions
// only.
//
//   f(q) = a0 + a1 x + a2 y + a3 z + a4 xx + a5 yy + a6 zz + a7 xy + a8 yz + a9 zx
//
// in q = (p - centre) / R. As printed, Eq. 2 is solved by f = z whatever the points; here every
// point gives three rows instead, f(q) = 0 and f(q +- delta n) = +- delta, which fix the scale of f
// to a distance (docs/method.md).
//
// Everything is sums of one fixed order. The normal matrix is not summed entry by entry: its 55
// entries are 35 different moments of degree <= 4.

#define MOMENTS 35
// Index of the moment x^i y^j z^k, ordered by degree.
enum {
  M_1, M_X, M_Y, M_Z, M_XX, M_YY, M_ZZ, M_XY, M_YZ, M_ZX,
  M_XXX, M_YYY, M_ZZZ, M_XXY, M_XXZ, M_YYX, M_YYZ, M_ZZX, M_ZZY, M_XYZ,
  M_XXXX, M_YYYY, M_ZZZZ, M_XXXY, M_XXXZ, M_YYYX, M_YYYZ, M_ZZZX, M_ZZZY,
  M_XXYY, M_YYZZ, M_ZZXX, M_XXYZ, M_YYZX, M_ZZXY
};

// The moment that is the product of basis functions r and s (s <= r), row by row.
constant int kProduct[55] = {
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

#define AT(r, s) ((r) * ((r) + 1) / 2 + (s))

// A weighted point for the fit.
typedef struct {
  floatv w;           // weight
  floatv x, y, z;     // q
  floatv dx, dy, dz;  // d = delta n
} Point;

// A point and its rows, f(q) = 0 and f(q +- d) = +- delta, are added to the moments and to b in two
// halves, whose sums stay in registers when many points are added to one and then to the other. The
// product of two coordinates of q +- d is e +- o; so no row is taken by itself. Weighted are w of q, p
// and q of the pair, s of all three. Where all that is added to a sum is zero, its sign is one
// runtime's and another's own: -0 + 0 is -0 in rusticl's fma.
#define PRODUCTS                                                                             \
  const floatv w = p->w, x = p->x, y = p->y, z = p->z, dx = p->dx, dy = p->dy, dz = p->dz;   \
  const floatv xx = x * x, yy = y * y, zz = z * z, xy = x * y, yz = y * z, zx = z * x;       \
  const floatv exx = fma(dx, dx, xx), eyy = fma(dy, dy, yy), ezz = fma(dz, dz, zz);          \
  const floatv exy = fma(dx, dy, xy), eyz = fma(dy, dz, yz), ezx = fma(dz, dx, zx);          \
  const floatv oxx = (x + x) * dx, oyy = (y + y) * dy, ozz = (z + z) * dz;                   \
  const floatv oxy = fma(x, dy, dx * y), oyz = fma(y, dz, dy * z), ozx = fma(z, dx, dz * x); \
  const floatv twice = w + w
#define ADD(k, a, b) m[k] = fma(a, b, m[k])
#define CUBIC(k, s, q, c) m[k] = fma(s, c, fma(q, d##c, m[k]))
#define QUARTIC(k, A, B) m[k] = fma(w##A, B, fma(p##A, e##B, fma(q##A, o##B, m[k])))
#define ADD_VALUE(k, a, c) b[k] = fma(a, c, b[k])

// The moments whose first factor is xx or yy.
inline void add_first(floatv* m, floatv* b, const Point* p, const floatv delta) {
  PRODUCTS;
  const floatv wxx = w * xx, wyy = w * yy, pxx = twice * exx, pyy = twice * eyy;
  const floatv qxx = twice * oxx, qyy = twice * oyy, sxx = wxx + pxx, syy = wyy + pyy;
  m[M_XX] += sxx;  m[M_YY] += syy;
  CUBIC(M_XXX, sxx, qxx, x);  CUBIC(M_YYY, syy, qyy, y);
  CUBIC(M_XXY, sxx, qxx, y);  CUBIC(M_XXZ, sxx, qxx, z);
  CUBIC(M_YYX, syy, qyy, x);  CUBIC(M_YYZ, syy, qyy, z);
  QUARTIC(M_XXXX, xx, xx);  QUARTIC(M_YYYY, yy, yy);
  QUARTIC(M_XXXY, xx, xy);  QUARTIC(M_XXXZ, xx, zx);
  QUARTIC(M_YYYX, yy, xy);  QUARTIC(M_YYYZ, yy, yz);
  QUARTIC(M_XXYY, xx, yy);  QUARTIC(M_YYZZ, yy, zz);
  QUARTIC(M_XXYZ, xx, yz);  QUARTIC(M_YYZX, yy, zx);
  ADD_VALUE(4, delta, qxx);
  ADD_VALUE(5, delta, qyy);
}

// The others.
inline void add_second(floatv* m, floatv* b, const Point* p, const floatv delta) {
  PRODUCTS;
  const floatv thrice = twice + w, pair = twice * delta;
  const floatv wzz = w * zz, pzz = twice * ezz, qzz = twice * ozz, szz = wzz + pzz;
  const floatv qxy = twice * oxy, qyz = twice * oyz, qzx = twice * ozx;
  const floatv sxy = fma(w, xy, twice * exy), syz = fma(w, yz, twice * eyz),
               szx = fma(w, zx, twice * ezx);
  m[M_1] += thrice;
  ADD(M_X, thrice, x);
  ADD(M_Y, thrice, y);
  ADD(M_Z, thrice, z);
  m[M_ZZ] += szz;
  m[M_XY] += sxy;  m[M_YZ] += syz;  m[M_ZX] += szx;
  CUBIC(M_ZZZ, szz, qzz, z);  CUBIC(M_XYZ, sxy, qxy, z);
  CUBIC(M_ZZX, szz, qzz, x);  CUBIC(M_ZZY, szz, qzz, y);
  QUARTIC(M_ZZZZ, zz, zz);
  QUARTIC(M_ZZZX, zz, zx);  QUARTIC(M_ZZZY, zz, yz);
  QUARTIC(M_ZZXX, zz, xx);  QUARTIC(M_ZZXY, zz, xy);
  ADD_VALUE(1, pair, dx);
  ADD_VALUE(2, pair, dy);
  ADD_VALUE(3, pair, dz);
  ADD_VALUE(6, delta, qzz);
  ADD_VALUE(7, delta, qxy);
  ADD_VALUE(8, delta, qyz);
  ADD_VALUE(9, delta, qzx);
}

inline floatv evaluate(const floatv* a, const floatv x, const floatv y, const floatv z) {
  const floatv gx = fma(a[4], x, fma(a[7], y, a[1])), gy = fma(a[5], y, fma(a[8], z, a[2])),
               gz = fma(a[6], z, fma(a[9], x, a[3]));
  return fma(gx, x, fma(gy, y, fma(gz, z, a[0])));
}

// The gradient of a quadric.
inline void slope_at(const floatv* a, const floatv x, const floatv y, const floatv z, floatv* gx,
                     floatv* gy, floatv* gz) {
  *gx = fma(a[4], x + x, fma(a[7], y, fma(a[9], z, a[1])));
  *gy = fma(a[5], y + y, fma(a[7], x, fma(a[8], z, a[2])));
  *gz = fma(a[6], z + z, fma(a[8], y, fma(a[9], x, a[3])));
}

// Solves A a = b by Cholesky; A (lower triangle) and b are overwritten, b becomes a. Returns the
// smallest pivot: the solution holds only where it is positive.
inline floatv solve(floatv* A, floatv* b) {
  floatv least = (floatv)(1e30f);
#pragma unroll
  for (int j = 0; j < 10; ++j) {
    floatv d = A[AT(j, j)];
#pragma unroll
    for (int k = 0; k < j; ++k) d -= A[AT(j, k)] * A[AT(j, k)];
    least = smaller(d, least);
    const floatv inverse = 1.0f / sqrt(larger(d, (floatv)(1e-30f)));
    A[AT(j, j)] = inverse;
#pragma unroll
    for (int i = j + 1; i < 10; ++i) {
      floatv s = A[AT(i, j)];
#pragma unroll
      for (int k = 0; k < j; ++k) s -= A[AT(i, k)] * A[AT(j, k)];
      A[AT(i, j)] = s * inverse;
    }
  }
#pragma unroll
  for (int i = 0; i < 10; ++i) {
    floatv s = b[i];
#pragma unroll
    for (int k = 0; k < i; ++k) s -= A[AT(i, k)] * b[k];
    b[i] = s * A[AT(i, i)];
  }
#pragma unroll
  for (int i = 9; i >= 0; --i) {
    floatv s = b[i];
#pragma unroll
    for (int k = i + 1; k < 10; ++k) s -= A[AT(k, i)] * b[k];
    b[i] = s * A[AT(i, i)];
  }
  return least;
}

// The quadric a (in: its right-hand side) of the sums in m. Returns the smallest pivot, see solve.
inline floatv quadric_of(const floatv* m, floatv* a, const floatv ridge) {
  floatv A[55];
#pragma unroll
  for (int k = 0; k < 55; ++k) A[k] = plain_zero(m[kProduct[k]]);  // see PRODUCTS
#pragma unroll
  for (int k = 0; k < 10; ++k) a[k] = plain_zero(a[k]);
  // The ridge pulls the quadric towards a plane. The cross terms count half, which makes it the
  // squared norm of the quadratic form's matrix and independent of the axes.
  const floatv total = m[M_1] * (1.0f / 3.0f);
#pragma unroll
  for (int k = 0; k < 10; ++k) {
    const float share = k < 4 ? 0.0f : k < 7 ? 1.0f : 0.5f;
    A[AT(k, k)] += total * (share * ridge + 1e-6f);
  }
  return solve(A, a);
}
