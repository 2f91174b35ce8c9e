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
//
// uses: outlines.cl

// What lists and draws of the spheres.
inline void store_outline(const Outline o, const int p, const int stride, global float* disc,
                          global int* box, global float* key) {
  STOREI(o.i0, box + p);
  STOREI(o.i1, box + stride + p);
  STOREI(o.j0, box + 2 * stride + p);
  STOREI(o.j1, box + 3 * stride + p);
  STOREF(o.key, key + p);
  store_records(o.disc, disc + 8 * p);
}

// What the particles may cover. One work-item per WIDTH particles of `stride`.
kernel void outline_discs(global const float* particles,  // [6][stride] t, u, v, ku, kv, scale
                          global float* disc,  // [stride][8] t, u, v, 1 / half axes, bulge, nearest
                          OUTLINES(, box, key),
                          const int stride,
                          const int2 nodes,     // nx, ny
                          const float2 origin,  // first node's coordinate, 1 / step; pixels
                          const float2 sphere,  // footprint; bulge over footprint
                          const int drawn) {
  const int p = get_global_id(0) * WIDTH;
  if (p >= stride) return;  // the range is rounded up to whole work-groups
  store_outline(outline_of(spheres_of(particles + p, stride, sphere), nodes, origin, drawn), p, stride,
                disc, box, key);
}

// Shares out the blanks: values that lie side by side are stored by work-items side by side.
inline void store_blanks(global float* cell, global float* depth, global int* owner,
                         global int* owned, const Covering how) {
  const int items = how.stride / WIDTH;
  for (int k = get_global_id(0); k < how.cells; k += items) cell[k] = INFINITY;
  for (int k = get_global_id(0); k < how.nodes; k += items) {
    depth[k] = INFINITY;
    owner[k] = INT_MAX;
  }
  for (int k = get_global_id(0); k < how.counts; k += items) owned[k] = 0;
}

// The same by nearest depth, and the cells inside a rectangle that the disc holds, and the deepest
// front there. Half sides of 0.69 half axes, as large as fits: cells that no disc covers cost more
// than bounds that are less near. Makes blanks for what is drawn next.
kernel void cover_discs(global const float* particles, global float* disc, OUTLINES(, box, key),
                        COVERS(, cover, deepest), BLANKS(cell, depth, owner, owned),
                        const Covering how) {
  const int p = get_global_id(0) * WIDTH, stride = how.stride, shift = how.shift;
  const int2 nodes = (int2)(how.samples.nx, how.samples.ny);
  const float2 origin = (float2)(how.samples.first, how.inverse_step);
  const float step = how.samples.step;
  if (p >= stride) return;
  store_blanks(cell, depth, owner, owned, how);
  const Spheres s = spheres_of(particles + p, stride, (float2)(how.footprint, how.bulge));
  store_outline(outline_of(s, nodes, origin, FRONT), p, stride, disc, box, key);
  const intv i0 = first_cell((s.u - 0.69f * s.ru - origin.x) * origin.y, shift);
  const intv i1 = last_cell((s.u + 0.69f * s.ru - origin.x) * origin.y, nodes.x, shift);
  const intv j0 = first_cell((s.v - 0.69f * s.rv - origin.x) * origin.y, shift);
  const intv j1 = last_cell((s.v + 0.69f * s.rv - origin.x) * origin.y, nodes.y, shift);
  const floatv left = origin.x + step * TO_FLOATV(first_of(i0, shift));
  const floatv right = origin.x + step * TO_FLOATV(last_of(i1, nodes.x, shift));
  const floatv above = origin.x + step * TO_FLOATV(first_of(j0, shift));
  const floatv below = origin.x + step * TO_FLOATV(last_of(j1, nodes.y, shift));
  // As draw_discs computes them.
  const floatv inverse_u = 1.0f / s.ru, inverse_v = 1.0f / s.rv;
  const floatv du = larger(fabs((left - s.u) * inverse_u), fabs((right - s.u) * inverse_u));
  const floatv dv = larger(fabs((above - s.v) * inverse_v), fabs((below - s.v) * inverse_v));
  const floatv q = 1.0f - (du * du + dv * dv);
  STOREI(i0, cover + p);
  STOREI(SELECT(i0 - 1, i1, q >= 0.0f), cover + stride + p);
  STOREI(j0, cover + 2 * stride + p);
  STOREI(j1, cover + 3 * stride + p);
  const floatv rim = s.t - s.bulge * sqrt(larger(q, (floatv)(0.0f)));
  STOREF(larger(larger(rim, s.t - s.bulge), (floatv)(1e-6f)), deepest + p);
}

// Discs lie all over memory: for owners, whose many maps push them out of the caches, it is asked of so
// many at once how near they are, and their loads wait together.
#if WIDTH == 1
#define AHEAD 1
#else
#define AHEAD 16
#endif

