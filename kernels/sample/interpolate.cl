// interpolate.cl: samples between those of a coarser lattice, where the surface is smooth enough
// that evaluating it there would give the same. The lattice has every second of the samples that are
// wanted, `every`th ones of each row and column; a cell of it is the 2 x 2 of those from its upper
// left corner on. One work-item per WIDTH cells of a row.

// A corner of the cells: point of the surface in eye space, normal, depth.
typedef struct {
  floatv x, y, z, nx, ny, nz, t;
  floatv linear;  // what a plane's is linear over the screen: the depth or, in perspective, 1 / depth
} Corner;

// Values of a row of samples: every `stride`th from `first` on, one for each of WIDTH cells. Past the
// row's last sample, its value. With `whole`, those between may be loaded, too: no other work-item
// writes them.
#if WIDTH == 8
#define EVERY_SECOND(p) (vload16(0, (p)).even)
#endif
inline floatv spread_floats(global const float* row, const int first, const int stride,
                            const int last, const int whole) {
#if WIDTH == 8
  if (whole && stride == 2 && first + 2 * WIDTH <= last + 1) return EVERY_SECOND(row + first);
#endif
  float lane[WIDTH];
#pragma unroll
  for (int k = 0; k < WIDTH; ++k) lane[k] = row[min(first + k * stride, last)];
  return LOADF(lane);
}

inline intv spread_bytes(global const uchar* row, const int first, const int stride,
                         const int last) {
#if WIDTH == 8
  if (stride == 2 && first + 2 * WIDTH <= last + 1)
    return convert_int8(EVERY_SECOND(row + first));
#endif
  int lane[WIDTH];
#pragma unroll
  for (int k = 0; k < WIDTH; ++k) lane[k] = row[min(first + k * stride, last)];
  return LOADI(lane);
}

// At how many samples of their blocks of 8 x 8 a map is finite: of a row's samples, as above. Cells
// that are taken together begin at a block's first sample, or right of it.
inline intv spread_counts(global const int* row, const int first, const int stride,
                          const int last) {
#if WIDTH == 8
  if (stride == 2) {
    const int2 two = vload2(0, row + first / 8);
    return two.xxxxyyyy;
  }
  if (stride == 4) {
    const int4 four = vload4(0, row + first / 8);
    return four.xxyyzzww;
  }
#endif
  int lane[WIDTH];
#pragma unroll
  for (int k = 0; k < WIDTH; ++k) lane[k] = row[min(first + k * stride, last) / 8];
  return LOADI(lane);
}

// A cell's right corner is the next cell's left one.
#if WIDTH == 1
#define SHIFTED(type, v, next) ((type)(next))
#define SHIFTED_BACK(type, v, before) ((type)(before))
#else
#define SHIFTED(type, v, next) ((type)((v).s123, (v).s4567, (next)))
#define SHIFTED_BACK(type, v, before) ((type)((before), (v).s012, (v).s3456))
#endif

// Values at the left and at the right corners of WIDTH cells.
inline void pair_of(global const float* row, const int first, const int side, const int last,
                    const int whole, floatv* left, floatv* right) {
  *left = spread_floats(row, first, side, last, whole);
  *right = SHIFTED(floatv, *left, row[min(first + WIDTH * side, last)]);
}

// Normals and, from the depths, points at these corners.
inline void complete_pair(global const float* normal, const int n, const int first, const int side,
                          const int last, const int whole, const Rays r_left, const Rays r_right,
                          Corner* left, Corner* right) {
  pair_of(normal, first, side, last, whole, &left->nx, &right->nx);
  pair_of(normal + n, first, side, last, whole, &left->ny, &right->ny);
  pair_of(normal + 2 * n, first, side, last, whole, &left->nz, &right->nz);
  left->x = r_left.ox + left->t * r_left.dx;
  left->y = r_left.oy + left->t * r_left.dy;
  left->z = -left->t;
  right->x = r_right.ox + right->t * r_right.dx;
  right->y = r_right.oy + right->t * r_right.dy;
  right->z = -right->t;
}

