// particle_fit.cl: fits around every visible particle, in passes (paper 2.3, with a support of fixed
// radius instead of a merged group, so that nothing changes abruptly from frame to frame;
// docs/method.md).
//
// A fit is a lane of a batch: slot k of lane l of batch b lies at first[b] + BATCH k + l. The slots
// name the neighbours, the particle itself among them. A work-item takes WIDTH lanes of one
// batch. Particles are records of four values: x, y, z (particle radii), u; the unit normal, and how
// round the surface is there (set_roundness).
// Behind the last stands nobody, whose u is 0, for slots and lanes that are not in use.
//
// uses: fit.cl

#define BATCH 16  // lanes
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

// The quadratic B-spline on [0, 1), for trial fits.
inline floatv spline(const floatv x) {
  const floatv y = 1.5f * x;
  return SELECT(0.5f * (1.5f - y) * (1.5f - y), 0.75f - y * y, y < 0.5f);
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
    load_records(place, at + BATCH * k, p);
    load_records(normal, at + BATCH * k, n);
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
// quadric: 2 / sigma^2, tau, the distance of the off-surface rows and the ridge.
inline floatv falloff_of(const floatv roundness, const FitModel model) {
  const floatv sigma = fma(roundness, (floatv)(model.sigma_gain), (floatv)(model.sigma));
  return 2.0f / (sigma * sigma);
}
inline floatv tau_of(const floatv roundness, const FitModel model) {
  return fma(roundness, (floatv)(model.tau_gain), (floatv)(model.tau));
}
inline floatv off_surface_of(const floatv roundness, const FitModel model) {
  return fma(roundness, (floatv)(model.off_surface_gain), (floatv)(model.off_surface));
}
inline floatv ridge_of(const floatv roundness, const FitModel model) {
  return fma(roundness, (floatv)(model.ridge_gain), (floatv)(model.ridge));
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

// How round the surface is at the particles of WIDTH lanes.
inline floatv roundness_at(global const float4* normal, global const int* particle) {
  int at[WIDTH];
  STOREI(4 * LOADI(particle) + 3, at);
  return gather_float((global const float*)normal, at);
}

// The support of WIDTH lanes where noise does not explain the mean residual r of the sheet around:
// `full` times (noise / r)^2 at most, but no more than a share of `least` is taken.
inline floatv narrowed_support(const floatv widest, global const int* to, global const float* mean,
                               global const float* noise, const FitPass by) {
  int at[WIDTH];
  STOREI(max(LOADI(to), (intv)(0)), at);
  const floatv r = gather_float(mean, at), share = *noise / r;
  const floatv narrowed = by.full * clamp(share * share, (floatv)(by.least), (floatv)(1.0f));
  return SELECT(widest, smaller(narrowed, widest), (r > 0.0f) & (LOADI(to) >= 0));
}

// Puts the normals of WIDTH lanes, and how much they count, where their fits are in a sheet.
inline void put_in_sheet(const Particles own, const floatv counts, const int* at, const intv used,
                         const int fits, global float* toward, global float* share) {
  scatter_float(own.nx, toward, at, used);
  scatter_float(own.ny, toward + fits, at, used);
  scatter_float(own.nz, toward + 2 * fits, at, used);
  scatter_float(counts, share, at, used);
}

// The RMS of f over a fit's `count` neighbours, with f = rho f(q) / slope and q = X / rho.
INLINED floatv rms_of_fit(const floatv* a, const Particles own, const floatv rho, const floatv slope,
                          const floatv inverse_tau, global const float4* place,
                          global const int* neighbour, global const float* weight, const int count) {
  const floatv inverse_rho = 1.0f / rho, steep = rho / slope;
  floatv squares = (floatv)(0.0f), total = (floatv)(1e-30f);
  for (int k = 0; k < count; ++k) {
    floatv p[4];
    load_records(place, neighbour + BATCH * k, p);
    const floatv f = evaluate(a, (p[0] - own.x) * inverse_rho, (p[1] - own.y) * inverse_rho,
                              (p[2] - own.z) * inverse_rho) *
                     steep;
    add_distance(f, LOADF(weight + BATCH * k), inverse_tau, &squares, &total);
  }
  return sqrt(squares / total);
}

// From q to particle radii: f(X) = rho f(q) / slope, so that |grad f| = 1 at the particle. The linear
// terms of `a` become that gradient.
INLINED void store_quadric(floatv* a, const floatv rho, const floatv slope, global float* quadric,
                           const int lanes) {
  STOREF(a[0] * rho / slope, quadric);
#pragma unroll
  for (int k = 1; k < 4; ++k) {
    a[k] /= slope;
    STOREF(a[k], quadric + k * lanes);
  }
#pragma unroll
  for (int k = 4; k < 10; ++k) STOREF(a[k] / (slope * rho), quadric + k * lanes);
}

// A particle's normal becomes that of its fit, on the side on which it was, where the fit is good.
INLINED void turn_normal(const floatv* a, const intv good, Particles* own) {
  const floatv side = own->nx * a[1] + own->ny * a[2] + own->nz * a[3];
  const floatv size = sqrt(a[1] * a[1] + a[2] * a[2] + a[3] * a[3]);
  const floatv scale = SELECT((floatv)(1.0f), (floatv)(-1.0f), side < 0.0f) / size;
  own->nx = SELECT(own->nx, a[1] * scale, good);
  own->ny = SELECT(own->ny, a[2] * scale, good);
  own->nz = SELECT(own->nz, a[3] * scale, good);
}

// One pass. The first one sets supports and roundness, a later one may narrow the supports. Neighbour j
// weighs in the fit around particle i at distance l with normals n_i, n_j:
//   u_j max(0, 1 - (l / (FIT_REACH rho))^2) exp(-2 (1 - n_i.n_j) / sigma^2) m,
// nothing where n_i.n_j < -1/2. In the first pass, and where the last one gave no fit, m = exp(-h^2 /
// (h_0 + h_1 l^2)^2), at least 1e-5, with the height h of j over i's tangent plane; later m = exp(-r^2 /
// tau^2), at least 1e-4, for a neighbour that lies r behind the surface of the pass before.
//
// A firm fit compares a neighbour's normal with its own surface there, so that a bend is no difference,
// and can be strict: later passes take, with the firmness F of a fit (firmness_of), w = F (1 - roundness)
// and g the unit gradient of the pass before at x_j,
//   (1 + sharp w) (1 + 3 w p) ((1 - w) (1 - n_i.n_j) + w max(0, 1 - g.n_j - leeway))   for   1 - n_i.n_j,
// with how far the neighbour lies in front, p, up to 1; and for r also ahead F times as far. What both
// turns away and lies in front is of the other sheet of a concave crease. All exponents are at least
// -25, else weights that count for nothing make subnormal numbers, with which processors are slow.
// Such a sheet makes no bevel of a fit, so F leaves out what rises over the tangent plane, from 0 to all
// of it at a radius, as far as the fit is not round. Fits of groups are not firm: most particles around
// them have no fit, and normals as rough as they came. Particles of fewer than three neighbours get no
// fit. Each particle's normal turns to its quadric's gradient at the particle; the side stays.
//
// Of the pass before, and out: quadric, [10][lanes] f through the particle, from it along the eye axes,
// particle radii, divided by |grad f|; residual, [lanes] negative where there is no fit, and where one
// pass is to come the RMS of f. Out where one is to come or none: weight, [slots]. Where one is to come,
// the fits go into their sheet, with the RMS; those of residual 0 count nothing.
//
// Several trials, each as the range's second dimension says, have all that lanes have and `turned` of
// their own, one behind the other; their weights are not kept, and go by the B-spline of l / rho.
kernel void fit_particles(
    global const float4* place,                  // [n + 1] of the particles
    global const float4* normal,                 // [n + 1] as the pass before left them
    AROUND(particle, influence, neighbour, first, length),  // a lane's fit; its neighbours
    FITTED(support, quadric, residual, weight),
    global float* turned,  // [n + 1][4] normals out
    IN_SHEET(to, toward, share, value), NARROWED(mean, noise), const FitPass by) {
  const int lanes = by.lanes, nobody = by.nobody, left = by.left;
  const int measures_firmness = left > 0 && !by.tries && !by.groups;  // for the next pass
  const FitModel model = by.model;
  const int lane = get_global_id(0) * WIDTH, trial = get_global_id(1);
  if (lane >= lanes) return;
  support += 3 * lanes * trial;
  quadric += 10 * lanes * trial;
  residual += lanes * trial;
  turned += 4 * (nobody + 1) * trial;
  const floatv none = (floatv)(0.0f);
  Particles own = load_particles(place, normal, particle + lane);
  intv refit = (intv)(0);
  floatv c[10];
#pragma unroll
  for (int k = 0; k < 10; ++k) c[k] = none;
  if (by.done > 0) {
    refit = LOADF(residual + lane) >= 0.0f;
#pragma unroll
    for (int k = 0; k < 10; ++k) c[k] = SELECT(none, LOADF(quadric + k * lanes + lane), refit);
  }
  floatv rho, roundness;
  if (by.done == 0) {
    roundness = by.tries ? (floatv)(trial == 0 ? 1.0f : 0.0f) : roundness_at(normal, particle + lane);
    rho = fma(roundness, (floatv)(by.round_gain), (floatv)(by.full));
    STOREF(rho, support + lane);
    STOREF(roundness, support + lanes + lane);
  } else {
    rho = LOADF(support + lane);
    roundness = LOADF(support + lanes + lane);
  }
  if (by.narrows) {
    rho = narrowed_support(rho, to + lane, mean, noise, by);
    STOREF(rho, support + lane);
  }
  const floatv inverse_rho = 1.0f / rho;
  const floatv delta = off_surface_of(roundness, model) / rho;
  const floatv inverse_tau = 1.0f / tau_of(roundness, model);
  const int begin = first[lane / BATCH] + lane % BATCH, count = length[lane / BATCH];
  floatv firm = none, around = none, agree = none;  // the last two for the next pass
  if (by.done > 0 && !by.groups) firm = SELECT(none, LOADF(support + 2 * lanes + lane), refit);
  const floatv firmly = firm * (1.0f - roundness), ahead = by.ahead * firm;
  const floatv falloff = falloff_of(roundness, model) * fma(firmly, (floatv)(by.sharp), (floatv)(1.0f));
  floatv m[MOMENTS], a[10];
#pragma unroll
  for (int k = 0; k < MOMENTS; ++k) m[k] = none;
#pragma unroll
  for (int k = 0; k < 10; ++k) a[k] = none;
  intv used = (intv)(0);
  Point point[CHUNK];
  for (int from = 0; from < count; from += CHUNK) {
    const int points = min(CHUNK, count - from);
    gather_points(place, normal, neighbour + begin + BATCH * from, points, point);
    for (int k = 0; k < points; ++k) {
      const int slot = begin + BATCH * (from + k);
      const Point p = point[k];
      const floatv x = p.x - own.x, y = p.y - own.y, z = p.z - own.z;
      const floatv squared = fma(x, x, fma(y, y, z * z));
      const floatv same = fma(own.nx, p.dx, fma(own.ny, p.dy, own.nz * p.dz));
      const floatv scaled = squared * (inverse_rho * inverse_rho);
      const floatv near =
          p.w * (by.tries ? spline(smaller(sqrt(scaled), (floatv)(1.0f))) : parabola(scaled));
      const floatv rise = fma(x, own.nx, fma(y, own.ny, z * own.nz));
      floatv off = none, differs = same - 1.0f;
      if (ANY(!refit)) {
        const floatv h = rise / fma((floatv)(by.height_growth), squared, (floatv)(by.height));
        off = smaller(h * h, (floatv)(11.5129255f));  // 1e-5
      }
      if (ANY(refit)) {
        const floatv f = evaluate(c, x, y, z), apart = larger(-f, f * ahead) * inverse_tau;
        off = SELECT(off, smaller(apart * apart, (floatv)(9.21034037f)), refit);  // 1e-4
        const floatv along = along_slope(c, x, y, z, p.dx, p.dy, p.dz);
        differs = fma(firmly, smaller(along + by.leeway, (floatv)(1.0f)) - same, differs);
        differs *= fma(3.0f * firmly, clamp(f, 0.0f, 1.0f), (floatv)(1.0f));
      }
      const intv counts = (near >= 1e-6f) & (same >= -0.5f);
      const floatv exponent = larger(fma(falloff, smaller(differs, none), -off), (floatv)(-25.0f));
      const floatv w = SELECT(none, near * exp_negative(exponent), counts);
      if (measures_firmness) {
        const floatv beside = fma(roundness - 1.0f, smooth_step(0.0f, 1.0f, rise), (floatv)(1.0f));
        const floatv q = share_of(p.w, sqrt(squared), by.reach) * beside;
        around += q;
        agree += q * smooth_step(0.85f, 0.95f, same);
      }
      const Point weighed = {w,
                             x * inverse_rho,
                             y * inverse_rho,
                             z * inverse_rho,
                             delta * p.dx,
                             delta * p.dy,
                             delta * p.dz};
      point[k] = weighed;
      used += SELECT((intv)(0), (intv)(1), counts);
      if (left <= 1) STOREF(w, weight + slot);
    }
    for (int k = 0; k < points; ++k) add_first(m, a, point + k, delta);
    for (int k = 0; k < points; ++k) add_second(m, a, point + k, delta);
  }
  if (measures_firmness) STOREF(firmness_of(own.u, around, agree, 0.7f), support + 2 * lanes + lane);
  const intv few = used < 3;
  if (ANY(few)) {
#pragma unroll
    for (int k = 0; k < MOMENTS; ++k) m[k] = SELECT(m[k], none, few);
#pragma unroll
    for (int k = 0; k < 10; ++k) a[k] = SELECT(a[k], none, few);
  }
  const floatv least = quadric_of(m, a, ridge_of(roundness, model));
  const floatv slope = sqrt(larger(a[1] * a[1] + a[2] * a[2] + a[3] * a[3], (floatv)(1e-12f)));
  floatv rms = none;
  if (left == 1)
    rms = rms_of_fit(a, own, rho, slope, inverse_tau, place, neighbour + begin, weight + begin, count);
  const intv good = !few & (least > 0.0f) & (slope > 0.2f) & (slope < 5.0f);
  STOREF(SELECT((floatv)(-1.0f), rms, good), residual + lane);

  store_quadric(a, rho, slope, quadric + lane, lanes);
  turn_normal(a, good, &own);
  int at[WIDTH];
  STOREI(4 * LOADI(particle + lane), at);
  const intv wanted = LOADI(particle + lane) != nobody;
  scatter_float(own.nx, turned, at, wanted);
  scatter_float(own.ny, turned + 1, at, wanted);
  scatter_float(own.nz, turned + 2, at, wanted);
  if (left != 1) return;
  const floatv rest = SELECT((floatv)(-1.0f), rms, good);
  STOREI(LOADI(to + lane), at);
  put_in_sheet(own, SELECT(none, LOADF(influence + lane), rest > 0.0f), at, wanted,
               by.fits, toward, share);
  scatter_float(rest, value, at, wanted);
}

// How many residuals are above 0 and below the float of these bits, in all. Bits of floats that are not
// negative lie in the order of the floats.
inline int count_below(global const float* residual, const int fits, const int bits,
                       local int* counted) {
  const int own = get_local_id(0), items = get_local_size(0);
  intv number = (intv)(0);
  for (int k = own * WIDTH; k < fits; k += items * WIDTH) {
    const intv value = AS_INTV(LOADF(residual + k));
    number += SELECT((intv)(0), (intv)(1),
                     (value > 0) & (value < bits) & (TO_INTV(LANES) < fits - k));
  }
  int lane[WIDTH], sum = 0;
  STOREI(number, lane);
  for (int l = 0; l < WIDTH; ++l) sum += lane[l];
  barrier(CLK_LOCAL_MEM_FENCE);  // all have read what they counted before
  counted[own] = sum;
  barrier(CLK_LOCAL_MEM_FENCE);
  sum = 0;
  for (int k = 0; k < items; ++k) sum += counted[k];
  return sum;
}

// What noise alone explains: `over` times the residual that a twentieth of them are below, at least
// `least`. Those that are not above 0 do not count. One work-group looks for its bits, the highest first;
// mostly it is seen at once that `least` is more.
kernel void find_noise(global const float* residual,  // [fits]
                       global float* noise,           // [1] out, particle radii
                       const Noise by) {
  local int counted[TILE_ITEMS];
  if (get_group_id(0) > 0) return;
  const int rank = count_below(residual, by.fits, INT_MAX, counted) / 20;
  float found = by.least;
  if (count_below(residual, by.fits, as_int(by.least / by.over), counted) <= rank) {
    int bits = 0;  // the most that no more than `rank` are below
    for (int bit = 30; bit >= 0; --bit) {
      const int more = bits | 1 << bit;
      if (more <= as_int(INFINITY) && count_below(residual, by.fits, more, counted) <= rank) bits = more;
    }
    if (bits < as_int(INFINITY)) found = fmax(by.least, by.over * as_float(bits));
  }
  if (get_local_id(0) == 0) *noise = found;
}

// How far a fit can be relied on, and the normal of its particle, nine rows:
// - e, how far its surroundings are one sheet: with q = u_j W(l / reach), W Wendland's function, the
//   share of the particles elsewhere whose normals agree,
//     e = max(0.005, smoothstep(0.3, 0.9, (c + sum of q smoothstep(0.72, 0.95, a_ij)) /
//                                         (c + sum of q))),    c = 0.01 u_i
//   where a_ij goes from n_i.n_j at roundness 0, between two sheets, to g_i(x_j).n_j at roundness 1,
//   g_i the fit's unit gradient: round surroundings agree with the quadric, not with one normal; a fit
//   off which its own particles lie keeps 1 - 0.9 (1 - roundness) smoothstep(0.38, 0.55, residual / tau);
// - its firmness, which its trust follows from: agreement within a narrower angle, with the particle
//   itself:
//     max(0.005, smoothstep(0.7, 1.0, (u_i + sum of q smoothstep(0.85, 0.95, a_ij)) /
//                                     (u_i + sum of q)));
// - the RMS distance (at most 2) of all neighbours from the fit, with the weights of its first pass
//   but for the height;
// - the number of its neighbours, each by its weight u;
// - x, y and z of the normal as the passes left it;
// - the support;
// - the roundness.
// The first two are scaled by the weight of the group where the fits are those of groups.
// Fits get their residual, the RMS distance with the weights of the last pass.
//
// What their trust follows from goes into a sheet (trust.hpp): normals; how much each fit counts, which is
// its firmness, 0 without a fit; and behind two values, which become densities, the RMS distance. The
// densities are measured at the foot of each, on its surface next to its particle, and `deep` behind it.
// Without a fit a particle is its own foot.
kernel void measure_edges(global const float4* place, global const float4* normal,
                          AROUND(particle, influence, neighbour, first, length),
                          MEASURED(support, quadric, kept, residual, rows),  // see above
                          IN_SHEET(to, toward, sheet_share, value),
                          global float* field_place,  // [3][2 fits] out: feet, then what is behind
                          const FitPass by, const Feet feet) {
  const int lanes = by.lanes, fits = by.fits;
  const FitModel model = by.model;
  const int lane = get_global_id(0) * WIDTH;
  if (lane >= lanes) return;
  const floatv none = (floatv)(0.0f), one = (floatv)(1.0f);
  const Particles own = load_particles(place, normal, particle + lane);
  const int begin = first[lane / BATCH] + lane % BATCH, count = length[lane / BATCH];
  const floatv inverse_rho = 1.0f / LOADF(support + lane);
  const floatv roundness = LOADF(support + lanes + lane);
  const floatv falloff = falloff_of(roundness, model);
  const floatv inverse_tau = 1.0f / tau_of(roundness, model);
  const int round = ANY(roundness > 0.0f);
  floatv c[10];
#pragma unroll
  for (int k = 0; k < 10; ++k) c[k] = LOADF(quadric + k * lanes + lane);
  floatv near = none, agree = none, firm = none, weight = none, squares = none, number = none;
  floatv distances = none, total = (floatv)(1e-30f);
  Point point[CHUNK];
  for (int from = 0; from < count; from += CHUNK) {
    const int points = min(CHUNK, count - from);
    gather_points(place, normal, neighbour + begin + BATCH * from, points, point);
    for (int k = 0; k < points; ++k) {
      const Point p = point[k];
      const floatv x = p.x - own.x, y = p.y - own.y, z = p.z - own.z;
      const floatv squared = x * x + y * y + z * z, l = sqrt(squared);
      const floatv same = own.nx * p.dx + own.ny * p.dy + own.nz * p.dz;
      const floatv f = evaluate(c, x, y, z), apart = clamp(f, -2.0f, 2.0f);
      add_distance(f, LOADF(kept + begin + BATCH * (from + k)), inverse_tau, &distances, &total);
      const floatv w = p.w * parabola(squared * (inverse_rho * inverse_rho)) *
                       exp_negative(falloff * smaller(same - 1.0f, none));
      weight += w;
      squares += w * apart * apart;
      number += p.w;
      const floatv q = share_of(p.w, l, by.reach);
      floatv agreeing = same;
      if (round) {
        const floatv along = along_slope(c, x, y, z, p.dx, p.dy, p.dz);
        agreeing = fma(roundness, along - same, same);
      }
      near += q;
      agree += q * smooth_step(0.72f, 0.95f, agreeing);
      firm += q * smooth_step(0.85f, 0.95f, agreeing);
    }
  }
  const floatv all = own.u + near, off = sqrt(distances / total);
  const floatv spread = SELECT((floatv)(2.0f), sqrt(squares / weight), weight > 0.0f);
  const floatv agreed =
      SELECT(one, fmax((floatv)(0.005f), smooth_step(0.7f, 1.0f, (own.u + firm) / all)), all > 0.0f);
  // A bevel along an edge agrees with its row alone, and the others lie farther off than its own rest. A
  // fit on which all lie that look its way is a face, also beside a corner, where most are bevels. One
  // that its own particles lie off lies across an edge, and may agree with others that do.
  const floatv edged = one - roundness;
  const floatv bevel = (one - firmness_of(own.u, near, firm, 0.8f)) * edged *
                       smooth_step(0.4f, 0.55f, spread - 2.0f * off);
  const floatv across = edged * smooth_step(0.38f, 0.55f, off * inverse_tau);
  const floatv face = 0.2f * edged * (one - smooth_step(0.1f, 0.3f, spread)) * (one - across);
  const floatv least = larger(face, (floatv)(0.0005f)), rest = one - bevel;
  const floatv counts = by.groups ? LOADF(influence + lane) : one;
  const floatv firmness = counts * larger(agreed * rest, least);
  STOREF(counts * larger(edge_of(own.u, near, agree) * rest * (one - 0.9f * across), least), rows + lane);
  STOREF(firmness, rows + lanes + lane);
  STOREF(spread, rows + 2 * lanes + lane);
  STOREF(number, rows + 3 * lanes + lane);
  STOREF(own.nx, rows + 4 * lanes + lane);
  STOREF(own.ny, rows + 5 * lanes + lane);
  STOREF(own.nz, rows + 6 * lanes + lane);
  STOREF(LOADF(support + lane), rows + 7 * lanes + lane);
  STOREF(roundness, rows + 8 * lanes + lane);
  const floatv before = LOADF(residual + lane);
  const intv fitted = before >= 0.0f, used = LOADI(to + lane) >= 0;
  STOREF(SELECT(before, off, fitted), residual + lane);

  const floatv behind = clamp(-c[0], -1.0f, 1.0f);
  const floatv foot = SELECT(none, feet.offset + behind, fitted), deep = foot - feet.deep;
  int at[WIDTH];
  STOREI(LOADI(to + lane), at);
  put_in_sheet(own, SELECT(none, firmness, fitted), at, used, fits, toward, sheet_share);
  scatter_float(spread, value + 2 * fits, at, used);
  scatter_float(fma(foot, own.nx, own.x), field_place, at, used);
  scatter_float(fma(foot, own.ny, own.y), field_place + 2 * fits, at, used);
  scatter_float(fma(foot, own.nz, own.z), field_place + 4 * fits, at, used);
  scatter_float(fma(deep, own.nx, own.x), field_place + fits, at, used);
  scatter_float(fma(deep, own.ny, own.y), field_place + 3 * fits, at, used);
  scatter_float(fma(deep, own.nz, own.z), field_place + 5 * fits, at, used);
}
