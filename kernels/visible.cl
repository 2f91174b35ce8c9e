// visible.cl: the depth map and the particles that own it (paper 2.1, steps 1 and 2).
// Each particle is a sphere of `footprint` times its radius; on the screen an ellipse of half axes
// footprint * ku and footprint * kv pixels. Its front at node (i, j) is
//   t = t_p - bulge * sqrt(1 - d^2),  d = distance from the centre in units of the half axes,
// with bulge = footprint * scale for the sphere itself. Where two particles are equally near, the
// lower index wins.
//
// Every operation between a node's place and its front is monotone, and so is its rounding: of the
// nodes of a rectangle, none has a deeper computed front than the largest |du| and |dv| among them
// give, and none a nearer one than the centre. Bounds made so hold to the last bit.

#define BIN 8
// A work-item draws ROWS rows of WIDTH nodes: all of a bin, or one node of it.
#if WIDTH == 1
#define ROWS 1
#else
#define ROWS BIN
#endif

// What is drawn: the nearest fronts, those behind a map, or the farthest backs.
#define FRONT 0
#define BEHIND 1
#define BACK 2

// The record of a particle: t, u, v, 1 / half axes, bulge.
inline float nearest_front(const float t, const float bulge) {
  return fmax(fmin(t - bulge, t), 1e-6f);
}

// What the particles may cover. One work-item per particle; the range is `stride` exactly, so that
// there is no test and the compiler can use vectors.
kernel void outline_discs(global const float* particles,  // [6][stride] t, u, v, ku, kv, scale
                          global float* disc,             // [stride][8] records, two unused
                          global int* box,                // [4][stride] see bins.cl
                          global float* key,  // [stride] FRONT: nearest depth; BEHIND: the least
                                              // negative depth; BACK: none is left out
                          const int stride,
                          const int2 nodes,     // nx, ny
                          const float2 origin,  // first node's coordinate, 1 / step; pixels
                          const float2 sphere,  // footprint; bulge over footprint
                          const int drawn) {
  const int p = get_global_id(0);
  const float t = particles[p];
  const float u = particles[stride + p], v = particles[2 * stride + p];
  const float ru = sphere.x * particles[3 * stride + p];
  const float rv = sphere.x * particles[4 * stride + p];
  const float bulge = sphere.x * sphere.y * particles[5 * stride + p];
  box[p] = max(0, (int)ceil(clamp((u - ru - origin.x) * origin.y, -1.0f, 1e6f)));
  box[stride + p] =
      min(nodes.x - 1, (int)floor(clamp((u + ru - origin.x) * origin.y, -1.0f, 1e6f)));
  box[2 * stride + p] = max(0, (int)ceil(clamp((v - rv - origin.x) * origin.y, -1.0f, 1e6f)));
  box[3 * stride + p] =
      min(nodes.y - 1, (int)floor(clamp((v + rv - origin.x) * origin.y, -1.0f, 1e6f)));
  key[p] = drawn == FRONT    ? nearest_front(t, bulge)
           : drawn == BEHIND ? -fmax(t - fmin(bulge, 0.0f), 1e-6f)
                             : -INFINITY;
  global float* record = disc + 8 * p;
  record[0] = t;
  record[1] = u;
  record[2] = v;
  record[3] = 1.0f / ru;
  record[4] = 1.0f / rv;
  record[5] = bulge;
}

