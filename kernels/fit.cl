// fit.cl: one implicit quadric per group by weighted least squares (paper 2.3, Eq. 2).
//
//   f(q) = a0 + a1 x + a2 y + a3 z + a4 xx + a5 yy + a6 zz + a7 xy + a8 yz + a9 zx
//
// in q = (p - centre) / R. As printed, Eq. 2 is solved by f = z whatever the points; here every
// point gives three rows instead, f(q) = 0 and f(q +- delta n) = +- delta, which fix the scale of f
// to a distance (docs/method.md). A group with few points gives the rows f(q) = 0 and
// grad f = n, weighted by lambda, instead (a Hermite fit). Later passes weigh a point that lies r
// behind the surface of the pass before by exp(-r^2 / tau^2): particles of the layer below lose
// their say.
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

// Adds w times (grad of each basis function at (x, y, z)) . (nx, ny, nz) to b.
inline void add_basis_slope(floatv* b, const floatv w, const floatv x, const floatv y,
                            const floatv z, const floatv nx, const floatv ny, const floatv nz) {
  b[1] += w * nx;  b[2] += w * ny;  b[3] += w * nz;
  b[4] += 2.0f * w * nx * x;  b[5] += 2.0f * w * ny * y;  b[6] += 2.0f * w * nz * z;
  b[7] += w * (nx * y + ny * x);  b[8] += w * (ny * z + nz * y);  b[9] += w * (nz * x + nx * z);
}

inline floatv evaluate(const floatv* a, const floatv x, const floatv y, const floatv z) {
  return a[0] + (a[1] + a[4] * x + a[7] * y) * x + (a[2] + a[5] * y + a[8] * z) * y +
         (a[3] + a[6] * z + a[9] * x) * z;
}