// How far two corners lie from each other's planes, the larger of both.
inline floatv apart(const Corner a, const Corner b) {
  const floatv x = b.x - a.x, y = b.y - a.y, z = b.z - a.z;
  return larger(fabs(a.nx * x + a.ny * y + a.nz * z), fabs(b.nx * x + b.ny * y + b.nz * z));
}

inline floatv agreement(const Corner a, const Corner b) {
  return a.nx * b.nx + a.ny * b.ny + a.nz * b.nz;
}

// The kind of a cell, by its corners. A sample between two cells lies between two of their corners and has
// the larger kind: both are on one smooth surface where either cell is, and it is open where one of two
// without surface is.
#define EMPTY 0   // no surface
#define OPEN 1    // no surface in the front layer
#define ROUGH 2
#define SMOOTH 3  // one smooth surface: each corner lies near the others' planes

// `fine`: the screen of all samples that are wanted, twice as many along each side as the lattice has.
inline Rays corner_ray(const Screen fine, const int a, const int b, const int right,
                       const int down) {
  return rays_at(fine.rays, fine.first + fine.step * (2.0f * ((float)a + LANES) + (float)right),
                 (floatv)(fine.first + fine.step * (float)(2 * b + down)));
}

// The four corners of WIDTH cells, whose depths are known. `whole`: see spread_floats, of the lower
// ones.
inline void complete_corners(global const float* normal, const int n, const int a, const int b,
                             const int upper, const int lower, const int side, const int last,
                             const int whole, const Screen fine, Corner* corner) {
  complete_pair(normal + upper, n, a * side, side, last, 1,
                corner_ray(fine, a, b, 0, 0),
                corner_ray(fine, a, b, 2, 0), corner, corner + 1);
  complete_pair(normal + lower, n, a * side, side, last, whole,
                corner_ray(fine, a, b, 0, 2),
                corner_ray(fine, a, b, 2, 2), corner + 2, corner + 3);
}

// Whether any block is occupied that has samples of columns i.x to i.y in rows j.x to j.y.
inline int any_occupied(global const int* occupied, const int2 i, const int2 j,
                        const int samples_x) {
  int any_block = 0;
  for (int y = j.x / 8; y <= j.y / 8; ++y) {
    global const int* row = occupied + block_of(0, 8 * y, samples_x);
    for (int x = i.x / 8; x <= i.y / 8; ++x) any_block |= row[x];
  }
  return any_block;
}

