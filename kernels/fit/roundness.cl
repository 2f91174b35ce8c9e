// roundness.cl: whether one quadric or two sheets explain the surface around each fitted particle
// (docs/method.md, roundness). The paper knows no such choice: its groups end where normals differ.
//
// Each particle has two trial fits: a wide one, which goes around bends, and a narrow one, of the
// neighbours whose normals are similar. Where two sheets really meet, the wide fits miss the particles and
// the narrow ones, in two sheets, do not; on a drop or a rim both follow.
//
// uses: neighbours.cl

#define MODEL 3  // float4 a particle: c0-c3; c4-c7; c8, c9
#define NARROW 1  // trial, in the range's second dimension; the wide one is the first
// The values of so many neighbours are kept from pass to pass. Processors have room for that.
#define KEPT (WIDTH > 1 ? 48 : 1)

// Puts the trial fits of the lanes where their particles are, so that neighbours find them. A wide fit
// weighs u_i, a narrow one e u_i with its edge (edge_of); 0 where there is no fit.
kernel void place_models(global const float4* place,   // [n + 1] as in fit_particles
                         global const float4* normal,  // [2][n + 1] as the trials left them
                         AROUND(particle, influence, neighbour, first, length),
                         global const float* quadric,  // [2][10][lanes]
                         global const float* residual, // [2][lanes]
                         global float* model,          // [2][MODEL][n + 1][4] out
                         global float* weight,         // [2][n + 1] out; 0 before
                         const Trial trial) {
  const int lanes = trial.lanes, nobody = trial.nobody;
  const int lane = get_global_id(0) * WIDTH, which = get_global_id(1), row = 4 * (nobody + 1);
  if (lane >= lanes) return;
  normal += (nobody + 1) * which;
  quadric += 10 * lanes * which;
  residual += lanes * which;
  model += MODEL * row * which;
  const Particles own = load_particles(place, normal, particle + lane);
  floatv edge = (floatv)(1.0f);  // LLVM 18 gives up at width 1 where the branch changes `counts`
  if (which == NARROW) {
    const int begin = first[lane / FIT_BATCH] + lane % FIT_BATCH, count = length[lane / FIT_BATCH];
    floatv near = (floatv)(0.0f), agree = near;
    for (int k = 0; k < count; ++k) {
      Point p;
      gather_points(place, normal, neighbour + begin + FIT_BATCH * k, 1, &p);
      const floatv x = p.x - own.x, y = p.y - own.y, z = p.z - own.z;
      const floatv q = share_of(p.w, sqrt(x * x + y * y + z * z), trial.reach);
      near += q;
      agree += q * smooth_step(0.72f, 0.95f, own.nx * p.dx + own.ny * p.dy + own.nz * p.dz);
    }
    edge = edge_of(own.u, near, agree);
  }
  floatv counts = own.u * edge * LOADF(influence + lane);
  counts = SELECT((floatv)(0.0f), counts, LOADF(residual + lane) >= 0.0f);
  int at[WIDTH];
  const intv wanted = LOADI(particle + lane) != nobody;
  STOREI(LOADI(particle + lane), at);
  scatter_float(counts, weight + (nobody + 1) * which, at, wanted);
  STOREI(4 * LOADI(particle + lane), at);
#pragma unroll
  for (int k = 0; k < 10; ++k)
    scatter_float(LOADF(quadric + k * lanes + lane), model + k / 4 * row + k % 4, at, wanted);
}

// The value of a neighbour's trial fit at a particle.
typedef struct {
  floatv weight;      // 0: nothing
  floatv f;           // the particle's distance outside it, particle radii
  floatv gx, gy, gz;  // unit gradient there
  floatv same;        // product of both normals
  floatv x, y, z;     // from the particle to the neighbour
} TrialValue;

// The fits of a trial.
typedef struct {
  global const float4* place;   // [n + 1]
  global const float4* normal;  // [n + 1] as it left them
  global const float4* model;   // [MODEL][n + 1]; anything where the weight is 0
  global const float* weight;   // [n + 1]
  int row;                      // n + 1
} TrialFits;

