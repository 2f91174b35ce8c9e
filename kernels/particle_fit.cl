// particle_fit.cl: the weights and normals of fits around every visible particle, between the
// passes of fit.cl (paper 2.3, with a support of fixed radius instead of a merged group, so that
// nothing changes abruptly from frame to frame; docs/method.md).
//
// A fit is a lane of fit.cl's batches: slot k of lane l of batch b lies at first[b] + 8 k + l. The
// slots name the neighbours, the particle itself among them; -1 is an unused slot, behind those in
// use. A work-item takes WIDTH lanes of one batch.

// The quadratic B-spline on [0, 1).
inline floatv spline(const floatv x) {
  const floatv y = 1.5f * x;
  return SELECT(0.5f * (1.5f - y) * (1.5f - y), 0.75f - y * y, y < 0.5f);
}

// A quadric through a particle at (x, y, z) from it.
inline floatv evaluate(const floatv* c, const floatv x, const floatv y, const floatv z) {
  return c[0] + (c[1] + c[4] * x + c[7] * y) * x + (c[2] + c[5] * y + c[8] * z) * y +
         (c[3] + c[6] * z + c[9] * x) * z;
}

// Loads WIDTH particle indices; lanes that are not in use (-1) get the first particle.
inline intv load_used(global const int* index, int* at) {
  int used[WIDTH];
#pragma unroll
  for (int k = 0; k < WIDTH; ++k) {
    const int i = index[k];
    used[k] = i >= 0;
    at[k] = max(i, 0);
  }
#if WIDTH == 1
  return used[0];
#else
  return LOADI(used) != 0;
#endif
}

// A particle's record is 8 floats: x, y, z (particle radii), u, unit normal; the last is not used.
typedef struct {
  floatv x, y, z, u, nx, ny, nz;
} Particles;

inline Particles load_particles(global const float* record, const int* at) {
  Particles p;
#if WIDTH == 8
  float8 r[8], lo[4], hi[4];
#pragma unroll
  for (int k = 0; k < 8; ++k) r[k] = vload8(at[k], record);
#pragma unroll
  for (int k = 0; k < 4; ++k) {  // transposed in three steps: pairs, fours, eights
    const float8 a = r[2 * k], b = r[2 * k + 1];
    lo[k] = (float8)(a.s0, b.s0, a.s1, b.s1, a.s4, b.s4, a.s5, b.s5);
    hi[k] = (float8)(a.s2, b.s2, a.s3, b.s3, a.s6, b.s6, a.s7, b.s7);
  }
  const float8 x0 = (float8)(lo[0].s01, lo[1].s01, lo[0].s45, lo[1].s45);
  const float8 x1 = (float8)(lo[2].s01, lo[3].s01, lo[2].s45, lo[3].s45);
  const float8 y0 = (float8)(lo[0].s23, lo[1].s23, lo[0].s67, lo[1].s67);
  const float8 y1 = (float8)(lo[2].s23, lo[3].s23, lo[2].s67, lo[3].s67);
  const float8 z0 = (float8)(hi[0].s01, hi[1].s01, hi[0].s45, hi[1].s45);
  const float8 z1 = (float8)(hi[2].s01, hi[3].s01, hi[2].s45, hi[3].s45);
  p.x = (float8)(x0.lo, x1.lo);
  p.y = (float8)(y0.lo, y1.lo);
  p.z = (float8)(z0.lo, z1.lo);
  p.u = (float8)(hi[0].s23, hi[1].s23, hi[2].s23, hi[3].s23);
  p.nx = (float8)(x0.hi, x1.hi);
  p.ny = (float8)(y0.hi, y1.hi);
  p.nz = (float8)(z0.hi, z1.hi);
#else
  float lane[7][WIDTH];
  for (int k = 0; k < WIDTH; ++k)
    for (int row = 0; row < 7; ++row) lane[row][k] = record[8 * at[k] + row];
  p.x = LOADF(lane[0]);
  p.y = LOADF(lane[1]);
  p.z = LOADF(lane[2]);
  p.u = LOADF(lane[3]);
  p.nx = LOADF(lane[4]);
  p.ny = LOADF(lane[5]);
  p.nz = LOADF(lane[6]);
#endif
  return p;
}

