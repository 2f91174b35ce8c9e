// interpolate.cl: samples between those of a coarser lattice, where the surface is smooth enough
// that evaluating it there would say the same. The lattice has every second of the samples that are
// asked for, `every`th ones of each row and column; a cell of it is the 2 x 2 of those from its upper
// left corner on. One work-item per WIDTH cells of a row.

// A corner of the cells: point of the surface in eye space, normal, depth.
typedef struct {
  floatv x, y, z, nx, ny, nz, t;
} Corner;

// Samples of the cells' corners; lanes past the last cell repeat it.
inline void corners_of(const int a, const int b, const int right, const int down,
                       const int2 samples, const int2 cells, const int every, int* at) {
#pragma unroll
  for (int k = 0; k < WIDTH; ++k)
    at[k] = min(every * (2 * b + down), samples.y - 1) * samples.x +
            min(every * (2 * min(a + k, cells.x - 1) + right), samples.x - 1);
}

inline Corner corner_at(global const float* depth, global const float* normal, const int* at,
                        const int n, const Rays r) {
  Corner c;
  c.t = gather_float(depth, at);
  c.x = r.ox + c.t * r.dx;
  c.y = r.oy + c.t * r.dy;
  c.z = -c.t;
  c.nx = gather_float(normal, at);
  c.ny = gather_float(normal + n, at);
  c.nz = gather_float(normal + 2 * n, at);
  return c;
}

// How far two corners lie from each other's planes, the larger of both.
inline floatv apart(const Corner a, const Corner b) {
  const floatv x = b.x - a.x, y = b.y - a.y, z = b.z - a.z;
  return fmax(fabs(a.nx * x + a.ny * y + a.nz * z), fabs(b.nx * x + b.ny * y + b.nz * z));
}

inline floatv agreement(const Corner a, const Corner b) {
  return a.nx * b.nx + a.ny * b.ny + a.nz * b.nz;
}

// What a cell's corners say.
#define ROUGH 0
#define SMOOTH 1  // one smooth surface: each corner lies near the others' planes
#define EMPTY 2   // no surface
#define OPEN 3    // no surface in the front layer

inline Rays corner_ray(const float16 rays, const int a, const int b, const int right,
                       const int down, const float first, const float step) {
  return rays_at(rays, first + step * (2.0f * ((float)a + LANES) + (float)right),
                 (floatv)(first + step * (float)(2 * b + down)));
}