// The cells inside the rectangle that the disc holds, and the deepest front
// there. Half sides of 0.6 half axes: the front at the corners is 0.53 bulges before the centre.
// Like outline_discs.
kernel void cover_discs(global const float* disc,
                        global int* cover,      // [4][stride] see bins.cl
                        global float* deepest,  // [stride]
                        const int stride, const int2 nodes, const float2 origin, const float step,
                        const int shift) {  // a cell's side is 1 << shift nodes
  const int p = get_global_id(0);
  const float t = disc[8 * p], u = disc[8 * p + 1], v = disc[8 * p + 2];
  const float inverse_u = disc[8 * p + 3], inverse_v = disc[8 * p + 4], bulge = disc[8 * p + 5];
  const float half_u = 0.6f / inverse_u, half_v = 0.6f / inverse_v;
  const float2 last = (float2)(nodes.x - 1, nodes.y - 1);
  const int i0 = (int)ceil(clamp((u - half_u - origin.x) * origin.y, 0.0f, 1e6f));
  const int i1 = (int)floor(clamp((u + half_u - origin.x) * origin.y, -1.0f, last.x));
  const int j0 = (int)ceil(clamp((v - half_v - origin.x) * origin.y, 0.0f, 1e6f));
  const int j1 = (int)floor(clamp((v + half_v - origin.x) * origin.y, -1.0f, last.y));
  // Whole cells; those at the far edges have fewer nodes.
  const int beyond = (1 << shift) - 1;
  const int a0 = (i0 + beyond) >> shift, b0 = (j0 + beyond) >> shift;
  const int a1 = ((i1 == nodes.x - 1 ? i1 + beyond + 1 : i1 + 1) >> shift) - 1;
  const int b1 = ((j1 == nodes.y - 1 ? j1 + beyond + 1 : j1 + 1) >> shift) - 1;
  const float first_u = origin.x + step * (float)(a0 << shift);
  const float last_u = origin.x + step * (float)min((a1 << shift) + beyond, nodes.x - 1);
  const float first_v = origin.x + step * (float)(b0 << shift);
  const float last_v = origin.x + step * (float)min((b1 << shift) + beyond, nodes.y - 1);
  const float du = fmax(fabs((first_u - u) * inverse_u), fabs((last_u - u) * inverse_u));
  const float dv = fmax(fabs((first_v - v) * inverse_v), fabs((last_v - v) * inverse_v));
  const float q = 1.0f - (du * du + dv * dv);
  const int covers = (a0 <= a1) & (b0 <= b1) & (q >= 0.0f);
  cover[p] = a0;
  cover[stride + p] = covers ? a1 : a0 - 1;
  cover[2 * stride + p] = b0;
  cover[3 * stride + p] = b1;
  const float rim = t - bulge * sqrt(fmax(q, 0.0f));
  deepest[p] = fmax(fmax(rim, t - bulge), 1e-6f);
}

// For BEHIND: minus the least depth that a bin's fronts must exceed, so that a particle whose
// deepest front is not below it is left out; -INFINITY where no front counts.
// One work-item per bin.
kernel void bound_behind(global const float* behind,  // [ny*nx] depth, particle radii
                         global float* bound,         // [bins]
                         const int2 nodes, const int2 bins,
                         const float gap) {  // particle radii
  const int i = get_global_id(0), j = get_global_id(1);
  if (i >= bins.x || j >= bins.y) return;  // the range is rounded up to whole work-groups
  floatv least = (floatv)(INFINITY);
  for (int y = j * BIN; y < min((j + 1) * BIN, nodes.y); ++y)
    for (int x = i * BIN; x < min((i + 1) * BIN, nodes.x); x += WIDTH) {
      // Lanes beyond the last node see others' depths: the bound can only become weaker.
      const floatv front = LOADF(behind + y * nodes.x + x) + gap;
      least = SELECT(least, front, front < least);
    }
  float lanes[WIDTH];
  STOREF(least, lanes);
  for (int lane = 1; lane < WIDTH; ++lane) lanes[0] = fmin(lanes[0], lanes[lane]);
  bound[j * bins.x + i] = -lanes[0];
}

// The part of a bin that a work-item draws.
typedef struct {
  int begin, end;   // of the bin's entries
  int i, j;         // first node
  int column, row;  // the same within the bin
  int bin;
} Part;

