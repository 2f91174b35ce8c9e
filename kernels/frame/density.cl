// density.cl: measures the density field (field.cl), which decides where the surface ends
// (paper 2.4.1).
//
// uses: field.cl

// Points that lie nearer than this to the first of them along each axis share a search.
#define TOGETHER 9.0f  // particle radii

// The density at points in rows, of which those at one place of the rows are near each other. One work-item
// per BLOCK places, of which those go together that follow each other and are near: WIDTH points at most,
// so there are no more rows than WIDTH.
kernel void measure_density(global const float* point,  // [3][rows][n]
                            global float* density,      // [rows][n]
                            CELLS_WITH(cell_, cell_weight), const int2 points) {  // n, rows
  const Cells cells = CELLS_OF(cell_);
  const int n = points.x, rows = points.y;
  const int begin = get_global_id(0) * BLOCK, end = min(begin + BLOCK, n), all = rows * n;
  const floatv none = (floatv)(0.0f);
  const intv lane = TO_INTV(LANES), place = lane / rows, row = lane - rows * place;
  for (int first = begin; first < end;) {
    int at[WIDTH];
    STOREI(min(first + place, (intv)(n - 1)) + row * n, at);
    const floatv x = gather_float(point, at), y = gather_float(point + all, at),
                 z = gather_float(point + 2 * all, at);
    const int near = BITS((fabs(x - point[first]) < TOGETHER) & (fabs(y - point[all + first]) < TOGETHER) &
                          (fabs(z - point[2 * all + first]) < TOGETHER) & (place < end - first));
    const int places = max(popcount(near & ~(near + 1)) / rows, 1);  // by the ones before the first zero
    const intv used = place < places;
    Field sum = {none, none, none, none};
    add_cells_around(cells, cell_weight, x, y, z, used, 0, &sum);
    scatter_float(sum.c * NORM, density, at, used);
    first += places;
  }
}

// The cells (cx, cy - 1 .. cy + 1, cz - 1 .. cz + 1): how many particles one of them holds at least,
// and all of them; not counted to the end where one has fewer than `least`.
typedef struct {
  int fewest, sum;
} Slice;

inline Slice slice_of(const Cells cells, const int cx, const int cy, const int cz,
                      const int least) {
  global const int* tags = (global const int*)cells.tag;
  Slice s = {INT_MAX, 0};
  for (int k = -1; k <= 1; ++k)
    for (int j = -1; j <= 1; ++j) {
      const uint bucket = bucket_of(cx, cy + j, cz + k, cells.mask);
      const int tag = (int)tag_of(cx, cy + j, cz + k);
      const int begin = cells.start[bucket], end = cells.start[bucket + 1];
      int count = 0;
      for (int p = begin; p < end; p += WIDTH)
        count += popcount(BITS((LOADI(tags + p) == tag) & (TO_INTV(LANES) < end - p)));
      s.fewest = min(s.fewest, count);
      s.sum += count;
      if (count < least) return s;
    }
  return s;
}

// What is left of the factor of a lone particle where it is one of many, while that is above 1.
#define AMONG_MANY 0.3f

// Turns densities at the particles' own positions into the weights with which the field's level is
// even: `level` for a lone particle, 0.45 inside the fluid, so that a blob is a sphere of the
// particle's radius and the field's face lies where the fitted one does. The level of irregular
// particles is too high for a lone one: where a particle's own share is most of the density, it counts
// up to `lone` times, and drops, threads and thin sheets of any size take as much room as their
// particles.
inline floatv level_weight(const floatv density, const floatv own, const float2 how) {
  const float level = how.x, lone = how.y;
  const floatv t = clamp(2.25f * (density - 0.45f), 0.0f, 1.0f);
  const floatv share = smaller(own / density, (floatv)(1.0f));
  const floatv raised = larger(AMONG_MANY + (lone - AMONG_MANY) * share, (floatv)(1.0f));
  return raised * (level / (level + (0.45f - level) * (t * t * (3.0f - 2.0f * t))));
}