// The neighbours in slots `at`, one a lane, count w (1 - l^2 / reach^2)^3 as far as normals are less
// than 120 degrees apart.
inline TrialValue value_of_trial(const TrialFits fits, global const int* at, const Particles own,
                                 const float reach) {
  floatv p[4], a[4], b[4], c[4], n[4];
  int item[WIDTH];
  STOREI(LOADI(at), item);
  load_records(fits.place, at, p);
  load_records(fits.normal, at, n);
  load_records(fits.model, at, a);
  load_records(fits.model + fits.row, at, b);
  load_records(fits.model + 2 * fits.row, at, c);
  const floatv weight = gather_float(fits.weight, item), none = (floatv)(0.0f);
  const intv any_fit = weight > 0.0f;
  floatv quadric[10] = {a[0], a[1], a[2], a[3], b[0], b[1], b[2], b[3], c[0], c[1]};
  // Where there is no fit anything stands, subnormal numbers too, with which processors are slow.
#pragma unroll
  for (int k = 0; k < 10; ++k) quadric[k] = SELECT(none, quadric[k], any_fit);
  TrialValue t;
  t.x = p[0] - own.x;
  t.y = p[1] - own.y;
  t.z = p[2] - own.z;
  const floatv l = (t.x * t.x + t.y * t.y + t.z * t.z) / (reach * reach);
  const floatv r = larger(1.0f - l, (floatv)(0.0f));
  t.same = own.nx * n[0] + own.ny * n[1] + own.nz * n[2];
  t.weight = SELECT(none, weight * r * r * r, t.same >= -0.5f);
  floatv gx, gy, gz;
  slope_at(quadric, -t.x, -t.y, -t.z, &gx, &gy, &gz);
  const floatv size = sqrt(larger(gx * gx + gy * gy + gz * gz, (floatv)(1e-12f)));
  const floatv f = evaluate(quadric, -t.x, -t.y, -t.z) / larger(size, (floatv)(0.3f));
  t.f = SELECT(none, clamp(f, -0.5f, 0.5f), any_fit);
  t.gx = SELECT(none, gx / size, any_fit);
  t.gy = SELECT(none, gy / size, any_fit);
  t.gz = SELECT(none, gz / size, any_fit);
  return t;
}

// Sums over the neighbours of one sheet: weights; f; its square; places; gradients.
typedef struct {
  floatv w, f, ff, x, y, z, nx, ny, nz;
} Side;

inline void add_trial_value(Side* side, const TrialValue t, const floatv share) {
  const floatv w = share * t.weight, f = w * t.f;
  side->w += w;
  side->f += f;
  side->ff = fma(f, t.f, side->ff);
  side->x = fma(w, t.x, side->x);
  side->y = fma(w, t.y, side->y);
  side->z = fma(w, t.z, side->z);
  side->nx = fma(w, t.gx, side->nx);
  side->ny = fma(w, t.gy, side->ny);
  side->nz = fma(w, t.gz, side->nz);
}