inline Part part_of(global const int* end, const int2 range, const int bins_x) {
  const int items = BIN * BIN / (WIDTH * ROWS);
  const int id = get_global_id(0), bin = range.x + id / items, item = id % items;
  Part part;
  part.bin = bin;
  part.begin = part.end = 0;
  if (bin < range.y) {
    part.begin = bin > range.x ? end[bin - 1] : 0;
    part.end = end[bin];
  }
  part.column = items == 1 ? 0 : item % BIN;
  part.row = items == 1 ? 0 : item / BIN;
  part.i = bin % bins_x * BIN + part.column;
  part.j = bin / bins_x * BIN + part.row;
  return part;
}

// Draws the discs of a bin into a private map. BACK: the backs' negative depths, whose nearest is
// the farthest back. With `owned`, the map's owners as well.
inline void draw_discs(const Part part, global const float* disc, global const int2* entry,
                       floatv* map, intv* owner, global const float* behind, const float gap,
                       const int2 nodes, const float2 grid, const int drawn, const int owned) {
  const intv column = TO_INTV(LANES) + part.column;
  const floatv node_u = grid.x + grid.y * TO_FLOATV(part.i - part.column + column);
  for (int e = part.begin; e < part.end; ++e) {
    const int p = entry[e].x, packed = entry[e].y;
    const int j0 = max(packed >> 8 & 15, part.row),
              j1 = min(packed >> 12 & 15, part.row + ROWS - 1);
    const float8 d = vload8(p, disc);
    const float t = drawn == BACK ? -d.s0 : d.s0, bulge = d.s5;
    const floatv du = (node_u - d.s1) * d.s3;
    // Nodes outside the box are infinitely far: sqrt is NaN there and no comparison holds.
    const floatv du2 = SELECT(du * du, (floatv)(INFINITY),
                              (column < (packed & 15)) | (column > (packed >> 4 & 15)));
    for (int j = j0; j <= j1; ++j) {
      const int row = j - part.row;
      const float dv = (grid.x + grid.y * (float)(part.j + row) - d.s2) * d.s4;
      floatv front = t - bulge * sqrt(1.0f - (du2 + dv * dv));
      if (drawn != BACK) front = SELECT(front, (floatv)(1e-6f), front < 1e-6f);
      intv better = front < map[row];
      if (owned) better = better | ((front == map[row]) & (p < owner[row]));
      if (drawn == BEHIND)
        better = better & (front > LOADF(behind + (part.j + row) * nodes.x + part.i) + gap);
      map[row] = SELECT(map[row], front, better);
      if (owned) owner[row] = SELECT(owner[row], (intv)(p), better);
    }
  }
}

// Stores the rows of a map that lie within the nodes.
inline void store_rows(const Part part, const floatv* map, global float* depth, const int2 nodes) {
  for (int row = 0; row < ROWS; ++row) {
    global float* here = depth + (part.j + row) * nodes.x + part.i;
    if (part.j + row >= nodes.y) return;
    if (part.i + WIDTH <= nodes.x) {
      STOREF(map[row], here);
    } else {
      float lanes[WIDTH];
      STOREF(map[row], lanes);
      for (int lane = 0; part.i + lane < nodes.x; ++lane) here[lane] = lanes[lane];
    }
  }
}

// The nearest front at every node of the listed bins; INFINITY where there is none.
// The range of this kernel and the next: BIN * BIN / (WIDTH * ROWS) work-items a bin.
kernel void splat_depth(global const float* disc,  // [stride][8]
                        global const int* end,     // [bins] see fill_bins
                        global const int2* entry,  // [entries]
                        global float* depth,       // [ny*nx] particle radii
                        const int2 range,          // the bins that are listed
                        const int bins_x, const int2 nodes,
                        const float2 grid) {  // first node and step, pixels
  const Part part = part_of(end, range, bins_x);
  if (part.bin >= range.y) return;  // the range is rounded up to whole work-groups
  floatv map[ROWS];
  for (int row = 0; row < ROWS; ++row) map[row] = (floatv)(INFINITY);
  draw_discs(part, disc, entry, map, 0, 0, 0.0f, nodes, grid, FRONT, 0);
  store_rows(part, map, depth, nodes);
}