// Draws the discs of a bin into a private map. With `owned`, the map's owners as well. Inlined: for
// fronts alone a fifth of the time.
INLINED void draw_discs(const Part part, global const float* disc, global const int2* entry,
                        floatv* map, intv* owner, const Lattice nodes, const int owned) {
  const intv column = TO_INTV(LANES) + part.column;
  const floatv node_u = nodes.first + nodes.step * TO_FLOATV(part.i - part.column + column);
  const floatv node_v = rows_of(part, nodes.first, nodes.step);
  float deepest = INFINITY, nearest[AHEAD];
  for (int e = part.begin; e < part.end; ++e) {
    const int p = entry[e].x, packed = entry[e].y, ahead = (e - part.begin) % AHEAD;
    // Long lists are mostly of what lies behind the rest.
    if ((e - part.begin) % 8 == 7) deepest = deepest_of(map);
    if (owned && ahead == 0) {
#pragma unroll
      for (int k = 0; k < AHEAD; ++k) nearest[k] = disc[8 * entry[min(e + k, part.end - 1)].x + 6];
    }
    if (owned && nearest[ahead] > deepest) continue;
    const int j0 = max(packed >> 8 & 15, part.row),
              j1 = min(packed >> 12 & 15, part.row + ROWS - 1);
    const float8 d = vload8(p, disc);
    if (d.s6 > deepest) continue;
    const float t = d.s0, bulge = d.s5;
    const floatv du = (node_u - d.s1) * d.s3;
    // Nodes outside the box are infinitely far: sqrt is NaN there and no comparison holds.
    const floatv du2 = SELECT(du * du, (floatv)(INFINITY),
                              (column < (packed & 15)) | (column > (packed >> 4 & 15)));
    float dv2[WIDTH];
    const floatv dv = (node_v - d.s2) * d.s4;
    STOREF(dv * dv, dv2);
    for (int j = j0; j <= j1; ++j) {
      const int row = j - part.row;
      floatv front = t - bulge * sqrt(1.0f - (du2 + dv2[row]));
      front = SELECT(front, (floatv)(1e-6f), front < 1e-6f);
      intv better = front < map[row];
      if (owned) better = better | ((front == map[row]) & (p < owner[row]));
      map[row] = SELECT(map[row], front, better);
      if (owned) owner[row] = SELECT(owner[row], (intv)(p), better);
    }
  }
}

// The nearest front at every node of the listed bins; INFINITY where there is none.
// The range of this kernel and the next ones: BIN * BIN / (WIDTH * ROWS) work-items a bin.
kernel void splat_depth(global const float* disc,  // [stride][8]
                        ENTRIES(end, entry),
                        global float* depth,  // [ny*nx] particle radii
                        const ListedBins bins, const Lattice nodes) {
  const Part part = part_of(end, bins);
  if (part.bin >= bins.end) return;  // the range is rounded up to whole work-groups
  floatv map[ROWS];
  for (int row = 0; row < ROWS; ++row) map[row] = (floatv)(INFINITY);
  draw_discs(part, disc, entry, map, 0, nodes, 0);
  store_rows(part, map, depth, nodes.nx, nodes.ny);
}

// The least and the sum of a vector's lanes, by halves.
inline int lowest_lane(const intv v) {
#if WIDTH == 1
  return v;
#else
#if WIDTH == 8
  const int4 four = min(v.lo, v.hi);
#else
  const int4 four = v;
#endif
  const int2 two = min(four.lo, four.hi);
  return min(two.x, two.y);
#endif
}

inline int total_of_lanes(const intv v) {
#if WIDTH == 1
  return v;
#else
  const int4 four = FOUR(v, +);
  const int2 two = four.lo + four.hi;
  return two.x + two.y;
#endif
}

// Adds how many of a part's nodes have a finite depth to their block's.
inline void count_finite(const Part part, const floatv* map, global int* occupied,
                         const Lattice nodes) {
  intv finite = (intv)(0);
  for (int row = 0; row < ROWS; ++row)
    finite += SELECT((intv)(0), (intv)(1), map[row] < INFINITY);
  const int number = total_of_lanes(finite);
  if (number > 0) atomic_add(occupied + block_of(part.i, part.j, nodes.nx), number);
}

