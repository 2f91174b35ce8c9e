// motion.cl: how the surface moves: at each point the mean of the particles' velocities, weighed by
//
//   w = (1 - d^2 / 4^2)^4    d: distance, particle radii
//
// which differs from the cubic spline by at most .075 of the value at 0, has the density's
// support and needs no root. Points with no particle within FAR get nothing: the host widens the support
// there.
//
// A work-item takes COUNT points that lie close together, so that one search serves them. A sum
// takes its particles in one order: by cell (z, then y, then x), then by place. What is out of reach
// has no weight, so that it does not matter who else is looked at: every WIDTH gives the same bits.
//
// uses: cells.cl

#define FAR 3.0f      // particle radii
#define APART 2.0f    // points this near another one search with it, particle radii

#define COUNT (ROWS * WIDTH)
#if WIDTH == 1
#define NEAR 1
#else
#define NEAR 64  // particles that are found before they are added
#endif

typedef struct {
  Cells cells;                   // of a side of MOTION_SUPPORT or more
  global const float* velocity;  // [3][n] world units per second
  int n;
} Moving;

typedef struct {
  float x[COUNT], y[COUNT], z[COUNT];     // eye space, particle radii
  int left[COUNT];                        // not 0: without a result so far
  float mx[COUNT], my[COUNT], mz[COUNT];  // results
  int here[COUNT];                        // -1: among those that search together now, else 0
  // Sums over particles:
  float near[COUNT];                       // 1 - (d/4)^2 of the nearest, 0 where none is in reach
  float weight[COUNT];                     // of weights
  float vx[COUNT], vy[COUNT], vz[COUNT];  // of weighted velocities
} Points;

// Adds `count` particles to the sums.
inline void add_found(const Moving all, const int* found, const int count, Points* points) {
  const floatv none = (floatv)(0.0f);
  for (int r = 0; r < COUNT; r += WIDTH) {
    if (!ANY(LOADI(points->here + r) != 0)) continue;
    const floatv x = LOADF(points->x + r), y = LOADF(points->y + r), z = LOADF(points->z + r);
    floatv near = LOADF(points->near + r), weight = LOADF(points->weight + r);
    floatv vx = LOADF(points->vx + r), vy = LOADF(points->vy + r), vz = LOADF(points->vz + r);
    for (int k = 0; k < count; ++k) {
      const int p = found[k];
      const floatv dx = x - all.cells.x[p], dy = y - all.cells.y[p], dz = z - all.cells.z[p];
      const floatv inner =
          larger(1.0f - (dx * dx + dy * dy + dz * dz) * (1.0f / (MOTION_SUPPORT * MOTION_SUPPORT)), none);
      const floatv w = (inner * inner) * (inner * inner);
      near = larger(near, inner);
      weight += w;
      vx = fma(w, (floatv)(all.velocity[p]), vx);
      vy = fma(w, (floatv)(all.velocity[all.n + p]), vy);
      vz = fma(w, (floatv)(all.velocity[2 * all.n + p]), vz);
    }
    STOREF(near, points->near + r);
    STOREF(weight, points->weight + r);
    STOREF(vx, points->vx + r);
    STOREF(vy, points->vy + r);
    STOREF(vz, points->vz + r);
  }
}

// The square of how far a coordinate lies outside cell i.
inline float outside(const float coordinate, const int i, const float side) {
  const float below = (float)i * side - coordinate, above = -below - side;
  const float apart = below > 0.0f ? below : above > 0.0f ? above : 0.0f;
  return apart * apart;
}