// Adds k times the sum of (grad basis r) . (grad basis s), which are moments of degree <= 2.
inline void add_slopes(floatv* A, const floatv* m, const floatv k) {
  A[AT(1, 1)] += k * m[M_1];  A[AT(2, 2)] += k * m[M_1];  A[AT(3, 3)] += k * m[M_1];
  A[AT(4, 1)] += k * 2.0f * m[M_X];  A[AT(7, 1)] += k * m[M_Y];  A[AT(9, 1)] += k * m[M_Z];
  A[AT(5, 2)] += k * 2.0f * m[M_Y];  A[AT(7, 2)] += k * m[M_X];  A[AT(8, 2)] += k * m[M_Z];
  A[AT(6, 3)] += k * 2.0f * m[M_Z];  A[AT(8, 3)] += k * m[M_Y];  A[AT(9, 3)] += k * m[M_X];
  A[AT(4, 4)] += k * 4.0f * m[M_XX];  A[AT(7, 4)] += k * 2.0f * m[M_XY];
  A[AT(9, 4)] += k * 2.0f * m[M_ZX];
  A[AT(5, 5)] += k * 4.0f * m[M_YY];  A[AT(7, 5)] += k * 2.0f * m[M_XY];
  A[AT(8, 5)] += k * 2.0f * m[M_YZ];
  A[AT(6, 6)] += k * 4.0f * m[M_ZZ];  A[AT(8, 6)] += k * 2.0f * m[M_YZ];
  A[AT(9, 6)] += k * 2.0f * m[M_ZX];
  A[AT(7, 7)] += k * (m[M_XX] + m[M_YY]);  A[AT(8, 7)] += k * m[M_ZX];  A[AT(9, 7)] += k * m[M_YZ];
  A[AT(8, 8)] += k * (m[M_YY] + m[M_ZZ]);  A[AT(9, 8)] += k * m[M_XY];
  A[AT(9, 9)] += k * (m[M_ZZ] + m[M_XX]);
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
    global const float* points,   // [7][slots] x, y, z of q; normal x, y, z; weight
    global const int* first,      // [batches] first slot
    global const int* length,     // [batches] slots a lane
    global const float* scale,    // [batches * 8] R, particle radii
    global const float* hermite,  // [batches * 8] 1: few points, Hermite rows; else 0
    global float* quadric,        // [10][batches * 8] f in particle radii from the centre, eye
                                  // axes, divided by |grad f(centre)|, offset subtracted
    global float* quality,        // [2][batches * 8] RMS residual, particle radii, negative where
                                  // there is no fit; |grad f(centre)|
    const int slots, const int lanes,
    const float8 options) {  // off-surface distance, tau, offset (particle radii); ridge; Hermite
                             // ridge and lambda; robust passes
  const int item = get_global_id(0) * WIDTH;
  if (item >= lanes) return;
  const int batch = item >> 3, lane = item & 7;  // eight lanes a batch
  const int begin = first[batch] + lane, count = length[batch];
  const floatv R = LOADF(scale + item), few = LOADF(hermite + item);
  const floatv many = 1.0f - few;
  const floatv delta = options.s0 / R;
  const floatv inverse_tau = R / options.s1;
  const floatv ridge = many * options.s3 + few * options.s4;
  const int passes = (int)options.s6;

  floatv a[10];
  floatv slope = (floatv)(1.0f), least = (floatv)(0.0f);
#pragma unroll
  for (int k = 0; k < 10; ++k) a[k] = (floatv)(0.0f);

  for (int pass = 0; pass <= passes; ++pass) {
    floatv m[MOMENTS], b[10];
#pragma unroll
    for (int k = 0; k < MOMENTS; ++k) m[k] = (floatv)(0.0f);
#pragma unroll
    for (int k = 0; k < 10; ++k) b[k] = (floatv)(0.0f);
    for (int k = 0; k < count; ++k) {
      global const float* p = points + begin + 8 * k;
      const floatv x = LOADF(p), y = LOADF(p + slots), z = LOADF(p + 2 * slots);
      const floatv nx = LOADF(p + 3 * slots), ny = LOADF(p + 4 * slots), nz = LOADF(p + 5 * slots);
      floatv w = LOADF(p + 6 * slots);
      if (pass > 0) {
        const floatv behind = fmax(-evaluate(a, x, y, z) / slope, (floatv)(0.0f)) * inverse_tau;
        w *= fmax(exp_negative(-behind * behind), (floatv)(1e-4f));
      }
      add_moments(m, w, x, y, z);
      const floatv off = w * many;
      const floatv dx = delta * nx, dy = delta * ny, dz = delta * nz;
      add_moments(m, off, x + dx, y + dy, z + dz);
      add_moments(m, off, x - dx, y - dy, z - dz);
      add_basis(b, off * delta, x + dx, y + dy, z + dz);
      add_basis(b, -off * delta, x - dx, y - dy, z - dz);
      add_basis_slope(b, w * few * options.s5, x, y, z, nx, ny, nz);
    }
    floatv A[55];
#pragma unroll
    for (int k = 0; k < 55; ++k) A[k] = m[kProduct[k]];
    add_slopes(A, m, few * options.s5);
    // The ridge pulls the quadric towards a plane. The cross terms count half, which makes it the
    // squared norm of the quadratic form's matrix and independent of the axes.
    const floatv total = m[M_1] * (1.0f / (1.0f + 2.0f * many));
#pragma unroll
    for (int k = 0; k < 10; ++k) {
      const float share = k < 4 ? 0.0f : k < 7 ? 1.0f : 0.5f;
      A[AT(k, k)] += total * (share * ridge + 1e-6f);
    }
    least = solve(A, b);
#pragma unroll
    for (int k = 0; k < 10; ++k) a[k] = b[k];
    slope = sqrt(fmax(a[1] * a[1] + a[2] * a[2] + a[3] * a[3], (floatv)(1e-12f)));
  }

  // The residual, with the weights of a further pass.
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
  STOREF(a[0] * R / slope - options.s2, quadric + item);
#pragma unroll
  for (int k = 1; k < 4; ++k) STOREF(a[k] / slope, quadric + k * lanes + item);
#pragma unroll
  for (int k = 4; k < 10; ++k) STOREF(a[k] / (slope * R), quadric + k * lanes + item);
}
