// field.cl: the particles' density field C(x) = sum of W(|x - x_j|), the cubic spline of smoothing
// length h = s (two particle radii, support two h), V_j = s^3: 1 inside the fluid, 1/2 on a flat
// face, 1/4 on a square edge, 1/pi at a lone particle. Functions only: density.cl measures it,
// settle.cl follows it along rays.
//
// Whatever the way, a sum takes its particles in one order: by cell (z, then y, then x), then by
// place. So every way and every WIDTH gives the same bits.

#define NORM 0.318309886f  // 1 / pi
#define SUPPORT 4.0f       // particle radii; the side of a cell is at least that

typedef struct {
  global const float* x;  // [n] eye space in bucket order, particle radii
  global const float* y;
  global const float* z;
  global const uint* tag;   // [n] of the particle's cell
  global const int* start;  // [buckets + 1]
  float inverse_cell;       // 1 / (four particle radii or more)
  uint mask;
} Cells;

// pi C and the gradient of pi C times h^2, in particle radii.
typedef struct {
  floatv c, gx, gy, gz;
} Field;

// Adds what the particle with `weight` at distance (dx, dy, dz) does to the field.
inline void add_particle(Field* sum, const floatv dx, const floatv dy, const floatv dz,
                         const float weight, const int with_gradient) {
  const floatv none = (floatv)(0.0f);
  const floatv squared = (dx * dx + dy * dy + dz * dz) * 0.25f;  // (distance / h)^2
  const floatv q = sqrt(squared);
  const floatv r = 2.0f - q;
  const intv core = q < 1.0f, reached = squared < 4.0f;
  sum->c += SELECT(none,
                   weight * SELECT(0.25f * r * r * r, 1.0f - 1.5f * squared + 0.75f * squared * q,
                                   core),
                   reached);
  if (!with_gradient) return;
  // dW/dq / q, times (x - x_j) / h^2
  const floatv outer = -0.75f * r * r / SELECT((floatv)(1.0f), q, q > 0.0f);
  const floatv g = SELECT(none, weight * SELECT(outer, -3.0f + 2.25f * q, core), reached);
  sum->gx += g * dx;
  sum->gy += g * dy;
  sum->gz += g * dz;
}

// Adds the field at points of the cell (cx, cy, cz); what lanes elsewhere get means nothing.
inline void add_cells_around(const Cells cells, global const float* weight, const int cx,
                             const int cy, const int cz, const floatv x, const floatv y,
                             const floatv z, const int with_gradient, Field* sum) {
  for (int k = -1; k <= 1; ++k)
    for (int j = -1; j <= 1; ++j)
      for (int i = -1; i <= 1; ++i) {
        const uint bucket = bucket_of(cx + i, cy + j, cz + k, cells.mask);
        const uint tag = tag_of(cx + i, cy + j, cz + k);
        const int end = cells.start[bucket + 1];
        for (int p = cells.start[bucket]; p < end; ++p) {
          if (cells.tag[p] != tag) continue;
          add_particle(sum, x - cells.x[p], y - cells.y[p], z - cells.z[p], weight[p],
                       with_gradient);
        }
      }
}

// The field at any points.
inline Field field_at(const Cells cells, global const float* weight, const floatv x,
                      const floatv y, const floatv z, const int with_gradient) {
  float px[WIDTH], py[WIDTH], pz[WIDTH];
  int mine[WIDTH], left[WIDTH];
  STOREF(x, px);
  STOREF(y, py);
  STOREF(z, pz);
  const floatv none = (floatv)(0.0f);
  Field field = {none, none, none, none};
  for (int k = 0; k < WIDTH; ++k) left[k] = 1;
  for (int first = 0; first < WIDTH; ++first) {  // the lanes of one cell go together
    if (!left[first]) continue;
    const int cx = cell_of(px[first], cells.inverse_cell),
              cy = cell_of(py[first], cells.inverse_cell),
              cz = cell_of(pz[first], cells.inverse_cell);
    for (int k = 0; k < WIDTH; ++k) {
      mine[k] = left[k] && cell_of(px[k], cells.inverse_cell) == cx &&
                cell_of(py[k], cells.inverse_cell) == cy &&
                cell_of(pz[k], cells.inverse_cell) == cz;
      if (mine[k]) left[k] = 0;
    }
    Field sum = {none, none, none, none};
    add_cells_around(cells, weight, cx, cy, cz, x, y, z, with_gradient, &sum);
#if WIDTH == 1
    field = sum;
#else
    const intv here = LOADI(mine) != 0;
    field.c = SELECT(field.c, sum.c, here);
    field.gx = SELECT(field.gx, sum.gx, here);
    field.gy = SELECT(field.gy, sum.gy, here);
    field.gz = SELECT(field.gz, sum.gz, here);
#endif
  }
  return field;
}