kernel void compare_corners(CORNERS(depth, normal, kind),  // of the lattice's samples
                            global const float* open,      // [samples] finite: it is not known yet
                                                           // what the sample shows
                            global const int* occupied,    // [blocks] 0: `open` is infinite in all
                                                           // of a block
                            global const int* splash_occupied,  // [blocks] where both are 0 there
                                                                // is no surface
                            global uchar* shows,                // [rows][stride] of cells, out
                            const Screen screen, const LatticeCells cells) {
  const int a = get_global_id(0) * WIDTH, b = get_global_id(1);
  if (a >= cells.cells_x || b >= cells.cells_y) return;
  const int every = cells.every, stride = cells.stride;
  const int2 samples = (int2)(screen.nx, screen.ny);
  const int n = samples.x * samples.y, side = 2 * every, i = side * a, last = samples.x - 1;
  const int2 columns = min(i + (int2)(0, WIDTH * side), (int2)(last));
  const int2 rows = min(side * (b + (int2)(0, 1)), (int2)(samples.y - 1));
  const int any_front = any_occupied(occupied, columns, rows, samples.x);
  if (cells.trust_empty && !any_front && !any_occupied(splash_occupied, columns, rows, samples.x)) {
    STORE_BYTES((intv)(EMPTY), shows + b * stride + a);
    return;
  }
  const int upper = rows.x * samples.x, lower = rows.y * samples.x;
  Corner corner[4];
  pair_of(depth + upper, i, side, last, 1, &corner[0].t, &corner[1].t);
  pair_of(depth + lower, i, side, last, 1, &corner[2].t, &corner[3].t);
  intv smooth = (corner[0].t < INFINITY) & (corner[1].t < INFINITY) & (corner[2].t < INFINITY) &
                (corner[3].t < INFINITY);
  const intv covered = (corner[0].t < INFINITY) | (corner[1].t < INFINITY) |
                       (corner[2].t < INFINITY) | (corner[3].t < INFINITY);
  if (ANY(smooth)) {
    complete_corners(normal, n, a, b, upper, lower, side, last, 1, screen, corner);
    const floatv farthest =
        larger(larger(larger(apart(corner[0], corner[1]), apart(corner[0], corner[2])),
                      larger(apart(corner[3], corner[1]), apart(corner[3], corner[2]))),
               larger(apart(corner[0], corner[3]), apart(corner[1], corner[2])));
    const floatv turned = smaller(agreement(corner[0], corner[3]), agreement(corner[1], corner[2]));
    smooth = smooth & (farthest < cells.tolerance) & (turned > cells.agreeing);
    const int next = min(i + WIDTH * side, last);
    const intv kind0 = spread_bytes(kind + upper, i, side, last);
    const intv kind2 = spread_bytes(kind + lower, i, side, last);
    smooth = smooth & (kind0 == kind2) & (kind0 == SHIFTED(intv, kind0, kind[upper + next])) &
             (kind0 == SHIFTED(intv, kind2, kind[lower + next]));
  }
  intv found = SELECT((intv)(ROUGH), (intv)(SMOOTH), smooth);
  if (cells.trust_empty && !ALL(covered)) {
    intv any_open = (intv)(0);
    if (any_front) {
      floatv o[4];
      pair_of(open + upper, i, side, last, 1, o, o + 1);
      pair_of(open + lower, i, side, last, 1, o + 2, o + 3);
      any_open = (o[0] < INFINITY) | (o[1] < INFINITY) | (o[2] < INFINITY) | (o[3] < INFINITY);
    }
    found = SELECT(SELECT((intv)(EMPTY), (intv)(OPEN), any_open), found, covered);
  }
  // A cell that ends outside the image has no corner there.
  const intv cell = TO_INTV(LANES) + a;
  const int within = side * (b + 1) < samples.y ? cells.cells_x : 0;
  found = SELECT((intv)(ROUGH), found, (side * (cell + 1) < samples.x) & (cell < within));
  STORE_BYTES(SELECT((intv)(EMPTY), found, cell < cells.cells_x), shows + b * stride + a);
}

// The surface on a ray between `number` corners.
typedef struct {
  floatv depth, nx, ny, nz;
  intv sure;  // it faces the ray and the corners' planes agree about the depth
} Between;

inline void add_corner(Between* sum, floatv* linear, floatv* low, floatv* high, const Corner c,
                       const Rays r) {
  const floatv slope = c.nx * r.dx + c.ny * r.dy - c.nz;
  const floatv t = (c.nx * (c.x - r.ox) + c.ny * (c.y - r.oy) + c.nz * c.z) / slope;
  sum->sure &= slope < -0.1f;
  sum->depth += t;
  *low = smaller(*low, t);
  *high = larger(*high, t);
  *linear += c.linear;
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
  for (int k = 0; k < 4; ++k)
    if (k < number) add_corner(&b, &linear, &low, &high, corner[which[k]], r);
  b.sure &= high - low < spread;
  const float share = 1.0f / (float)number;
  linear = perspective ? 1.0f / (linear * share) : linear * share;
  b.depth = 0.5f * (linear + b.depth * share);
  const floatv size = 1.0f / sqrt(larger(b.nx * b.nx + b.ny * b.ny + b.nz * b.nz, (floatv)(1e-30f)));
  b.nx *= size;
  b.ny *= size;
  b.nz *= size;
  return b;
}

// Where the surface is stored.
typedef struct {
  global float* depth;
  global float* normal;  // [3][n]
  int n;
  global int* group;
  global uchar* kind;
} Surface;

