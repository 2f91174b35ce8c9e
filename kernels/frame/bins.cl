// bins.cl: which particles may touch which bin of samples, so that one group of work-items owns a
// bin and draws all of its particles without atomics. A bin is BIN x BIN samples.
//
// Most particles lie behind others. Each covers some small cells of samples wholly, and is there
// nowhere deeper than one known depth: the nearest of these bounds the map in a cell, and the
// deepest of a bin's cells bounds it in the bin. What lies wholly behind that is in no map.
//
// box: [4][stride] first and last sample of a particle along i, first and last along j, all
// included; none where a last is below its first.

// Particles are taken in chunks, one to a work-item. A GPU's (WIDTH 1) are single particles, which
// share what they write; elsewhere each chunk has its own, and nothing is atomic. Loops of CPUs
// take rows of four, most of what a particle covers: loops that end sooner or later cost more.
#if WIDTH == 1
#define TAKE_NEXT(count) atomic_inc(count)
inline int count_row(global const float* bound, global int* counts, const int number,
                     const float nearest) {
  int any_shown = 0;
  for (int i = 0; i < number; ++i) {
    if (!(nearest <= bound[i])) continue;
    atomic_inc(counts + i);
    any_shown = 1;
  }
  return any_shown;
}
inline void lower_cells(global uint* row, const int number, const uint bits) {
  for (int i = 0; i < number; ++i) atomic_min(row + i, bits);
}
#else
#define TAKE_NEXT(count) (*(count))++
inline int any_of_four(const int4 test) {  // see any_lane
  const long2 pair = as_long2(test);
  return (pair.x | pair.y) != 0;
}
inline int count_row(global const float* bound, global int* counts, const int number,
                     const float nearest) {
  int4 shown = (int4)(0);
  for (int i = 0; i < number; i += 4) {
    const int4 here = (i + (int4)(0, 1, 2, 3) < number) & (nearest <= vload4(0, bound + i));
    vstore4(vload4(0, counts + i) - here, 0, counts + i);
    shown |= here;
  }
  return any_of_four(shown);
}
inline void lower_cells(global uint* row, const int number, const uint bits) {
  for (int i = 0; i < number; i += 4) {
    const uint4 before = vload4(0, row + i);
    const int4 within = i + (int4)(0, 1, 2, 3) < number;
    vstore4(select(before, min(before, (uint4)(bits)), within), 0, row + i);
  }
}
#endif

// The least bound of each cell of CELL x CELL samples.
kernel void bound_cells(global const int* cover,      // [4][stride] first and last cell along i, j
                        global const float* deepest,  // [stride] depth in these cells, at most
                        global uint* cell,  // [chunks][own] or [cells], out: bits of the depth
                        const int n, const int stride, const int cells_x,
                        const int chunk,  // particles
                        const int own) {  // cells of a chunk and some more; 0: shared ones, which
                                          // are +inf before
  const int first = get_global_id(0) * chunk;
  global uint* cells = cell + get_global_id(0) * own;
  for (int k = 0; k < own; ++k) cells[k] = as_uint(INFINITY);
  for (int p = first; p < min(first + chunk, n); ++p) {
    const int i0 = cover[p], number = cover[stride + p] - i0 + 1;
    const int j0 = cover[2 * stride + p], j1 = cover[3 * stride + p];
    const uint bits = as_uint(deepest[p]);
    for (int j = j0; j <= j1; ++j) lower_cells(cells + j * cells_x + i0, number, bits);
  }
}

// The least of the chunks' bounds, in place of the first's. One work-item per WIDTH cells of `own`.
kernel void least_bounds(global float* cell,  // [chunks][own]
                         const int chunks, const int own) {
  const int at = get_global_id(0) * WIDTH;
  if (at >= own) return;  // the range is rounded up to whole work-groups
  floatv least = LOADF(cell + at);
  for (int c = 1; c < chunks; ++c) least = fmin(least, LOADF(cell + c * own + at));
  STOREF(least, cell + at);
}

// The deepest bound of a bin's cells. One work-item per bin.
kernel void bound_bins(global const float* cell,  // [cells]
                       global float* bound,       // [bins]
                       const int2 cells,          // nx, ny
                       const int2 bins,           // nx, ny
                       const int side) {          // cells along a bin's side
  const int i = get_global_id(0), j = get_global_id(1);
  if (i >= bins.x || j >= bins.y) return;
  float deepest = 0.0f;
  for (int y = j * side; y < min((j + 1) * side, cells.y); ++y)
    for (int x = i * side; x < min((i + 1) * side, cells.x); ++x)
      deepest = fmax(deepest, cell[y * cells.x + x]);
  bound[j * bins.x + i] = deepest;
}

