// neighbours.cl: the particles around fits, lane by lane, and what they weigh (paper 2.3).
//
// A fit is a lane of a batch: slot k of lane l of batch b lies at first[b] + FIT_BATCH k + l. The slots
// name the neighbours, the particle itself among them. A work-item takes WIDTH lanes of one
// batch. Particles are records of four values: x, y, z (particle radii), u; the unit normal, and how
// round the surface is there (set_roundness). Behind the last stands nobody, whose u is 0, for slots and lanes that are not in use.
//
// uses: fit.cl

// Neighbours whose weights are computed before any is added: a weight takes long, one step after
// another, and the sums leave no register for it. A work-item with one fit has no room for them.
#if WIDTH == 1
#define CHUNK 1
#else
#define CHUNK 32
#endif

// What neighbours weigh by their distance, the square of its share of the support; they end at
// FIT_REACH. Epanechnikov's function needs seven tenths of the neighbours that a quadratic B-spline has
// which ends at the support, for weights that lie as far out.
inline floatv parabola(const floatv squared) {
  return larger(fma((floatv)(-1.0f / (FIT_REACH * FIT_REACH)), squared, (floatv)(1.0f)), (floatv)(0.0f));
}

#if WIDTH >= 8
// Eight records of four values, row by row. Both halves are transposed at once, in two steps.
INLINED void load_eight(global const float4* record, global const int* at, float8* row) {
  float8 r[4];
#pragma unroll
  for (int k = 0; k < 4; ++k) r[k] = (float8)(record[at[k]], record[at[k + 4]]);
  const float8 xy0 = (float8)(r[0].s0, r[1].s0, r[0].s1, r[1].s1, r[0].s4, r[1].s4, r[0].s5, r[1].s5);
  const float8 zw0 = (float8)(r[0].s2, r[1].s2, r[0].s3, r[1].s3, r[0].s6, r[1].s6, r[0].s7, r[1].s7);
  const float8 xy1 = (float8)(r[2].s0, r[3].s0, r[2].s1, r[3].s1, r[2].s4, r[3].s4, r[2].s5, r[3].s5);
  const float8 zw1 = (float8)(r[2].s2, r[3].s2, r[2].s3, r[3].s3, r[2].s6, r[3].s6, r[2].s7, r[3].s7);
  row[0] = (float8)(xy0.s01, xy1.s01, xy0.s45, xy1.s45);
  row[1] = (float8)(xy0.s23, xy1.s23, xy0.s67, xy1.s67);
  row[2] = (float8)(zw0.s01, zw1.s01, zw0.s45, zw1.s45);
  row[3] = (float8)(zw0.s23, zw1.s23, zw0.s67, zw1.s67);
}
#endif

// Loads WIDTH records of four values, row by row. Inlined: loops would wait for a call.
INLINED void load_records(global const float4* record, global const int* at, floatv* row) {
#if WIDTH == 16
  float8 low[4], high[4];
  load_eight(record, at, low);
  load_eight(record, at + 8, high);
#pragma unroll
  for (int v = 0; v < 4; ++v) row[v] = (float16)(low[v], high[v]);
#elif WIDTH == 8
  load_eight(record, at, row);
#else
  float lane[4][WIDTH];
  for (int k = 0; k < WIDTH; ++k) {
    const float4 r = record[at[k]];
    lane[0][k] = r.x;
    lane[1][k] = r.y;
    lane[2][k] = r.z;
    lane[3][k] = r.w;
  }
  for (int v = 0; v < 4; ++v) row[v] = LOADF(lane[v]);
#endif
}

typedef struct {
  floatv x, y, z, u, nx, ny, nz;
} Particles;

inline Particles load_particles(global const float4* place, global const float4* normal,
                                global const int* at) {
  floatv p[4], n[4];
  load_records(place, at, p);
  load_records(normal, at, n);
  const Particles particles = {p[0], p[1], p[2], p[3], n[0], n[1], n[2]};
  return particles;
}