// The sums at the points near the first one that is left; others get anything.
inline void sum_around(const Moving all, const int first, Points* points) {
  const floatv none = (floatv)(0.0f), most = (floatv)(INFINITY);
  floatv lx = most, ly = most, lz = most, hx = most, hy = most, hz = most;
  for (int r = 0; r < COUNT; r += WIDTH) {
    const floatv x = LOADF(points->x + r), y = LOADF(points->y + r), z = LOADF(points->z + r);
    const intv here = (LOADI(points->left + r) != 0) & (fabs(x - points->x[first]) <= APART) &
                      (fabs(y - points->y[first]) <= APART) &
                      (fabs(z - points->z[first]) <= APART);
    STOREI(here, points->here + r);
    STOREF(none, points->near + r);
    STOREF(none, points->weight + r);
    STOREF(none, points->vx + r);
    STOREF(none, points->vy + r);
    STOREF(none, points->vz + r);
    lx = SELECT(lx, smaller(lx, x), here);
    ly = SELECT(ly, smaller(ly, y), here);
    lz = SELECT(lz, smaller(lz, z), here);
    hx = SELECT(hx, smaller(hx, -x), here);
    hy = SELECT(hy, smaller(hy, -y), here);
    hz = SELECT(hz, smaller(hz, -z), here);
  }
  const float x0 = least_lane(lx), x1 = -least_lane(hx), y0 = least_lane(ly),
              y1 = -least_lane(hy), z0 = least_lane(lz), z1 = -least_lane(hz);
  // All that is within reach of their middle.
  const float mx = 0.5f * (x0 + x1), my = 0.5f * (y0 + y1), mz = 0.5f * (z0 + z1);
  const float wide = sqrt((x1 - mx) * (x1 - mx) + (y1 - my) * (y1 - my) + (z1 - mz) * (z1 - mz));
  const float reach = MOTION_SUPPORT + wide + 0.01f;  // with room for rounding
  const float squared = reach * reach, c = all.cells.inverse_cell, side = 1.0f / c;
  const int j0 = cell_of(my - reach, c), j1 = cell_of(my + reach, c);
  const int k0 = cell_of(mz - reach, c), k1 = cell_of(mz + reach, c);
  int found[NEAR + WIDTH], count = 0;
  for (int k = k0; k <= k1; ++k)
    for (int j = j0; j <= j1; ++j) {
      const float rest = squared - outside(mz, k, side) - outside(my, j, side);
      if (rest < 0.0f) continue;
      const float half_row = sqrt(rest);
      const int i1 = cell_of(mx + half_row, c);
      for (int i = cell_of(mx - half_row, c); i <= i1; ++i) {
        const uint bucket = bucket_of(i, j, k, all.cells.mask);
        const uint tag = tag_of(i, j, k);
        const int end = all.cells.start[bucket + 1];
        for (int p = all.cells.start[bucket]; p < end; p += WIDTH) {
          const floatv px = LOADF(all.cells.x + p) - mx, py = LOADF(all.cells.y + p) - my,
                       pz = LOADF(all.cells.z + p) - mz;
          const intv close = px * px + py * py + pz * pz <= squared;
          if (!ANY(close)) continue;
          int take[WIDTH];
          STOREI(close, take);
          const int last = min(p + WIDTH, end);
          for (int q = p; q < last; ++q) {  // without branches, which could not be foreseen
            found[count] = q;
            count += (take[q - p] != 0) & (all.cells.tag[q] == tag);
          }
          if (count < NEAR) continue;
          add_found(all, found, count, points);
          count = 0;
        }
      }
    }
  add_found(all, found, count, points);
}

// The mean velocity at the points that are left, INFINITY where no particle is near.
inline void find_motion(const Moving all, Points* points) {
  const floatv nothing = (floatv)(INFINITY), one = (floatv)(1.0f);
  for (int first = 0; first < COUNT; ++first) {
    if (!points->left[first]) continue;
    sum_around(all, first, points);
    for (int r = 0; r < COUNT; r += WIDTH) {
      const intv here = LOADI(points->here + r) != 0;
      const intv met = LOADF(points->near + r) >= 1.0f - FAR * FAR / (MOTION_SUPPORT * MOTION_SUPPORT);
      const floatv share = one / SELECT(one, LOADF(points->weight + r), met);
      const floatv x = SELECT(nothing, LOADF(points->vx + r) * share, met);
      const floatv y = SELECT(nothing, LOADF(points->vy + r) * share, met);
      const floatv z = SELECT(nothing, LOADF(points->vz + r) * share, met);
      STOREF(SELECT(LOADF(points->mx + r), x, here), points->mx + r);
      STOREF(SELECT(LOADF(points->my + r), y, here), points->my + r);
      STOREF(SELECT(LOADF(points->mz + r), z, here), points->mz + r);
      STOREI(SELECT(LOADI(points->left + r), (intv)(0), here), points->left + r);
    }
  }
}