// Stores what is sure of WIDTH samples, `stride` apart from `first` on; group and kind are those of
// samples as far apart, from `corner` on: for the group see choose_groups.cl.
inline void store_between(const Between s, const int corner, const int first, const int stride,
                          const Surface to) {
  float t[WIDTH], nx[WIDTH], ny[WIDTH], nz[WIDTH];
  STOREF(s.depth, t);
  STOREF(s.nx, nx);
  STOREF(s.ny, ny);
  STOREF(s.nz, nz);
  const int sure = BITS(s.sure);
#pragma unroll
  for (int k = 0; k < WIDTH; ++k) {
    if (!(sure >> k & 1)) continue;
    const int at = first + k * stride;
    to.depth[at] = t[k];
    to.normal[at] = nx[k];
    to.normal[to.n + at] = ny[k];
    to.normal[2 * to.n + at] = nz[k];
    to.group[at] = to.group[corner + k * stride] | OF_CORNER;
    to.kind[at] = to.kind[corner + k * stride];
  }
}

#if WIDTH == 8
inline void store_floats(const floatv even, const floatv odd, const int16 sure, global float* to) {
  float16 both;
  both.even = even;
  both.odd = odd;
  vstore16(select(vload16(0, to), both, sure), 0, to);
}

// The same of 16 samples that follow each other, all of them between the lattice's, and of which no
// other work-item has any.
inline void store_row(const Between even, const Between odd, const int corner, const int first,
                      const Surface to) {
  int16 sure, group;
  sure.even = even.sure;
  sure.odd = odd.sure;
  store_floats(even.depth, odd.depth, sure, to.depth + first);
  store_floats(even.nx, odd.nx, sure, to.normal + first);
  store_floats(even.ny, odd.ny, sure, to.normal + to.n + first);
  store_floats(even.nz, odd.nz, sure, to.normal + 2 * to.n + first);
  group.even = group.odd = vload16(0, to.group + corner).even | OF_CORNER;
  vstore16(select(vload16(0, to.group + first), group, sure), 0, to.group + first);
  uchar16 kind;
  kind.even = kind.odd = vload16(0, to.kind + corner).even;
  vstore16(select(vload16(0, to.kind + first), kind, convert_char16(sure)), 0, to.kind + first);
}
#endif

// Of the three samples of each of WIDTH cells from (a, b) on, what is left is wanted where there are
// fronts of surface, and of splash. What the lattice shows nothing of is not: it is left open.
INLINED intv wanted_of(intv* rest, const intv* shown,
                       FRONTS(reference, splash, occupied, splash_occupied), global float* open,
                       const int a, const int b, const int every, const int2 samples) {
  const int side = 2 * every, last = samples.x - 1;
  intv wants = (intv)(0), finite, splashes;
#pragma unroll
  for (int m = 0; m < 3; ++m) {
    const int right = m != 1, down = m != 0, row = every * (2 * b + down);
    const int i = every * (2 * a + right), start = row * samples.x;
    // Mostly the counts of blocks suffice, the same blocks for all three.
    if (m == 0 || side > 8) {
      const int blocks = block_of(0, row, samples.x);
      finite = spread_counts(occupied + blocks, i, side, last);
      splashes = spread_counts(splash_occupied + blocks, i, side, last) > 0;
    }
    if (row >= samples.y || !ANY(rest[m])) continue;
    floatv front = SELECT((floatv)(0.0f), (floatv)(INFINITY), finite == 0);
    if (ANY((finite > 0) & ((finite < 64) | (rest[m] & (shown[m] == OPEN)))))
      front = SELECT(front, spread_floats(reference + start, i, side, last, 1), finite > 0);
    const intv opens = rest[m] & (shown[m] == OPEN) & (front < INFINITY);
    if (ANY(opens)) {
      int at[WIDTH];
      STOREI(start + i + side * TO_INTV(LANES), at);
      scatter_float(front, open, at, opens);
    }
    rest[m] = rest[m] & !opens;
    wants |= SELECT((intv)(0), (intv)(1 << m), rest[m] & (front < INFINITY));
    if (ANY(splashes & rest[m]))
      wants |= SELECT((intv)(0), (intv)(8 << m),
                      splashes & rest[m] &
                          (spread_floats(splash + start, i, side, last, 1) < INFINITY));
  }
  return wants;
}

