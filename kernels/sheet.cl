// sheet.cl: means over the fits of the same sheet around each fit (docs/method.md, fit and trust).
//
// uses: cells.cl

// Fits by cells.
typedef struct {
  Cells cells;
  int n;
  global const float* normal;  // [3][n] in bucket order
  global const float* share;   // [n]
  global const float* value;   // [2][n] a pair of rows
  float reach, low, high;
} Fits;

// Sums of the weights of fits, and of what they weigh.
typedef struct {
  floatv weight, a, b;
} Sums;

// Adds the listed fits at places x, y, z with normals nx, ny, nz.
inline void add_fits(const Fits fits, const int* item, const int count, const floatv x,
                     const floatv y, const floatv z, const floatv nx, const floatv ny,
                     const floatv nz, Sums* result) {
  Sums sums = *result;  // see add_listed in field.cl
  const int n = fits.n;
  global const float* normal = fits.normal;
  for (int k = 0; k < count; ++k) {
    const int p = item[k];
    const floatv dx = x - fits.cells.x[p], dy = y - fits.cells.y[p], dz = z - fits.cells.z[p];
    const floatv near = 1.0f - sqrt(dx * dx + dy * dy + dz * dz) * (1.0f / fits.reach);
    const floatv same = nx * normal[p] + ny * normal[n + p] + nz * normal[2 * n + p];
    const floatv w =
        fits.share[p] * larger(near, (floatv)(0.0f)) * smooth_step(fits.low, fits.high, same);
    sums.weight += w;
    sums.a += w * fits.value[p];
    sums.b += w * fits.value[n + p];
  }
  *result = sums;
}

// Up to WIDTH fits of SPAN cells of a row at a time, BLOCK a work-item. A fit at distance l whose
// normal is n' weighs
//   share (1 - l / reach) smoothstep(low, high, n.n').
// Along the second dimension: pairs of values.
kernel void average_on_sheets(
    global float* mean,  // [2 pairs][n] of the values; 0 where nothing weighs anything
    CELLS(cell_), const int n,
    global const float* normal,  // [3][n] in bucket order
    global const float* share,   // [n]
    global const float* value,   // [2 pairs][n]
    const SheetWeights weights) {
  const Cells cells = CELLS_OF(cell_);
  const int pair = 2 * n * (int)get_global_id(1);
  const Fits fits = {cells, n, normal, share, value + pair, weights.reach, weights.low, weights.high};
  const int begin = get_global_id(0) * BLOCK, end = min(begin + BLOCK, n);
  const floatv none = (floatv)(0.0f);
  for (int first = begin; first < end;) {
    const Together own = particles_together(cells, SPAN, first, end, n);
    const floatv x = LOADF(cell_x + first), y = LOADF(cell_y + first), z = LOADF(cell_z + first);
    const floatv nx = LOADF(normal + first), ny = LOADF(normal + n + first),
                 nz = LOADF(normal + 2 * n + first);
    const Box box = box_of(x, y, z, own.used);
    Sums sums = {none, none, none};
    int item[AT_A_TIME + 2 * WIDTH], count = 0;
    for (int k = -1; k <= 1; ++k)
      for (int j = -1; j <= 1; ++j) {
        const int tag = (int)tag_of(own.cx, own.cy + j, own.cz + k);
        Row row = row_of(own.cx - 1, own.cy + j, own.cz + k, own.wide + 2, cells.mask);
        while (next_range(&row, cells.start, cells.mask))
          for (int p = row.begin; p < row.end; p += WIDTH) {
            count = append(near_box(box, cells, p, fits.reach) &
                               SAME_ROW(LOADI((global const int*)cells.tag + p), tag) &
                               (LANES < (float)(row.end - p)),
                           p, item, count);
            if (count < AT_A_TIME) continue;
            add_fits(fits, item, count, x, y, z, nx, ny, nz, &sums);
            count = 0;
          }
      }
    add_fits(fits, item, count, x, y, z, nx, ny, nz, &sums);
    const floatv scale = SELECT(none, 1.0f / sums.weight, sums.weight > 0.0f);
    scatter_float(sums.a * scale, mean + pair, own.at, own.used);
    scatter_float(sums.b * scale, mean + pair + n, own.at, own.used);
    first += own.count;
  }
}
