// sheet.cl: means over the fits of the same sheet around each fit (docs/method.md, fit and trust), and
// the roundness that follows from such means (docs/method.md, roundness).
//
// uses: cells.cl

// Fits by cells.
typedef struct {
  Cells cells;
  int n;
  int values;                  // 1, 3 or 4
  global const float* normal;  // [3][n] in bucket order; 0: normals do not tell
  global const float* share;   // [n]
  global const float* value;   // [values][n]
  SheetWeights weights;
} Fits;

// Places and normals around which means are wanted.
typedef struct {
  floatv x, y, z, nx, ny, nz;
} Query;

// Sums of the weights of fits, and of what they weigh; or means.
typedef struct {
  floatv weight, a, b, c, d;
} Sums;

// Adds the listed fits to the sums around `at`.
inline void add_fits(const Fits fits, const int* item, const int count, const Query at, Sums* result) {
  Sums sums = *result;  // see add_listed in field.cl
  const int n = fits.n;
  global const float* normal = fits.normal;
  for (int k = 0; k < count; ++k) {
    const int p = item[k];
    const floatv dx = at.x - fits.cells.x[p], dy = at.y - fits.cells.y[p], dz = at.z - fits.cells.z[p];
    const floatv l = sqrt(dx * dx + dy * dy + dz * dz);
    floatv w = fits.share[p] * larger(1.0f - l * (1.0f / fits.weights.reach), (floatv)(0.0f));
    if (normal) {
      const floatv same = at.nx * normal[p] + at.ny * normal[n + p] + at.nz * normal[2 * n + p];
      w *= smooth_step(fits.weights.low, fits.weights.high, same);
    }
    sums.weight += w;
    sums.a += w * fits.value[p];
    if (fits.values == 1) continue;
    sums.b += w * fits.value[n + p];
    sums.c += w * fits.value[2 * n + p];
    if (fits.values == 4) sums.d += w * fits.value[3 * n + p];
  }
  *result = sums;
}

// The means of the values around fits of SPAN cells of a row; 0 where nothing weighs anything. Those that
// count nothing are left out before they are summed.
inline Sums means_around(const Fits fits, const Together own, const Query at) {
  const Cells cells = fits.cells;
  const floatv none = (floatv)(0.0f);
  const Box box = box_of(at.x, at.y, at.z, own.used);
  Sums sums = {none, none, none, none, none};
  int item[AT_A_TIME + 2 * WIDTH], count = 0;
  for (int k = -1; k <= 1; ++k)
    for (int j = -1; j <= 1; ++j) {
      const int tag = (int)tag_of(own.cx, own.cy + j, own.cz + k);
      Row row = row_of(own.cx - 1, own.cy + j, own.cz + k, own.wide + 2, cells.mask);
      while (next_range(&row, cells.start, cells.mask))
        for (int p = row.begin; p < row.end; p += WIDTH) {
          const intv counts = (LOADF(fits.share + p) > 0.0f) & (LANES < (float)(row.end - p));
          if (!ANY(counts)) continue;
          count = append(counts & near_box(box, cells, p, fits.weights.reach) &
                             SAME_ROW(LOADI((global const int*)cells.tag + p), tag),
                         p, item, count);
          if (count < AT_A_TIME) continue;
          add_fits(fits, item, count, at, &sums);
          count = 0;
        }
    }
  add_fits(fits, item, count, at, &sums);
  const floatv scale = SELECT(none, 1.0f / sums.weight, sums.weight > 0.0f);
  const Sums means = {sums.weight, sums.a * scale, sums.b * scale, sums.c * scale, sums.d * scale};
  return means;
}

// Those at `first` and behind it.
inline Query query_from(const Fits fits, const int first) {
  const Query at = {LOADF(fits.cells.x + first),
                    LOADF(fits.cells.y + first),
                    LOADF(fits.cells.z + first),
                    LOADF(fits.normal + first),
                    LOADF(fits.normal + fits.n + first),
                    LOADF(fits.normal + 2 * fits.n + first)};
  return at;
}

// Up to WIDTH fits of SPAN cells of a row at a time, BLOCK a work-item. A fit at distance l whose
// normal is n' weighs
//   share (1 - l / reach) smoothstep(low, high, n.n').
kernel void average_on_sheets(
    global float* mean,  // [values][n] of the values; 0 where nothing weighs anything
    CELLS(cell_),
    global const float* normal,  // [3][n] in bucket order
    global const float* share,   // [n]
    global const float* value,   // [values][n]
    const SheetMeans by) {
  const int n = by.fits;
  const Fits fits = {CELLS_OF(cell_), n, by.values, normal, share, value, by.weights};
  const int begin = get_global_id(0) * BLOCK, end = min(begin + BLOCK, n);
  for (int first = begin; first < end;) {
    const Together own = particles_together(fits.cells, SPAN, first, end, n);
    const Sums means = means_around(fits, own, query_from(fits, first));
    scatter_float(means.a, mean, own.at, own.used);
    if (by.values > 1) {
      scatter_float(means.b, mean + n, own.at, own.used);
      scatter_float(means.c, mean + 2 * n, own.at, own.used);
    }
    first += own.count;
  }
}

// No surface follows noise: it adds to the squares of distances and would look like two sheets. What
// irregular particles add is taken from what lies above the square of orderly ones, .011 radii^2.
inline floatv without_noise(const floatv square, const float noise) {
  return larger(square - noise, smaller(square, (floatv)(0.011f)));
}

