// fit.cl: one implicit quadric per group by weighted least squares (paper 2.3, Eq. 2).
//
//   f(q) = a0 + a1 x + a2 y + a3 z + a4 xx + a5 yy + a6 zz + a7 xy + a8 yz + a9 zx
//
// in q = (p - centre) / R. As printed, Eq. 2 is solved by f = z whatever the points; here every
// point gives three rows instead, f(q) = 0 and f(q +- delta n) = +- delta, which fix the scale of f
// to a distance (docs/method.md).
//
// Everything is sums of one fixed order. The normal matrix is not summed entry by entry: its 55
// entries are 35 different moments of degree <= 4.
//
// Groups come in batches of eight, point slots interleaved: slot k of lane l of batch b lies at
// first[b] + 8 k + l. A work-item takes WIDTH lanes of one batch; unused slots have weight 0.

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

// Adds w times every monomial of (x, y, z) to the moments.
inline void add_moments(floatv* m, const floatv w, const floatv x, const floatv y, const floatv z) {
  const floatv wx = w * x, wy = w * y, wz = w * z;
  const floatv wxx = wx * x, wyy = wy * y, wzz = wz * z, wxy = wx * y, wyz = wy * z, wzx = wz * x;
  const floatv xx = x * x, yy = y * y, zz = z * z, xy = x * y, yz = y * z, zx = z * x;
  m[M_1] += w;
  m[M_X] += wx;  m[M_Y] += wy;  m[M_Z] += wz;
  m[M_XX] += wxx;  m[M_YY] += wyy;  m[M_ZZ] += wzz;
  m[M_XY] += wxy;  m[M_YZ] += wyz;  m[M_ZX] += wzx;
  m[M_XXX] += wxx * x;  m[M_YYY] += wyy * y;  m[M_ZZZ] += wzz * z;
  m[M_XXY] += wxx * y;  m[M_XXZ] += wxx * z;  m[M_YYX] += wyy * x;
  m[M_YYZ] += wyy * z;  m[M_ZZX] += wzz * x;  m[M_ZZY] += wzz * y;
  m[M_XYZ] += wxy * z;
  m[M_XXXX] += wxx * xx;  m[M_YYYY] += wyy * yy;  m[M_ZZZZ] += wzz * zz;
  m[M_XXXY] += wxx * xy;  m[M_XXXZ] += wxx * zx;  m[M_YYYX] += wyy * xy;
  m[M_YYYZ] += wyy * yz;  m[M_ZZZX] += wzz * zx;  m[M_ZZZY] += wzz * yz;
  m[M_XXYY] += wxx * yy;  m[M_YYZZ] += wyy * zz;  m[M_ZZXX] += wzz * xx;
  m[M_XXYZ] += wxx * yz;  m[M_YYZX] += wyy * zx;  m[M_ZZXY] += wzz * xy;
}

// Adds w times the ten basis functions at (x, y, z) to b.
inline void add_basis(floatv* b, const floatv w, const floatv x, const floatv y, const floatv z) {
  const floatv wx = w * x, wy = w * y, wz = w * z;
  b[0] += w;
  b[1] += wx;  b[2] += wy;  b[3] += wz;
  b[4] += wx * x;  b[5] += wy * y;  b[6] += wz * z;
  b[7] += wx * y;  b[8] += wy * z;  b[9] += wz * x;
}