// The samples of each cell but the lattice's own. One between two of the lattice's lies between two
// cells.
kernel void interpolate_samples(global const uchar* shows,  // [rows][stride] of cells
                                FRONTS(reference, splash, occupied, splash_occupied),
                                SHOWN(, ),             // in and out
                                global uchar* wanted,  // [rows][stride] of cells, out: see
                                                       // list_between
                                global float* open,    // [samples] out where the front layer shows
                                                       // nothing: its reference depth
                                const Screen screen, const LatticeCells cells) {
  const int a = get_global_id(0) * WIDTH, b = get_global_id(1);
  // Read once: behind each store it would be done again.
  const int stride = cells.stride, every = cells.every, perspective = cells.perspective;
  const float spread = cells.spread;
  const Screen fine = screen;
  const int2 samples = (int2)(screen.nx, screen.ny);
  if (a >= stride || b >= cells.rows) return;
  global uchar* wanted_here = wanted + b * stride + a;
  STORE_BYTES((intv)(0), wanted_here);
  if (a >= cells.cells_x || b >= cells.cells_y) return;
  const int n = samples.x * samples.y, side = 2 * every, last = samples.x - 1;
  // The kind of each of the three samples: right of the corner, below it, and between both.
  global const uchar* here = shows + b * stride + a;
  const intv own = LOAD_BYTES(here);
  intv shown[3];
  shown[0] = b == 0 ? own : max(own, LOAD_BYTES(here - stride));
  shown[1] = max(own, SHIFTED_BACK(intv, own, a == 0 ? EMPTY : here[-1]));
  shown[2] = own;
  const intv most = max(shown[0], shown[1]);
  if (!ANY(most != EMPTY)) return;
  Corner corner[4];
  if (ANY(most == SMOOTH)) {
    const int upper = side * b * samples.x, lower = min(side * (b + 1), samples.y - 1) * samples.x;
    // Between the lower corners the cells below write.
    pair_of(depth + upper, side * a, side, last, 1, &corner[0].t, &corner[1].t);
    pair_of(depth + lower, side * a, side, last, 0, &corner[2].t, &corner[3].t);
    complete_corners(normal, n, a, b, upper, lower, side, last, 0, fine, corner);
#pragma unroll
    for (int k = 0; k < 4; ++k) corner[k].linear = perspective ? 1.0f / corner[k].t : corner[k].t;
  }
  Between found[3];
#pragma unroll  // so that corners stay in registers
  for (int m = 0; m < 3; ++m) {
    const int right = m != 1, down = m != 0;
    found[m].sure = (intv)(0);
    const intv smooth = (shown[m] == SMOOTH) &
                        (every * (2 * (a + TO_INTV(LANES)) + right) < samples.x);
    if (every * (2 * b + down) >= samples.y || !ANY(smooth)) continue;
    const int which[3][4] = {{0, 1, 0, 0}, {0, 2, 0, 0}, {0, 1, 2, 3}};
    found[m] =
        between(corner, which[m], m == 2 ? 4 : 2, corner_ray(fine, a, b, right, down),
                smooth, spread, perspective);
  }
  const int corners = side * (b * samples.x + a);
  const Surface surface = {depth, normal, n, group, kind};
  if (ANY(found[0].sure)) store_between(found[0], corners, corners + every, side, surface);
#if WIDTH == 8
  if (every == 1 && 2 * (a + WIDTH) <= samples.x) {
    if (ANY(found[1].sure | found[2].sure))
      store_row(found[1], found[2], corners, corners + samples.x, surface);
  } else
#endif
  {
    const int below = corners + every * samples.x;
    if (ANY(found[1].sure)) store_between(found[1], corners, below, side, surface);
    if (ANY(found[2].sure)) store_between(found[2], corners, below + every, side, surface);
  }
  // What is left of them.
  intv rest[3];
#pragma unroll
  for (int m = 0; m < 3; ++m)
    rest[m] = SELECT((intv)(0), (shown[m] != EMPTY) & !found[m].sure,
                     every * (2 * (a + TO_INTV(LANES)) + (m != 1)) < samples.x);
  if (!ANY(rest[0] | rest[1] | rest[2])) return;
  const intv wants = wanted_of(rest, shown, reference, splash, occupied, splash_occupied, open, a, b,
                               every, samples);
  STORE_BYTES(wants, wanted_here);
}