// The nearest front that lies deeper than behind + gap.
kernel void splat_behind(global const float* disc, global const int* end, global const int2* entry,
                         global const float* behind,  // [ny*nx] particle radii
                         global float* depth, const int2 range, const int bins_x, const int2 nodes,
                         const float2 grid, const float gap) {
  const Part part = part_of(end, range, bins_x);
  if (part.bin >= range.y) return;
  floatv map[ROWS];
  for (int row = 0; row < ROWS; ++row) map[row] = (floatv)(INFINITY);
  draw_discs(part, disc, entry, map, 0, behind, gap, nodes, grid, BEHIND, 0);
  store_rows(part, map, depth, nodes);
}

// The farthest back, t + bulge sqrt(1 - d^2); 0 where there is none.
kernel void splat_far(global const float* disc, global const int* end, global const int2* entry,
                      global float* depth, const int2 range, const int bins_x, const int2 nodes,
                      const float2 grid) {
  const Part part = part_of(end, range, bins_x);
  if (part.bin >= range.y) return;
  floatv map[ROWS];
  for (int row = 0; row < ROWS; ++row) map[row] = (floatv)(0.0f);
  draw_discs(part, disc, entry, map, 0, 0, 0.0f, nodes, grid, BACK, 0);
  for (int row = 0; row < ROWS; ++row) map[row] = 0.0f - map[row];
  store_rows(part, map, depth, nodes);
}

// The nearest front and the particle that owns it: the lowest index among the nearest.
inline void draw_owners(const Part part, global const float* disc, global const int2* entry,
                        int* owner, const int2 nodes, const float2 grid) {
  floatv map[ROWS];
  intv owners[ROWS];
  for (int row = 0; row < ROWS; ++row) {
    map[row] = (floatv)(INFINITY);
    owners[row] = (intv)(INT_MAX);
  }
  draw_discs(part, disc, entry, map, owners, 0, 0.0f, nodes, grid, FRONT, 1);
  for (int row = 0; row < ROWS; ++row) STOREI(owners[row], owner + row * WIDTH);
}

// The owner of every node; INT_MAX where there is none.
kernel void splat_owner(global const float* disc, global const int* end, global const int2* entry,
                        global int* owner,  // [ny*nx]
                        const int2 range, const int bins_x, const int2 nodes, const float2 grid) {
  const Part part = part_of(end, range, bins_x);
  if (part.bin >= range.y) return;
  int own[ROWS * WIDTH];
  draw_owners(part, disc, entry, own, nodes, grid);
  for (int row = 0; row < ROWS && part.j + row < nodes.y; ++row)
    for (int lane = 0; lane < WIDTH && part.i + lane < nodes.x; ++lane)
      owner[(part.j + row) * nodes.x + part.i + lane] = own[row * WIDTH + lane];
}

// How many nodes each particle owns.
kernel void count_owned(global const float* disc, global const int* end, global const int2* entry,
                        global int* owned,  // [n] 0 before
                        const int2 range, const int bins_x, const int2 nodes, const float2 grid) {
  const Part part = part_of(end, range, bins_x);
  if (part.bin >= range.y) return;
  int own[ROWS * WIDTH];
  draw_owners(part, disc, entry, own, nodes, grid);
  // One addition for a run of nodes with the same owner.
  int run = 0;
  for (int k = 0; k < ROWS * WIDTH; ++k) {
    ++run;
    if (k + 1 < ROWS * WIDTH && own[k + 1] == own[k]) continue;
    if (own[k] < INT_MAX) atomic_add(owned + own[k], run);
    run = 0;
  }
}