// Draws two maps of a bin at once: the nearest fronts and the farthest backs, t + bulge sqrt(1 - d^2).
inline void draw_both(const Part part, global const float* disc, global const int2* entry,
                      floatv* near, floatv* far, const Lattice nodes) {
  const intv column = TO_INTV(LANES) + part.column;
  const floatv node_u = nodes.first + nodes.step * TO_FLOATV(part.i - part.column + column);
  const floatv node_v = rows_of(part, nodes.first, nodes.step);
  for (int e = part.begin; e < part.end; ++e) {
    const int packed = entry[e].y;
    const int j0 = max(packed >> 8 & 15, part.row),
              j1 = min(packed >> 12 & 15, part.row + ROWS - 1);
    const float8 d = vload8(entry[e].x, disc);
    const floatv du = (node_u - d.s1) * d.s3;
    // As in draw_discs.
    const floatv du2 = SELECT(du * du, (floatv)(INFINITY),
                              (column < (packed & 15)) | (column > (packed >> 4 & 15)));
    float dv2[WIDTH];
    const floatv dv = (node_v - d.s2) * d.s4;
    STOREF(dv * dv, dv2);
    for (int j = j0; j <= j1; ++j) {
      const int row = j - part.row;
      const floatv q = 1.0f - (du2 + dv2[row]), half_depth = d.s5 * sqrt(q);
      floatv front = d.s0 - half_depth;
      front = SELECT(front, (floatv)(1e-6f), front < 1e-6f);
      near[row] = SELECT(near[row], front, front < near[row]);
      const floatv back = d.s0 + half_depth;
      far[row] = SELECT(far[row], back, back > far[row]);
    }
  }
}

// As splat_depth; bins without particles are left as they are.
kernel void splat_fronts(global const float* disc, ENTRIES(end, entry),
                         global float* depth,   // [ny*nx] particle radii
                         global int* occupied,  // [blocks] out: at how many nodes the depth is finite;
                                                // 0 before
                         const ListedBins bins, const Lattice nodes) {
  const Part part = part_of(end, bins);
  if (part.begin == part.end) return;
  floatv map[ROWS];
  for (int row = 0; row < ROWS; ++row) map[row] = (floatv)(INFINITY);
  draw_discs(part, disc, entry, map, 0, nodes, 0);
  store_rows(part, map, depth, nodes.nx, nodes.ny);
  count_finite(part, map, occupied, nodes);
}

// The nearest front, INFINITY where there is none, and the farthest back, 0 where there is none.
// Bins without particles are left as they are, unless `needed`: then there are no fronts.
kernel void splat_extent(global const float* disc, ENTRIES(end, entry), EXTENT(, from, to),
                         global int* occupied,     // [blocks] out: as of splat_fronts
                         global const int* needed,  // [blocks] not 0: is to be written
                         const ListedBins bins, const Lattice nodes) {
  const Part part = part_of(end, bins);
  if (part.bin >= bins.end) return;
  const int any_entries = part.begin < part.end;
  if (!any_entries && !needed[block_of(part.i, part.j, nodes.nx)]) return;
  floatv near[ROWS], far[ROWS];
  for (int row = 0; row < ROWS; ++row) {
    near[row] = (floatv)(INFINITY);
    far[row] = (floatv)(0.0f);
  }
  draw_both(part, disc, entry, near, far, nodes);
  store_rows(part, near, from, nodes.nx, nodes.ny);
  if (!any_entries) return;
  store_rows(part, far, to, nodes.nx, nodes.ny);
  count_finite(part, near, occupied, nodes);
}

// The nearest front and the particle that owns it: the lowest index among the nearest.
inline void draw_owners(const Part part, global const float* disc, global const int2* entry,
                        intv* owner, const Lattice nodes) {
  floatv map[ROWS];
  for (int row = 0; row < ROWS; ++row) {
    map[row] = (floatv)(INFINITY);
    owner[row] = (intv)(INT_MAX);
  }
  draw_discs(part, disc, entry, map, owner, nodes, 1);
}

// The owner of every node; INT_MAX where there is none.
kernel void splat_owner(global const float* disc, ENTRIES(end, entry),
                        global int* owner,  // [ny*nx]
                        const ListedBins bins, const Lattice nodes) {
  const Part part = part_of(end, bins);
  if (part.bin >= bins.end) return;
  intv owners[ROWS];
  draw_owners(part, disc, entry, owners, nodes);
  for (int row = 0; row < ROWS && part.j + row < nodes.ny; ++row) {
    int own[WIDTH];
    STOREI(owners[row], own);
    for (int lane = 0; lane < WIDTH && part.i + lane < nodes.nx; ++lane)
      owner[(part.j + row) * nodes.nx + part.i + lane] = own[lane];
  }
}

// How many nodes each particle owns. One addition for each owner in a part.
kernel void count_owned(global const float* disc, ENTRIES(end, entry),
                        global int* owned,  // [n] 0 before
                        const ListedBins bins, const Lattice nodes) {
  const Part part = part_of(end, bins);
  if (part.begin == part.end) return;
  intv owners[ROWS];
  draw_owners(part, disc, entry, owners, nodes);
  for (;;) {
    intv least = owners[0];
    for (int row = 1; row < ROWS; ++row) least = min(least, owners[row]);
    const int owner = lowest_lane(least);
    if (owner == INT_MAX) return;
    intv counts = (intv)(0);
    for (int row = 0; row < ROWS; ++row) {
      const intv own = owners[row] == owner;
      counts += SELECT((intv)(0), (intv)(1), own);
      owners[row] = SELECT(owners[row], (intv)(INT_MAX), own);
    }
    const int number = total_of_lanes(counts);
    atomic_add(owned + owner, number);
  }
}