// Weight of neighbour j in the fit around particle i at distance l with normals n_i, n_j:
//   u_j B(l / rho) exp(-2 (1 - n_i.n_j) / sigma^2) m,
// in the first pass, and where the last one gave no fit, m = exp(-h^2 / (h_0 + h_1 l^2)^2) with the
// height h of j over i's tangent plane; later m = exp(-r^2 / tau^2) for a neighbour that lies r
// behind the surface of the pass before. Fits of fewer than three neighbours get no weights.
kernel void weigh_neighbours(
    global const float* record,     // [n][8] of the particles
    global const int* particle,     // [lanes] centre of the lane's fit, -1: unused
    global const int* neighbour,    // [slots]
    global const int* first,        // [batches]
    global const int* length,       // [batches]
    global const float* support,    // [lanes] rho, particle radii
    global const float* quadric,    // [10][lanes] of the pass before, through the particles
    global const float* quality,    // [2][lanes] negative: no fit
    global float* points,           // [7][slots] q = (x_j - x_i) / rho; n_j; weight
    const int slots, const int lanes, const int pass,
    const float4 options) {  // 2 / sigma^2; tau and h_0, particle radii; h_1, 1 / particle radii
  const int lane = get_global_id(0) * WIDTH;
  if (lane >= lanes) return;
  int i[WIDTH], j[WIDTH];
  const intv lane_used = load_used(particle + lane, i);
  const floatv none = (floatv)(0.0f);
  const Particles own = load_particles(record, i);
  intv refit = (intv)(0);
  floatv c[10];
#pragma unroll
  for (int k = 0; k < 10; ++k) c[k] = none;
  if (pass > 0) {
    refit = LOADF(quality + lane) >= 0.0f;
#pragma unroll
    for (int k = 0; k < 10; ++k) c[k] = SELECT(none, LOADF(quadric + k * lanes + lane), refit);
  }
  const floatv inverse_rho = 1.0f / LOADF(support + lane);
  const float inverse_tau = 1.0f / options.y;
  const int begin = first[lane / 8] + lane % 8, count = length[lane / 8];
  intv used = (intv)(0);
  for (int k = 0; k < count; ++k) {
    const int slot = begin + 8 * k;
    const intv there = load_used(neighbour + slot, j) & lane_used;
    const Particles p = load_particles(record, j);
    const floatv x = p.x - own.x, y = p.y - own.y, z = p.z - own.z;
    const floatv squared = x * x + y * y + z * z;
    const floatv turned = fmin(own.nx * p.nx + own.ny * p.ny + own.nz * p.nz - 1.0f, none);
    const floatv near = p.u * spline(fmin(sqrt(squared) * inverse_rho, (floatv)(1.0f))) *
                        exp_negative(options.x * turned);
    floatv weight = none;
    if (ANY(!refit)) {
      const floatv h = x * own.nx + y * own.ny + z * own.nz;
      const floatv width = options.z + options.w * squared;
      weight = fmax(exp_negative(-(h * h) / (width * width)), (floatv)(1e-5f));
    }
    if (ANY(refit)) {
      const floatv behind = fmax(-evaluate(c, x, y, z), none) * inverse_tau;
      weight = SELECT(weight, fmax(exp_negative(-behind * behind), (floatv)(1e-4f)), refit);
    }
    const intv counts = there & (near >= 1e-6f);
    used += SELECT((intv)(0), (intv)(1), counts);
    STOREF(x * inverse_rho, points + slot);
    STOREF(y * inverse_rho, points + slots + slot);
    STOREF(z * inverse_rho, points + 2 * slots + slot);
    STOREF(p.nx, points + 3 * slots + slot);
    STOREF(p.ny, points + 4 * slots + slot);
    STOREF(p.nz, points + 5 * slots + slot);
    STOREF(SELECT(none, near * weight, counts), points + 6 * slots + slot);
  }
  if (!ANY(used < 3)) return;
  for (int k = 0; k < count; ++k) {
    global float* weight = points + 6 * slots + begin + 8 * k;
    STOREF(SELECT(LOADF(weight), none, used < 3), weight);
  }
}