// Four values a particle. Three are means over the trial fits of its neighbours within `reach`:
// - the squared distance of the particle from the wide ones;
// - from the narrow ones in two sheets that meet as in blend_at, in max(f_A, f_B) where they are convex
//   and in min where they are concave;
// - how far it bends: 1 - n_i.n_j of the wide ones' normals;
// the last is how far its own trials turn apart: 1 - n.n' of the wide one's and the narrow one's normals.
// All are 0 where no neighbour has a fit. They go into the sheet of the wide fits.
kernel void measure_evidence(global const float4* place,   // [n + 1]
                             global const float4* normal,  // [2][n + 1] as the trials left them
                             global const float4* model,   // [2][MODEL][n + 1] of place_models
                             global const float* weight,   // [2][n + 1]
                             AROUND(particle, influence, neighbour, first, length),
                             IN_SHEET(to, toward, share, value), const Trial trial) {
  const int lanes = trial.lanes, fits = trial.fits, row = trial.nobody + 1;
  const float reach = trial.reach;
  const int lane = get_global_id(0) * WIDTH;
  if (lane >= lanes) return;
  const TrialFits wide = {place, normal, model, weight, row};
  const TrialFits narrow = {place, normal + row, model + MODEL * row, weight + row, row};
  const floatv none = (floatv)(0.0f), tiny = (floatv)(1e-30f);
  const int begin = first[lane / FIT_BATCH] + lane % FIT_BATCH, count = length[lane / FIT_BATCH];
  global const int* at = neighbour + begin;
  const Particles around = load_particles(place, wide.normal, particle + lane);
  floatv total = none, squares = none, bend = none;
  for (int k = 0; k < count; ++k) {
    const TrialValue t = value_of_trial(wide, at + FIT_BATCH * k, around, reach);
    total += t.weight;
    squares = fma(t.weight * t.f, t.f, squares);
    bend = fma(t.weight, 1.0f - t.same, bend);
  }
  int item[WIDTH];
  STOREI(LOADI(particle + lane), item);
  const floatv counts = gather_float(weight, item);
  const intv used = LOADI(to + lane) >= 0;
  STOREI(LOADI(to + lane), item);
  put_in_sheet(around, counts, item, used, fits, toward, share);
  scatter_float(squares / larger(total, tiny), value, item, used);
  scatter_float(bend / larger(total, tiny), value + 2 * fits, item, used);

  const Particles own = load_particles(place, narrow.normal, particle + lane);
  const floatv apart = 1.0f - (around.nx * own.nx + around.ny * own.ny + around.nz * own.nz);
  scatter_float(SELECT(none, apart, total > 0.0f), value + 3 * fits, item, used);
  // The gradient that dominates: that of the heaviest after two rounds of mean shift.
  floatv best = none, ax = none, ay = none, az = none;
  TrialValue kept[KEPT];
  for (int k = 0; k < count; ++k) {
    const TrialValue t = value_of_trial(narrow, at + FIT_BATCH * k, own, reach);
    if (k < KEPT) kept[k] = t;
    const intv better = t.weight > best;
    best = SELECT(best, t.weight, better);
    ax = SELECT(ax, t.gx, better);
    ay = SELECT(ay, t.gy, better);
    az = SELECT(az, t.gz, better);
  }
  Side A, B;
  for (int round = 0; round < 3; ++round) {
    const Side empty = {none, none, none, none, none, none, none, none, none};
    A = B = empty;
    for (int k = 0; k < count; ++k) {
      const TrialValue t = k < KEPT ? kept[k] : value_of_trial(narrow, at + FIT_BATCH * k, own, reach);
      const floatv share =
          smooth_step(trial.same_low, trial.same_high, t.gx * ax + t.gy * ay + t.gz * az);
      add_trial_value(&A, t, share);
      add_trial_value(&B, t, 1.0f - share);
    }
    if (round == 2) break;
    const floatv size = A.nx * A.nx + A.ny * A.ny + A.nz * A.nz;
    const floatv scale = 1.0f / sqrt(larger(size, tiny));
    ax = SELECT(ax, A.nx * scale, size > 1e-30f);
    ay = SELECT(ay, A.ny * scale, size > 1e-30f);
    az = SELECT(az, A.nz * scale, size > 1e-30f);
  }
  const floatv va = 1.0f / larger(A.w, tiny), vb = 1.0f / larger(B.w, tiny);
  const floatv sb = 1.0f / sqrt(larger(B.nx * B.nx + B.ny * B.ny + B.nz * B.nz, tiny));
  const floatv hx = B.x * vb - A.x * va, hy = B.y * vb - A.y * va, hz = B.z * vb - A.z * va;
  const floatv side = hx * ax + hy * ay + hz * az - (hx * B.nx + hy * B.ny + hz * B.nz) * sb;
  const floatv fa = A.f * va, fb = B.f * vb;
  const intv takes_b = SELECT(fb < fa, fb > fa, side < 0.0f);
  const floatv meets = SELECT(
      none, smooth_step(0.003f, 0.02f, B.w / larger(A.w + B.w, tiny)), takes_b);
  scatter_float(fma(meets, B.ff * vb - A.ff * va, A.ff * va), value + fits, item, used);
}