// Neighbours as points: weight u, position, normal. In a loop of its own: what lies anywhere is loaded
// while little is stored.
inline void gather_points(global const float4* place, global const float4* normal,
                          global const int* at, const int count, Point* point) {
  for (int k = 0; k < count; ++k) {
    floatv p[4], n[4];
    load_records(place, at + FIT_BATCH * k, p);
    load_records(normal, at + FIT_BATCH * k, n);
    const Point one = {p[3], p[0], p[1], p[2], n[0], n[1], n[2]};
    point[k] = one;
  }
}

// Adds the square of a distance to those a residual is made of. Weights are one-sided: particles of
// the layer below do not count.
inline void add_distance(const floatv f, const floatv weight, const floatv inverse_tau,
                         floatv* squares, floatv* total) {
  const floatv behind = larger(-f, (floatv)(0.0f)) * inverse_tau;
  const floatv w = weight * larger(exp_negative(-behind * behind), (floatv)(1e-4f));
  *squares += w * f * f;
  *total += w;
}

// What a fit has of its roundness (roundness.cl), each between that of two sheets and that of one
// quadric: 2 / sigma^2 and tau.
inline floatv falloff_of(const floatv roundness, const FitModel model) {
  const floatv sigma = fma(roundness, (floatv)(model.sigma_gain), (floatv)(model.sigma));
  return 2.0f / (sigma * sigma);
}
inline floatv tau_of(const floatv roundness, const FitModel model) {
  return fma(roundness, (floatv)(model.tau_gain), (floatv)(model.tau));
}

// The product of a normal and a quadric's unit gradient at a place.
inline floatv along_slope(const floatv* c, const floatv x, const floatv y, const floatv z,
                          const floatv nx, const floatv ny, const floatv nz) {
  floatv gx, gy, gz;
  slope_at(c, x, y, z, &gx, &gy, &gz);
  const floatv size = sqrt(larger(gx * gx + gy * gy + gz * gz, (floatv)(1e-12f)));
  return (gx * nx + gy * ny + gz * nz) / size;
}

// How far a fit's surroundings are one sheet, from the weights of all particles elsewhere and of those
// that agree; with a hundredth of the particle's own u, so that it goes on steadily when the
// first one comes near.
inline floatv edge_of(const floatv u, const floatv near, const floatv agree) {
  const floatv little = 0.01f * u, share = (little + agree) / (little + near);
  return SELECT((floatv)(1.0f), fmax((floatv)(0.005f), smooth_step(0.3f, 0.9f, share)),
                u + near > 0.0f);
}

// From no to all of a fit's normal holding: by the weights of the particles elsewhere, and of those that
// agree within a narrow angle, the particle itself among them. A share of `low` is none yet.
inline floatv firmness_of(const floatv u, const floatv near, const floatv firm, const float low) {
  return SELECT((floatv)(0.0f), smooth_step(low, 1.0f, (u + firm) / (u + near)), u + near > 0.0f);
}

// u_j W(l / reach), W Wendland's function, of a particle elsewhere.
inline floatv share_of(const floatv u, const floatv l, const float reach) {
  const floatv d = l / reach;
  const floatv r = (1.0f - d) * (1.0f - d);
  return SELECT((floatv)(0.0f), u * r * r * (4.0f * d + 1.0f), (d > 0.0f) & (d < 1.0f));
}

// Puts the normals of WIDTH lanes, and how much they count, where their fits are in a sheet.
inline void put_in_sheet(const Particles own, const floatv counts, const int* at, const intv used,
                         const int fits, global float* toward, global float* share) {
  scatter_float(own.nx, toward, at, used);
  scatter_float(own.ny, toward + fits, at, used);
  scatter_float(own.nz, toward + 2 * fits, at, used);
  scatter_float(counts, share, at, used);
}