// Turns each particle's normal to its quadric's gradient at the particle; the side stays.
kernel void turn_normals(global const int* particle, global const float* quadric,
                         global const float* quality,
                         global float* record,  // [n][8] normals in and out
                         const int lanes) {
  const int lane = get_global_id(0);
  if (lane >= lanes) return;
  const int i = particle[lane];
  if (i < 0 || quality[lane] < 0.0f) return;
  const float x = quadric[lanes + lane], y = quadric[2 * lanes + lane],
              z = quadric[3 * lanes + lane];
  global float* normal = record + 8 * i + 4;
  const float side = normal[0] * x + normal[1] * y + normal[2] * z;
  const float size = sqrt(x * x + y * y + z * z);
  if (!(size > 0.0f)) return;
  const float scale = (side < 0.0f ? -1.0f : 1.0f) / size;
  normal[0] = x * scale;
  normal[1] = y * scale;
  normal[2] = z * scale;
}

// How far a fit can be relied on, three rows:
// - e, how far its surroundings are one sheet: with q = u_j W(l / reach), W Wendland's function, the
//   share of the neighbours whose normals agree,
//     e = max(0.005, smoothstep(0.7, 1.0, sum of q smoothstep(0.85, 0.95, n_i.n_j) / sum of q);
// - the RMS distance (at most 2) of all neighbours from the fit, with the weights of its first pass
//   but for the height;
// - the number of its neighbours, each by its weight u.
kernel void measure_edges(global const float* record, global const int* particle,
                          global const int* neighbour, global const int* first,
                          global const int* length,
                          global const float* support,  // [lanes] rho, particle radii
                          global const float* quadric,  // [10][lanes] through the particles
                          global float* rows,           // [3][lanes] e; distance, radii; number
                          const int lanes,
                          const float falloff,  // 2 / sigma^2
                          const float reach) {  // particle radii
  const int lane = get_global_id(0) * WIDTH;
  if (lane >= lanes) return;
  int i[WIDTH], j[WIDTH];
  load_used(particle + lane, i);
  const floatv none = (floatv)(0.0f), one = (floatv)(1.0f);
  const Particles own = load_particles(record, i);
  const int begin = first[lane / 8] + lane % 8, count = length[lane / 8];
  const floatv inverse_rho = 1.0f / LOADF(support + lane);
  floatv c[10];
#pragma unroll
  for (int k = 0; k < 10; ++k) c[k] = LOADF(quadric + k * lanes + lane);
  floatv near = none, agree = none, weight = none, squares = none, number = none;
  for (int k = 0; k < count; ++k) {
    const intv there = load_used(neighbour + begin + 8 * k, j);
    const Particles p = load_particles(record, j);
    const floatv x = p.x - own.x, y = p.y - own.y, z = p.z - own.z;
    const floatv u = SELECT(none, p.u, there);
    const floatv l = sqrt(x * x + y * y + z * z);
    const floatv same = own.nx * p.nx + own.ny * p.ny + own.nz * p.nz;
    const floatv apart = clamp(evaluate(c, x, y, z), -2.0f, 2.0f);
    const floatv w =
        u * spline(fmin(l * inverse_rho, one)) * exp_negative(falloff * fmin(same - 1.0f, none));
    weight += w;
    squares += w * apart * apart;
    number += u;
    const floatv d = l / reach;
    const floatv r = (1.0f - d) * (1.0f - d);
    const floatv q = SELECT(none, u * r * r * (4.0f * d + 1.0f), d < 1.0f);
    near += q;
    agree += q * smooth_step(0.85f, 0.95f, same);
  }
  STOREF(SELECT(one, fmax((floatv)(0.005f), smooth_step(0.7f, 1.0f, agree / near)), near > 0.0f),
         rows + lane);
  STOREF(SELECT((floatv)(2.0f), sqrt(squares / weight), weight > 0.0f), rows + lanes + lane);
  STOREF(number, rows + 2 * lanes + lane);
}