// The log-odds of one quadric against two sheets, in units of about 1/16 (docs/method.md, roundness):
//   1.5 ln((two + 1.5 apart + .02) (min(bend, .12) + .002)) - 4 ln(one + .008) + 30 max(two - .03, 0) + 20 apart.
// What noise leaves of each keeps the logarithms finite. How well two sheets follow says little: they
// follow a rounded edge, too; how badly they do says that there are none. So their noise is higher. Beside
// a sharp edge both trials of a particle have much the same normal; along an edge that is rounded, or in
// pieces, they turn apart. An acute edge bends as drops do, by more than .12. What is more says nothing;
// irregular particles bend by more. Two sheets that miss their particles by more than .17 radii (the root
// of .03) draw shards instead of an edge, however badly one quadric follows; irregular particles, whose
// noise was taken away, leave more.
inline floatv score_of(const floatv one, const floatv two, const floatv bend, const floatv apart,
                       const float noise) {
  const floatv o = one + 0.008f, o2 = o * o;
  const floatv b = smaller(bend, (floatv)(0.12f + 10.0f * noise)) + 0.002f;
  const floatv p = (two + 1.5f * apart + 0.02f) * b;
  const floatv missed = larger(two - (0.03f + 2.0f * noise), (floatv)(0.0f));
  return logarithm(p * sqrt(p) / (o2 * o2)) + 30.0f * missed + 20.0f * apart;
}

// The weight of a bend where scores are averaged. Waves beside an edge score like round water, and so do the
// corners where edges meet: bends of about .04 weigh most. The weight is never 0, so that a mean changes
// steadily with the particles where only slight bends are near.
inline floatv weight_of_bend(const floatv bend) {
  return (smooth_step(0.02f, 0.04f, bend) + 0.01f) / sqrt(larger(bend, (floatv)(1e-6f)));
}

// The evidence for one quadric or two sheets (measure_evidence) is averaged over the sheet around each fit
// and scored. The result goes into wider cells: its weight, 0 where nothing bends; the score; and how far
// the fit bends, 0 .. 1.
kernel void score_bends(CELLS(cell_), global const float* normal,  // as for average_on_sheets
                        global const float* share, global const float* value,
                        global const int* to,      // [fits] where each goes
                        global float* bent_share,  // [fits] out
                        global float* bent_value,  // [2][fits] out
                        const BendScoring by) {
  const int n = by.fits;
  const Fits fits = {CELLS_OF(cell_), n, 4, normal, share, value, by.near};
  const int begin = get_global_id(0) * BLOCK, end = min(begin + BLOCK, n);
  for (int first = begin; first < end;) {
    const Together own = particles_together(fits.cells, SPAN, first, end, n);
    const Sums means = means_around(fits, own, query_from(fits, first));
    const floatv bend = means.c, bends = smooth_step(0.005f, 0.02f, bend);
    const floatv score = score_of(without_noise(means.a, by.noise), without_noise(means.b, by.noise),
                                  bend, means.d, by.noise) +
                         by.rounder;
    int place[WIDTH];
    STOREI(LOADI(to + first), place);
    scatter_float(LOADF(share + first) * bends * weight_of_bend(bend), bent_share, place, own.used);
    scatter_float(score, bent_value, place, own.used);
    scatter_float(bends, bent_value + n, place, own.used);
    first += own.count;
  }
}

// Mean scores up to which bends are creases, and from which on they are round.
#define SHARP 3.48f
#define ROUND 3.62f

// The roundness of bent fits, from the mean of the scores around, whatever their normals: behind the normal of
// each one's particle. Only for the fits of a block that bend.
kernel void set_roundness(global float* surface,  // [particles][4] normals, in and out
                          CELLS(cell_),
                          global const float* share,   // [n] 0 where nothing bends
                          global const float* value,   // [2][n] score; how far it bends
                          global const int* particle,  // [n] in the surface
                          const ScoreMeans by) {
  const int n = by.fits;
  const SheetWeights weights = {by.reach, 0.0f, 0.0f};
  const Fits fits = {CELLS_OF(cell_), n, 1, 0, share, value, weights};
  const floatv none = (floatv)(0.0f);
  const int begin = get_global_id(0) * BLOCK, end = min(begin + BLOCK, n);
  int bent[BLOCK + 2 * WIDTH], count = 0;
  for (int p = begin; p < end; p += WIDTH)
    count = append((LOADF(value + n + p) > 0.0f) & (LANES < (float)(end - p)), p, bent, count);
  if (count == 0) return;
  for (int l = 0; l < WIDTH; ++l) bent[count + l] = bent[count - 1];
  for (int first = 0; first < count;) {
    const int* item = bent + first;
    const Query at = {gather_float(cell_x, item), gather_float(cell_y, item),
                      gather_float(cell_z, item), none, none, none};
    const Together own =
        those_together(fits.cells, SPAN, LOADI(item), at.x, at.y, at.z, count - first);
    const Sums means = means_around(fits, own, at);
    const floatv round = gather_float(value + n, item) * smooth_step(SHARP, ROUND, means.a);
    int of[WIDTH];
    for (int l = 0; l < WIDTH; ++l) of[l] = 4 * particle[item[l]] + 3;
    scatter_float(round, surface, of, own.used);
    first += own.count;
  }
}