kernel void compare_corners(global const float* depth,   // [samples] of the lattice's samples
                            global const float* normal,  // [3][samples]
                            global const uchar* kind,    // [samples]
                            global const float* open,    // [samples] finite: it is not known yet what
                                                         // the sample shows
                            global uchar* shows,         // [cells] out
                            const int2 samples, const int2 cells, const float first,
                            const float step,  // of the samples asked for, pixels
                            const float16 rays, const int every,
                            const float tolerance,  // of corners to planes, particle radii
                            const float agreeing,   // the least cosine between their normals
                            const int trust_empty) {  // 1: nothing fits between the lattice's
                                                      // samples
  const int a = get_global_id(0) * WIDTH, b = get_global_id(1);
  if (a >= cells.x || b >= cells.y) return;
  const int n = samples.x * samples.y;
  int at[4][WIDTH], smooth[WIDTH];
  Corner corner[4];
  intv covered = (intv)(0);
#pragma unroll
  for (int k = 0; k < 4; ++k) {
    corners_of(a, b, 2 * (k & 1), k & 2, samples, cells, every, at[k]);
    covered += SELECT((intv)(0), (intv)(1), gather_float(depth, at[k]) < INFINITY);
  }
  intv agree = covered == 4;
  if (ANY(agree)) {
#pragma unroll
    for (int k = 0; k < 4; ++k)
      corner[k] = corner_at(depth, normal, at[k], n,
                            corner_ray(rays, a, b, 2 * (k & 1), k & 2, first, step));
    const floatv farthest =
        fmax(fmax(fmax(apart(corner[0], corner[1]), apart(corner[0], corner[2])),
                  fmax(apart(corner[3], corner[1]), apart(corner[3], corner[2]))),
             fmax(apart(corner[0], corner[3]), apart(corner[1], corner[2])));
    const floatv turned = fmin(agreement(corner[0], corner[3]), agreement(corner[1], corner[2]));
    agree &= (farthest < tolerance) & (turned > agreeing);
  }
  STOREI(agree, smooth);
  int corners[WIDTH];
  STOREI(covered, corners);
  const int row_ends = every * (2 * b + 2) >= samples.y;
  for (int k = 0; k < WIDTH; ++k) {
    if (a + k >= cells.x) break;
    int found = ROUGH;
    if (smooth[k]) {
      const uchar own = kind[at[0][k]];
      if (own == kind[at[1][k]] && own == kind[at[2][k]] && own == kind[at[3][k]]) found = SMOOTH;
    } else if (corners[k] == 0 && trust_empty) {
      const int any_open = (open[at[0][k]] < INFINITY) | (open[at[1][k]] < INFINITY) |
                           (open[at[2][k]] < INFINITY) | (open[at[3][k]] < INFINITY);
      found = any_open ? OPEN : EMPTY;
    }
    // A cell that ends outside the image has no corner there.
    shows[b * cells.x + a + k] = row_ends || every * (2 * (a + k) + 2) >= samples.x ? ROUGH : found;
  }
}

// The surface on a ray between `number` corners.
typedef struct {
  floatv depth, nx, ny, nz;
  intv sure;  // it faces the ray and the corners' planes agree about the depth
} Between;

inline void add_corner(Between* sum, floatv* linear, floatv* low, floatv* high, const Corner c,
                       const Rays r, const int perspective) {
  const floatv slope = c.nx * r.dx + c.ny * r.dy - c.nz;
  const floatv t = (c.nx * (c.x - r.ox) + c.ny * (c.y - r.oy) + c.nz * c.z) / slope;
  sum->sure &= slope < -0.1f;
  sum->depth += t;
  *low = fmin(*low, t);
  *high = fmax(*high, t);
  *linear += perspective ? 1.0f / c.t : c.t;
  sum->nx += c.nx;
  sum->ny += c.ny;
  sum->nz += c.nz;
}

// Over a surface of constant curvature the chord lies as far on its one side as the planes that
// touch it at the corners lie on the other, and these planes agree about the depth.
inline Between between(const Corner* corner, const int* which, const int number, const Rays r,
                       const intv smooth, const float spread, const int perspective) {
  const floatv none = (floatv)(0.0f);
  Between b = {none, none, none, none, smooth};
  floatv linear = none, low = (floatv)(INFINITY), high = none;
#pragma unroll
  for (int k = 0; k < number; ++k)
    add_corner(&b, &linear, &low, &high, corner[which[k]], r, perspective);
  b.sure &= high - low < spread;
  const float share = 1.0f / (float)number;
  linear = perspective ? 1.0f / (linear * share) : linear * share;
  b.depth = 0.5f * (linear + b.depth * share);
  const floatv size = 1.0f / sqrt(fmax(b.nx * b.nx + b.ny * b.ny + b.nz * b.nz, (floatv)(1e-30f)));
  b.nx *= size;
  b.ny *= size;
  b.nz *= size;
  return b;
}

// What two cells say of the sample between them, which lies between two of their corners: both are on
// one smooth surface where either cell is, and it is open where one of two without surface is.
inline int between_cells(const int a, const int b) {
  if (a == SMOOTH || b == SMOOTH) return SMOOTH;
  return a == ROUGH || b == ROUGH ? ROUGH : max(a, b);
}