// Stores `count` or WIDTH results of a row of WIDTH points.
inline void store_row(const Points* points, const int row, const int count, global float* motion,
                      const int stride) {
  const int r = row * WIDTH;
  store_lanes(LOADF(points->mx + r), motion, count);
  store_lanes(LOADF(points->my + r), motion + stride, count);
  store_lanes(LOADF(points->mz + r), motion + 2 * stride, count);
}

// `count` or WIDTH values, `otherwise` in the other lanes.
inline floatv load_lanes_or(global const float* from, const int count, const float otherwise) {
  if (count >= WIDTH) return LOADF(from);
  float lanes[WIDTH];
  for (int lane = 0; lane < WIDTH; ++lane) lanes[lane] = lane < count ? from[lane] : otherwise;
  return LOADF(lanes);
}

// At the samples of a depth map where there is surface. A work-item takes a bin of them, or one.
kernel void motion_of_samples(global const float* depth,  // [ny*nx] particle radii
                              global float* motion,       // [3][ny*nx] out where depth is finite
                              CELLS_WITH(cell_, velocity), const int n, const int2 bins,
                              const Screen screen) {
  const int items = BIN * BIN / COUNT;
  const int bin = get_global_id(0) / items, item = get_global_id(0) % items;
  if (bin >= bins.x * bins.y) return;
  const int i = bin % bins.x * BIN + item * WIDTH % BIN;
  const int j = bin / bins.x * BIN + item * WIDTH / BIN;
  Points points;
  const floatv none = (floatv)(0.0f);
  int any = 0;
  for (int row = 0; row < ROWS; ++row) {
    const int r = row * WIDTH;
    floatv t = (floatv)(INFINITY);
    if (j + row < screen.ny)
      t = load_lanes_or(depth + (j + row) * screen.nx + i, screen.nx - i, INFINITY);
    const intv there = t < INFINITY;
    any |= ANY(there);
    STOREI(there, points.left + r);
    const Rays ray = rays_at(screen.rays, screen.first + screen.step * ((float)i + LANES),
                             (floatv)(screen.first + screen.step * (float)(j + row)));
    STOREF(ray.ox + t * ray.dx, points.x + r);
    STOREF(ray.oy + t * ray.dy, points.y + r);
    STOREF(-t, points.z + r);
    STOREF(none, points.mx + r);
    STOREF(none, points.my + r);
    STOREF(none, points.mz + r);
  }
  if (!any) return;
  const Moving all = {CELLS_OF(cell_), velocity, n};
  find_motion(all, &points);
  for (int row = 0; row < ROWS && j + row < screen.ny; ++row)
    store_row(&points, row, screen.nx - i, motion + (j + row) * screen.nx + i,
              screen.nx * screen.ny);
}

// At any points; those that follow each other had better lie close together. A work-item takes
// COUNT of them.
kernel void motion_of_points(POINTS(x, y, z),       // [count] eye space, particle radii
                             global float* motion,  // [3][count] out
                             CELLS_WITH(cell_, velocity), const int n, const int count) {
  const int p = get_global_id(0) * COUNT;
  if (p >= count) return;
  Points points;
  for (int k = 0; k < COUNT; ++k) {
    const int at = p + k < count ? p + k : p;
    points.left[k] = p + k < count;
    points.x[k] = x[at];
    points.y[k] = y[at];
    points.z[k] = z[at];
    points.mx[k] = points.my[k] = points.mz[k] = 0.0f;
  }
  const Moving all = {CELLS_OF(cell_), velocity, n};
  find_motion(all, &points);
  for (int row = 0; row < ROWS && p + row * WIDTH < count; ++row)
    store_row(&points, row, count - p - row * WIDTH, motion + p + row * WIDTH, count);
}
