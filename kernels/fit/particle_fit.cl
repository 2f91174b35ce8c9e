// particle_fit.cl: fits around every particle of the rim, seen or hidden, in passes (paper 2.3, with a
// support of fixed radius instead of a merged group, so that nothing changes abruptly from frame to frame;
// docs/method.md).
//
// The particles and their lanes: neighbours.cl.
//
// uses: neighbours.cl

// The quadratic B-spline on [0, 1), for trial fits.
inline floatv spline(const floatv x) {
  const floatv y = 1.5f * x;
  return SELECT(0.5f * (1.5f - y) * (1.5f - y), 0.75f - y * y, y < 0.5f);
}

// The distance of the off-surface rows and the ridge, by the roundness as falloff_of.
inline floatv off_surface_of(const floatv roundness, const FitModel model) {
  return fma(roundness, (floatv)(model.off_surface_gain), (floatv)(model.off_surface));
}
inline floatv ridge_of(const floatv roundness, const FitModel model) {
  return fma(roundness, (floatv)(model.ridge_gain), (floatv)(model.ridge));
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

// The RMS of f over a fit's `count` neighbours, with f = rho f(q) / slope and q = X / rho.
INLINED floatv rms_of_fit(const floatv* a, const Particles own, const floatv rho, const floatv slope,
                          const floatv inverse_tau, global const float4* place,
                          global const int* neighbour, global const float* weight, const int count) {
  const floatv inverse_rho = 1.0f / rho, steep = rho / slope;
  floatv squares = (floatv)(0.0f), total = (floatv)(1e-30f);
  for (int k = 0; k < count; ++k) {
    floatv p[4];
    load_records(place, neighbour + FIT_BATCH * k, p);
    const floatv f = evaluate(a, (p[0] - own.x) * inverse_rho, (p[1] - own.y) * inverse_rho,
                              (p[2] - own.z) * inverse_rho) *
                     steep;
    add_distance(f, LOADF(weight + FIT_BATCH * k), inverse_tau, &squares, &total);
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

// What the neighbours of a pass are weighed with: supports and roundness; the parts of the tolerance for
// layers below and of the off-surface rows; the quadric of the pass before where there is one (refit), and
// how firm its fit was. See fit_particles.
typedef struct {
  floatv rho, roundness, inverse_rho, inverse_tau, delta;
  floatv falloff, firmly, ahead;
  floatv c[10];
  intv refit;
} Weighing;

// Sets up WIDTH lanes from `lane` on, one trial's: the first pass sets supports and roundness, a later one
// takes up what the pass before left, and may narrow the supports.
INLINED void take_up(Weighing* with, const int lane, const int trial, global const float4* normal,
                     global const int* particle, global float* support, global const float* quadric,
                     global const float* residual, global const int* to, NARROWED(mean, noise),
                     const FitPass by) {
  const int lanes = by.lanes;
  const FitModel model = by.model;
  const floatv none = (floatv)(0.0f);
  with->refit = (intv)(0);
#pragma unroll
  for (int k = 0; k < 10; ++k) with->c[k] = none;
  floatv firm = none;
  if (by.done == 0) {
    with->roundness =
        by.tries ? (floatv)(trial == 0 ? 1.0f : 0.0f) : roundness_at(normal, particle + lane);
    with->rho = fma(with->roundness, (floatv)(by.round_gain), (floatv)(by.full));
    STOREF(with->rho, support + lane);
    STOREF(with->roundness, support + lanes + lane);
  } else {
    with->refit = LOADF(residual + lane) >= 0.0f;
#pragma unroll
    for (int k = 0; k < 10; ++k)
      with->c[k] = SELECT(none, LOADF(quadric + k * lanes + lane), with->refit);
    with->rho = LOADF(support + lane);
    with->roundness = LOADF(support + lanes + lane);
    if (!by.groups) firm = SELECT(none, LOADF(support + 2 * lanes + lane), with->refit);
  }
  if (by.narrows) {
    with->rho = narrowed_support(with->rho, to + lane, mean, noise, by);
    STOREF(with->rho, support + lane);
  }
  with->inverse_rho = 1.0f / with->rho;
  with->inverse_tau = 1.0f / tau_of(with->roundness, model);
  with->delta = off_surface_of(with->roundness, model) / with->rho;
  with->firmly = firm * (1.0f - with->roundness);
  with->ahead = by.ahead * firm;
  with->falloff =
      falloff_of(with->roundness, model) * fma(with->firmly, (floatv)(by.sharp), (floatv)(1.0f));
}

// What the neighbours come to, beside the sums of their equations: how many count; weights of all that are
// near, and of those that agree, for the firmness of the next pass.
typedef struct {
  intv used;
  floatv around, agree;
} Neighbourhood;

// Whether a pass measures firmness, for the next one.
inline int measures_firmness(const FitPass by) {
  return by.left > 0 && !by.tries && !by.groups;
}

// The weight of a neighbour at (x, y, z) from the particle: `near`, its u by the distance, times those of
// its normal's product with the particle's, `same`, and of its height over the tangent plane, `rise`, or
// over the surface of the pass before.
INLINED floatv weight_of(const Weighing* with, const Point p, const floatv x, const floatv y,
                         const floatv z, const floatv squared, const floatv near, const floatv same,
                         const floatv rise, const intv counts, const FitPass by) {
  const floatv none = (floatv)(0.0f);
  const intv refit = with->refit;
  floatv off = none, differs = same - 1.0f;
  if (ANY(!refit)) {
    const floatv h = rise / fma((floatv)(by.height_growth), squared, (floatv)(by.height));
    off = smaller(h * h, (floatv)(11.5129255f));  // 1e-5
  }
  if (ANY(refit)) {
    const floatv firmly = with->firmly, ahead = with->ahead;
    const floatv f = evaluate(with->c, x, y, z), apart = larger(-f, f * ahead) * with->inverse_tau;
    off = SELECT(off, smaller(apart * apart, (floatv)(9.21034037f)), refit);  // 1e-4
    const floatv along = along_slope(with->c, x, y, z, p.dx, p.dy, p.dz);
    differs = fma(firmly, smaller(along + by.leeway, (floatv)(1.0f)) - same, differs);
    differs *= fma(3.0f * firmly, clamp(f, 0.0f, 1.0f), (floatv)(1.0f));
  }
  const floatv exponent = larger(fma(with->falloff, smaller(differs, none), -off), (floatv)(-25.0f));
  return SELECT(none, near * exp_negative(exponent), counts);
}

// Turns neighbours, as gather_points has them, into points of the equations: their weights, their places
// from the particle over the support, and normals as long as the off-surface rows are away.
INLINED void weigh_points(const Weighing* with, const Particles* own, Point* point, const int points,
                          global float* weight, Neighbourhood* found, const FitPass by) {
  const floatv none = (floatv)(0.0f);
  const int firmness = measures_firmness(by);
  for (int k = 0; k < points; ++k) {
    const Point p = point[k];
    const floatv x = p.x - own->x, y = p.y - own->y, z = p.z - own->z;
    const floatv squared = fma(x, x, fma(y, y, z * z));
    const floatv same = fma(own->nx, p.dx, fma(own->ny, p.dy, own->nz * p.dz));
    const floatv scaled = squared * (with->inverse_rho * with->inverse_rho);
    const floatv near =
        p.w * (by.tries ? spline(smaller(sqrt(scaled), (floatv)(1.0f))) : parabola(scaled));
    const floatv rise = fma(x, own->nx, fma(y, own->ny, z * own->nz));
    const intv counts = (near >= 1e-6f) & (same >= -0.5f);
    const floatv w = weight_of(with, p, x, y, z, squared, near, same, rise, counts, by);
    if (firmness) {
      const floatv beside =
          fma(with->roundness - 1.0f, smooth_step(0.0f, 1.0f, rise), (floatv)(1.0f));
      const floatv q = share_of(p.w, sqrt(squared), by.reach) * beside;
      found->around += q;
      found->agree += q * smooth_step(0.85f, 0.95f, same);
    }
    const Point weighed = {w,
                           x * with->inverse_rho,
                           y * with->inverse_rho,
                           z * with->inverse_rho,
                           with->delta * p.dx,
                           with->delta * p.dy,
                           with->delta * p.dz};
    point[k] = weighed;
    found->used += SELECT((intv)(0), (intv)(1), counts);
    if (by.left <= 1) STOREF(w, weight + FIT_BATCH * k);
  }
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
  const int lane = get_global_id(0) * WIDTH, trial = get_global_id(1);
  if (lane >= lanes) return;
  support += 3 * lanes * trial;
  quadric += 10 * lanes * trial;
  residual += lanes * trial;
  turned += 4 * (nobody + 1) * trial;
  const floatv none = (floatv)(0.0f);
  Particles own = load_particles(place, normal, particle + lane);
  Weighing with;
  take_up(&with, lane, trial, normal, particle, support, quadric, residual, to, mean, noise, by);

  const int begin = first[lane / FIT_BATCH] + lane % FIT_BATCH, count = length[lane / FIT_BATCH];
  Neighbourhood found = {(intv)(0), none, none};
  floatv m[MOMENTS], a[10];
#pragma unroll
  for (int k = 0; k < MOMENTS; ++k) m[k] = none;
#pragma unroll
  for (int k = 0; k < 10; ++k) a[k] = none;
  Point point[CHUNK];
  for (int from = 0; from < count; from += CHUNK) {
    const int points = min(CHUNK, count - from), slot = begin + FIT_BATCH * from;
    gather_points(place, normal, neighbour + slot, points, point);
    weigh_points(&with, &own, point, points, weight + slot, &found, by);
    for (int k = 0; k < points; ++k) add_first(m, a, point + k, with.delta);
    for (int k = 0; k < points; ++k) add_second(m, a, point + k, with.delta);
  }
  if (measures_firmness(by))
    STOREF(firmness_of(own.u, found.around, found.agree, 0.7f), support + 2 * lanes + lane);

  const intv few = found.used < 3;
  if (ANY(few)) {
#pragma unroll
    for (int k = 0; k < MOMENTS; ++k) m[k] = SELECT(m[k], none, few);
#pragma unroll
    for (int k = 0; k < 10; ++k) a[k] = SELECT(a[k], none, few);
  }
  const floatv least = quadric_of(m, a, ridge_of(with.roundness, by.model));
  const floatv slope = sqrt(larger(a[1] * a[1] + a[2] * a[2] + a[3] * a[3], (floatv)(1e-12f)));
  floatv rms = none;
  if (left == 1)
    rms = rms_of_fit(a, own, with.rho, slope, with.inverse_tau, place, neighbour + begin,
                     weight + begin, count);
  const intv good = !few & (least > 0.0f) & (slope > 0.2f) & (slope < 5.0f);
  STOREF(SELECT((floatv)(-1.0f), rms, good), residual + lane);

  store_quadric(a, with.rho, slope, quadric + lane, lanes);
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