// The particles near a beam of rays, so that the field along it needs no search.
#define NEAR 192
typedef struct {
  int count;  // -1: more than NEAR, search at every point
  int item[NEAR];
} Near;

// Lists the particles within the support of a wanted ray between depths `low` and `high`.
inline void list_near(const Cells cells, const Rays r, const intv wanted, const float low,
                      const float high, Near* near) {
  float x0[WIDTH], y0[WIDTH], x1[WIDTH], y1[WIDTH];
  int want[WIDTH];
  STOREF(r.ox + low * r.dx, x0);
  STOREF(r.oy + low * r.dy, y0);
  STOREF(r.ox + high * r.dx, x1);
  STOREF(r.oy + high * r.dy, y1);
  STOREI(wanted, want);
  // The axis between the middles of the beam's ends, and how far rays are from it.
  float ax = 0.0f, ay = 0.0f, bx = 0.0f, by = 0.0f, lanes = 0.0f;
  for (int k = 0; k < WIDTH; ++k) {
    if (!want[k]) continue;
    ax += x0[k];
    ay += y0[k];
    bx += x1[k];
    by += y1[k];
    lanes += 1.0f;
  }
  ax /= lanes;
  ay /= lanes;
  bx /= lanes;
  by /= lanes;
  float wide = 0.0f;
  for (int k = 0; k < WIDTH; ++k) {
    if (!want[k]) continue;
    wide = fmax(wide, (x0[k] - ax) * (x0[k] - ax) + (y0[k] - ay) * (y0[k] - ay));
    wide = fmax(wide, (x1[k] - bx) * (x1[k] - bx) + (y1[k] - by) * (y1[k] - by));
  }
  const float reach = SUPPORT + sqrt(wide) + 0.01f;  // with room for rounding
  const float ex = bx - ax, ey = by - ay, ez = low - high;
  const float per_length = 1.0f / fmax(ex * ex + ey * ey + ez * ez, 1e-12f);
  const float c = cells.inverse_cell, side = 1.0f / c;
  const float far = reach + 0.87f * side;  // half of a cell's diagonal more
  const int i0 = cell_of(fmin(ax, bx) - reach, c), i1 = cell_of(fmax(ax, bx) + reach, c);
  const int j0 = cell_of(fmin(ay, by) - reach, c), j1 = cell_of(fmax(ay, by) + reach, c);
  const int k0 = cell_of(-high - reach, c), k1 = cell_of(-low + reach, c);
  int count = 0;
  for (int k = k0; k <= k1; ++k)
    for (int j = j0; j <= j1; ++j)
      for (int i = i0; i <= i1; ++i) {
        const float mx = ((float)i + 0.5f) * side - ax, my = ((float)j + 0.5f) * side - ay,
                    mz = ((float)k + 0.5f) * side + low;
        const float m = clamp((mx * ex + my * ey + mz * ez) * per_length, 0.0f, 1.0f);
        const float lx = mx - m * ex, ly = my - m * ey, lz = mz - m * ez;
        if (lx * lx + ly * ly + lz * lz > far * far) continue;
        const uint bucket = bucket_of(i, j, k, cells.mask);
        const uint tag = tag_of(i, j, k);
        const int end = cells.start[bucket + 1];
        for (int p = cells.start[bucket]; p < end; p += WIDTH) {
          const floatv dx = LOADF(cells.x + p) - ax, dy = LOADF(cells.y + p) - ay,
                       dz = LOADF(cells.z + p) + low;
          const floatv s = clamp((dx * ex + dy * ey + dz * ez) * per_length, 0.0f, 1.0f);
          const floatv qx = dx - s * ex, qy = dy - s * ey, qz = dz - s * ez;
          const intv close = qx * qx + qy * qy + qz * qz <= reach * reach;
          if (!ANY(close)) continue;
          int take[WIDTH];
          STOREI(close, take);
          const int lanes_left = min(WIDTH, end - p);
          for (int l = 0; l < lanes_left; ++l) {
            if (!take[l] || cells.tag[p + l] != tag) continue;
            if (count == NEAR) {
              near->count = -1;
              return;
            }
            near->item[count++] = p + l;
          }
        }
      }
  near->count = count;
}

// The field at points of the beam.
inline Field field_near(const Cells cells, global const float* weight, const Near* near,
                        const Rays r, const floatv t, const int with_gradient) {
  const floatv x = r.ox + t * r.dx, y = r.oy + t * r.dy, z = -t;
  if (near->count < 0) return field_at(cells, weight, x, y, z, with_gradient);
  const floatv none = (floatv)(0.0f);
  Field field = {none, none, none, none};
  for (int k = 0; k < near->count; ++k) {
    const int p = near->item[k];
    add_particle(&field, x - cells.x[p], y - cells.y[p], z - cells.z[p], weight[p],
                 with_gradient);
  }
  return field;
}