// The field's gradient (1 / particle radii) and value at the particles' own positions, in bucket
// order, and the weights of the levelled field, of particles of one weight. One work-item per BLOCK
// particles. Those inside the fluid are not measured: 0 and 1. There is fluid all around a cell where
// it and each of the 26 about it hold `least` particles or more, and half of their mean number. Of the
// others up to WIDTH go together that lie in SPAN cells of a row.
kernel void measure_gradients(global float* result,  // [4][n] x, y, z, density
                              global float* weight,  // [n] out
                              CELLS_WITH(cell_, cell_weight), const int n,
                              const int least,     // 0: measure everywhere
                              const float2 how) {  // level and lone, see level_weight
  const Cells cells = CELLS_OF(cell_);
  const int begin = get_global_id(0) * BLOCK, end = min(begin + BLOCK, n);
  const floatv none = (floatv)(0.0f);
  int x = INT_MIN, y = 0, z = 0, inside = 0;  // the cell before
  Slice before, here, after;                  // and what is around it
  int place[BLOCK + WIDTH], count = 0;        // those that are measured
  for (int first = begin; first < end;) {
    const Together own = particles_together(cells, 1, first, end, n);
    if (least > 0 && (own.cx != x || own.cy != y || own.cz != z)) {
      const int next = own.cx - 1 == x && own.cy == y && own.cz == z;  // two slices are the same
      x = own.cx;
      y = own.cy;
      z = own.cz;
      before = next ? here : slice_of(cells, x - 1, y, z, least);
      here = next ? after : slice_of(cells, x, y, z, least);
      after = slice_of(cells, x + 1, y, z, least);
      const int fewest = min(before.fewest, min(here.fewest, after.fewest));
      inside = fewest >= least && 2 * 27 * fewest >= before.sum + here.sum + after.sum;
    }
    if (inside) {
      scatter_float(none, result, own.at, own.used);
      scatter_float(none, result + n, own.at, own.used);
      scatter_float(none, result + 2 * n, own.at, own.used);
      scatter_float((floatv)(1.0f), result + 3 * n, own.at, own.used);
      const floatv mass = (floatv)(cell_weight[own.at[0]]);
      scatter_float(level_weight((floatv)(1.0f), mass * NORM, how) * mass, weight, own.at,
                    own.used);
    } else {
      STOREI(first + TO_INTV(LANES), place + count);
      count += own.count;
    }
    first += own.count;
  }
  const float c = cells.inverse_cell;
  for (int k = 0; k < count;) {
    const intv lane = TO_INTV(LANES);
    int at[WIDTH];
    STOREI(SELECT((intv)(place[k]), LOADI(place + k), lane < count - k), at);
    const floatv px = gather_float(cell_x, at), py = gather_float(cell_y, at),
                 pz = gather_float(cell_z, at);
    x = cell_of(cell_x[at[0]], c);
    y = cell_of(cell_y[at[0]], c);
    z = cell_of(cell_z[at[0]], c);
    const intv cx = cells_of(px, c);
    const int same = BITS((intv)(cx >= x) & (cx < x + SPAN) & (cells_of(py, c) == y) &
                          (cells_of(pz, c) == z) & (lane < count - k));
    const int number = popcount(same ^ (same + 1)) - 1;  // ones before the first zero
    const intv used = lane < number;
    Field f = {none, none, none, none};
    add_cells_around(cells, cell_weight, px, py, pz, used, 1, &f);
    scatter_float(gradient_of(f.gx), result, at, used);
    scatter_float(gradient_of(f.gy), result + n, at, used);
    scatter_float(gradient_of(f.gz), result + 2 * n, at, used);
    const floatv density = f.c * NORM;
    scatter_float(density, result + 3 * n, at, used);
    const floatv mass = gather_float(cell_weight, at);
    scatter_float(level_weight(density, mass * NORM, how) * mass, weight, at, used);
    k += number;
  }
}