// The samples of each cell but the lattice's own. One between two of the lattice's lies between two
// cells.
kernel void interpolate_samples(global const uchar* shows,      // [cells]
                                global const float* reference,  // [samples] finite where there may
                                                                // be surface
                                global const float* splash,     // [samples] finite where there may
                                                                // be splash
                                global float* depth,            // [samples] in and out
                                global float* normal,           // [3][samples] in and out
                                global int* group,              // [samples] in and out
                                global uchar* kind,             // [samples] in and out
                                global float* wanted,  // [samples] out, finite: to be evaluated;
                                                       // +inf before
                                global float* open,    // [samples] out where the front layer shows
                                                       // nothing: its reference depth
                                const int2 samples, const int2 cells, const float first,
                                const float step, const float16 rays, const int every,
                                const float spread,  // of the depths by the corners' planes, at
                                                     // most, particle radii
                                const int perspective) {
  const int a = get_global_id(0) * WIDTH, b = get_global_id(1);
  if (a >= cells.x || b >= cells.y) return;
  const int n = samples.x * samples.y;
  // What each of the three samples' cells say: right of the corner, below it, and between both.
  int says[3][WIDTH], smooth[3][WIDTH];
  int any_smooth = 0, all_empty = 1;
  for (int k = 0; k < WIDTH; ++k) {
    const int c = min(a + k, cells.x - 1), cell = b * cells.x + c, own = shows[cell];
    says[0][k] = between_cells(own, b == 0 ? own : shows[cell - cells.x]);
    says[1][k] = between_cells(own, c == 0 ? own : shows[cell - 1]);
    says[2][k] = own;
    for (int m = 0; m < 3; ++m) {
      smooth[m][k] = says[m][k] == SMOOTH ? -1 : 0;
      any_smooth |= smooth[m][k];
      all_empty &= says[m][k] == EMPTY;
    }
  }
  if (all_empty) return;
  Corner corner[4];
  if (any_smooth) {
    int at[WIDTH];
#pragma unroll
    for (int k = 0; k < 4; ++k) {
      corners_of(a, b, 2 * (k & 1), k & 2, samples, cells, every, at);
      corner[k] = corner_at(depth, normal, at, n,
                            corner_ray(rays, a, b, 2 * (k & 1), k & 2, first, step));
    }
  }
#pragma unroll  // so that corners stay in registers
  for (int m = 0; m < 3; ++m) {
    const int right = m != 1, down = m != 0, row = every * (2 * b + down);
    if (row >= samples.y) continue;
    float t[WIDTH], nx[WIDTH], ny[WIDTH], nz[WIDTH];
    int sure[WIDTH];
    if (any_smooth) {
      const int which[3][4] = {{0, 1, 0, 0}, {0, 2, 0, 0}, {0, 1, 2, 3}};
      const Between s =
          between(corner, which[m], m == 2 ? 4 : 2, corner_ray(rays, a, b, right, down, first, step),
                  LOADI(smooth[m]) != 0, spread, perspective);
      STOREF(s.depth, t);
      STOREF(s.nx, nx);
      STOREF(s.ny, ny);
      STOREF(s.nz, nz);
      STOREI(s.sure, sure);
    }
    for (int k = 0; k < WIDTH; ++k) {
      const int i = every * (2 * (a + k) + right), at = row * samples.x + i;
      if (i >= samples.x || says[m][k] == EMPTY) continue;
      if (any_smooth && sure[k]) {
        const int corner_sample = 2 * every * (b * samples.x + a + k);
        depth[at] = t[k];
        normal[at] = nx[k];
        normal[n + at] = ny[k];
        normal[2 * n + at] = nz[k];
        group[at] = group[corner_sample];
        kind[at] = kind[corner_sample];
      } else if (says[m][k] == OPEN && reference[at] < INFINITY) {
        open[at] = reference[at];
      } else {
        wanted[at] = fmin(reference[at], splash[at]);
      }
    }
  }
}