inline floatv evaluate(const floatv* a, const floatv x, const floatv y, const floatv z) {
  return a[0] + (a[1] + a[4] * x + a[7] * y) * x + (a[2] + a[5] * y + a[8] * z) * y +
         (a[3] + a[6] * z + a[9] * x) * z;
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
    least = fmin(least, d);
    const floatv inverse = 1.0f / sqrt(fmax(d, (floatv)(1e-30f)));
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

kernel void fit_groups(
    global const float* points,  // [7][slots] x, y, z of q; normal x, y, z; weight
    global const int* first,     // [batches] first slot
    global const int* length,    // [batches] slots a lane
    global const float* scale,   // [batches * 8] R, particle radii
    global float* quadric,       // [10][batches * 8] f in particle radii from the centre, eye axes,
                                 // divided by |grad f(centre)|
    global float* quality,       // [2][batches * 8] RMS residual, particle radii, negative where
                                 // there is no fit; |grad f(centre)|
    const int slots, const int lanes,
    const float4 options) {  // off-surface distance and tau, particle radii; ridge; unused
  const int item = get_global_id(0) * WIDTH;
  if (item >= lanes) return;
  const int batch = item >> 3, lane = item & 7;  // eight lanes a batch
  const int begin = first[batch] + lane, count = length[batch];
  const floatv R = LOADF(scale + item);
  const floatv delta = options.x / R;
  const floatv inverse_tau = R / options.y;

  floatv m[MOMENTS], a[10];
#pragma unroll
  for (int k = 0; k < MOMENTS; ++k) m[k] = (floatv)(0.0f);
#pragma unroll
  for (int k = 0; k < 10; ++k) a[k] = (floatv)(0.0f);
  for (int k = 0; k < count; ++k) {
    global const float* p = points + begin + 8 * k;
    const floatv x = LOADF(p), y = LOADF(p + slots), z = LOADF(p + 2 * slots);
    const floatv nx = LOADF(p + 3 * slots), ny = LOADF(p + 4 * slots), nz = LOADF(p + 5 * slots);
    const floatv w = LOADF(p + 6 * slots);
    const floatv dx = delta * nx, dy = delta * ny, dz = delta * nz;
    add_moments(m, w, x, y, z);
    add_moments(m, w, x + dx, y + dy, z + dz);
    add_moments(m, w, x - dx, y - dy, z - dz);
    add_basis(a, w * delta, x + dx, y + dy, z + dz);
    add_basis(a, -w * delta, x - dx, y - dy, z - dz);
  }
  floatv A[55];
#pragma unroll
  for (int k = 0; k < 55; ++k) A[k] = m[kProduct[k]];
  // The ridge pulls the quadric towards a plane. The cross terms count half, which makes it the
  // squared norm of the quadratic form's matrix and independent of the axes.
  const floatv total = m[M_1] * (1.0f / 3.0f);
#pragma unroll
  for (int k = 0; k < 10; ++k) {
    const float share = k < 4 ? 0.0f : k < 7 ? 1.0f : 0.5f;
    A[AT(k, k)] += total * (share * options.z + 1e-6f);
  }
  const floatv least = solve(A, a);
  const floatv slope = sqrt(fmax(a[1] * a[1] + a[2] * a[2] + a[3] * a[3], (floatv)(1e-12f)));

  // The residual, with one-sided weights: particles of the layer below do not count.
  floatv sum = (floatv)(0.0f), weight = (floatv)(1e-30f);
  for (int k = 0; k < count; ++k) {
    global const float* p = points + begin + 8 * k;
    const floatv f = evaluate(a, LOADF(p), LOADF(p + slots), LOADF(p + 2 * slots)) / slope;
    const floatv behind = fmax(-f, (floatv)(0.0f)) * inverse_tau;
    const floatv w = LOADF(p + 6 * slots) * fmax(exp_negative(-behind * behind), (floatv)(1e-4f));
    sum += w * f * f;
    weight += w;
  }
  const floatv residual = R * sqrt(sum / weight);
  const floatv good = SELECT((floatv)(0.0f), (floatv)(1.0f),
                             (least > 0.0f) & (slope > 0.2f) & (slope < 5.0f));
  STOREF(good * (residual + 1.0f) - 1.0f, quality + item);
  STOREF(slope, quality + lanes + item);

  // From q to particle radii: f(X) = R f(q) / slope, so that |grad f(centre)| = 1.
  STOREF(a[0] * R / slope, quadric + item);
#pragma unroll
  for (int k = 1; k < 4; ++k) STOREF(a[k] / slope, quadric + k * lanes + item);
#pragma unroll
  for (int k = 4; k < 10; ++k) STOREF(a[k] / (slope * R), quadric + k * lanes + item);
}