// How many particles of each chunk may show in each bin: those whose key is at most the bin's
// bound.
kernel void count_bins(OUTLINES(const, box, key),
                       global const float* bound,  // [bins]
                       global int* count,          // [chunks][own] or [bins], out
                       global uchar* shown,        // [n] out: 1 where a particle shows in any bin
                       const Chunked all) {
  const int n = all.count, stride = all.stride, bins_x = all.across;
  const int chunk = all.chunk, own = all.own, first = get_global_id(0) * chunk;
  global int* counts = count + get_global_id(0) * own;
  for (int bin = 0; bin < own; ++bin) counts[bin] = 0;
  for (int p = first; p < min(first + chunk, n); ++p) {
    const int i0 = box[p], i1 = box[stride + p], j0 = box[2 * stride + p], j1 = box[3 * stride + p];
    shown[p] = 0;
    if (i1 < i0 || j1 < j0) continue;
    const float nearest = key[p];
    const int left = i0 / BIN, number = i1 / BIN - left + 1, top = j0 / BIN, down = j1 / BIN - top;
    const int corner = top * bins_x + left;
#if WIDTH > 1
    if (number <= 4 && down < 3) {  // most are, and wholly behind
      const int4 before = (nearest <= vload4(0, bound + corner)) |
                          (nearest <= vload4(0, bound + corner + min(1, down) * bins_x)) |
                          (nearest <= vload4(0, bound + corner + down * bins_x));
      if (!any_of_four(before & ((int4)(0, 1, 2, 3) < number))) continue;
    }
#endif
    int any_shown = 0;
    for (int j = 0; j <= down; ++j)
      any_shown |=
          count_row(bound + corner + j * bins_x, counts + corner + j * bins_x, number, nearest);
    shown[p] = any_shown;
  }
}

// The sum of a bin's counts, and each chunk's place among its entries. One work-item per WIDTH bins
// of `own`.
kernel void sum_counts(global int* count,  // [chunks][own] how many there are; out: how many in the
                                           // chunks before
                       global int* total,  // [own] out
                       const int chunks, const int own) {
  const int bin = get_global_id(0) * WIDTH;
  if (bin >= own) return;
  intv sum = (intv)(0);
  for (int c = 0; c < chunks; ++c) {
    const intv here = LOADI(count + c * own + bin);
    STOREI(sum, count + c * own + bin);
    sum += here;
  }
  STOREI(sum, total + bin);
}

// Lists them, in any order: a particle's index, and the part of its box that lies in the bin.
// Chunks as in count_bins.
kernel void fill_bins(OUTLINES(const, box, key), global const float* bound,
                      global const uchar* shown,  // [n]
                      global const int* end,      // [bins] end of each bin's entries, which begin at
                                                  // the one before
                      global int* place,          // [chunks][own] or [bins] the next within a bin
                      global int2* entry,         // [entries]
                      const Chunked all,
                      const ListedBins bins) {
  const int n = all.count, stride = all.stride, bins_x = all.across;
  const int chunk = all.chunk, own = all.own, first = get_global_id(0) * chunk;
  global int* places = place + get_global_id(0) * own;
  for (int p = first; p < min(first + chunk, n); ++p) {
    if (!shown[p]) continue;
    const int i0 = box[p], i1 = box[stride + p], j0 = box[2 * stride + p], j1 = box[3 * stride + p];
    const float nearest = key[p];
    for (int j = j0 / BIN; j <= j1 / BIN; ++j) {
      const int rows = max(j0 - j * BIN, 0) << 8 | min(j1 - j * BIN, BIN - 1) << 12;
      for (int i = i0 / BIN; i <= i1 / BIN; ++i) {
        const int bin = j * bins_x + i;
        if (bin < bins.begin || bin >= bins.end || !(nearest <= bound[bin])) continue;
        const int columns = max(i0 - i * BIN, 0) | min(i1 - i * BIN, BIN - 1) << 4;
        const int begin = bin > bins.begin ? end[bin - 1] : 0;
        entry[begin + TAKE_NEXT(places + bin)] = (int2)(p, columns | rows);
      }
    }
  }
}
