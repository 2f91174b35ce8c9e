// list_samples.cl: makes the lists of samples.cl. One work-item per tile.

// Morton order: the even bits of k are the column's, the odd ones the row's.
inline int column_of(const int k) { return (k & 1) | (k >> 1 & 2) | (k >> 2 & 4) | (k >> 3 & 8); }
inline int row_of(const int k) { return column_of(k >> 1); }

// The samples of a tile where a map is finite, of every `every`th row and column (a power of two,
// TILE at most).
inline void list_tile(const int tile, global const float* wanted, global const int* occupied,
                      global int* sample, global int* count, global uchar* listed,
                      const int2 samples, const int2 tiles, const int every) {
  const int i0 = tile % tiles.x * TILE, j0 = tile / tiles.x * TILE;
  const int whole = i0 + TILE <= samples.x && j0 + TILE <= samples.y;
  const int quarter = max(TILE_SAMPLES / 4 / (every * every), 1);
  int used = 0;
  for (int block = 0; block < 4; ++block) {  // of 8 x 8 samples
    const int i1 = i0 + block % 2 * 8, j1 = j0 + block / 2 * 8;
    if (!occupied[block_of(i1, j1, samples.x)]) continue;
    if (whole) {
      float8 least = (float8)(INFINITY);
      for (int j = j1; j < j1 + 8; j += every) {
        const float8 row = vload8(0, wanted + j * samples.x + i1);
        least = select(least, row, row < least);
      }
      const float4 four = fmin(least.lo, least.hi);
      if (!(fmin(fmin(four.x, four.y), fmin(four.z, four.w)) < INFINITY)) continue;
    }
    const int before = used;
    for (int k = block * quarter; k < (block + 1) * quarter; ++k) {
      const int column = every * column_of(k), row = every * row_of(k);
      if (column >= TILE || row >= TILE || i0 + column >= samples.x || j0 + row >= samples.y)
        continue;
      const int at = (j0 + row) * samples.x + i0 + column;
      sample[tile * TILE_SAMPLES + used] = at;  // without branches, which nobody could foretell
      used += wanted[at] < INFINITY;
    }
    if (listed && used > before) listed[block_of(i1, j1, samples.x)] = 1;
  }
  count[tile] = used;
  count[tiles.x * tiles.y + tile] = 0;
}

// Of a map of samples that show nothing so far; and minus the least depth that a front in a bin must
// exceed to lie more than a gap behind one of them, so that a disc whose deepest front is not below it
// is left out; -INFINITY where no front is asked for.
kernel void list_gaps(global const float* open,    // [samples]
                      global const int* occupied,  // [blocks] 0: not finite in a block, not read
                      SAMPLES(, sample, count),    // out
                      global int* count_again,     // [2][tiles] out: the same as count
                      global uchar* listed,        // [blocks] 1 where one of 8 x 8 samples is listed,
                                                   // else as before
                      global float* bound,         // [bins] out
                      const int2 samples, const float gap) {  // particle radii
  const int2 tiles = (samples + TILE - 1) / TILE;
  const int tile = get_global_id(0), all = tiles.x * tiles.y;
  if (tile >= all) return;
  list_tile(tile, open, occupied, sample, count, listed, samples, tiles, 1);
  count_again[tile] = count[tile];
  count_again[all + tile] = 0;
  const int2 bins = (samples + BIN - 1) / BIN;
  const int sides = TILE / BIN, i0 = tile % tiles.x * sides, j0 = tile / tiles.x * sides;
  float least[TILE / BIN * (TILE / BIN)];
  for (int b = 0; b < sides * sides; ++b) least[b] = INFINITY;
  for (int k = 0; k < count[tile]; ++k) {
    const int at = sample[tile * TILE_SAMPLES + k];
    const int b = (at / samples.x / BIN - j0) * sides + at % samples.x / BIN - i0;
    least[b] = fmin(least[b], open[at] + gap);
  }
  for (int b = 0; b < sides * sides; ++b)
    if (i0 + b % sides < bins.x && j0 + b / sides < bins.y)
      bound[(j0 + b / sides) * bins.x + i0 + b % sides] = -least[b];
}

// Of the maps of surface and splash, into two lists.
kernel void list_fronts(FRONTS(reference, splash, occupied, splash_occupied),
                        SAMPLES(, sample, count), SAMPLES(, splash_sample, splash_count),
                        const int2 samples, const int2 tiles, const int every) {
  const int tile = get_global_id(0);
  if (tile >= tiles.x * tiles.y) return;
  list_tile(tile, reference, occupied, sample, count, 0, samples, tiles, every);
  list_tile(tile, splash, splash_occupied, splash_sample, splash_count, 0, samples, tiles, every);
}

// The wanted samples of a tile's `side` x `side` cells from cell (a, b) on, by the bits from `shift` on. A
// cell is 2 x 2 of every `every`th row and column; three bits are of those that may be wanted: right of the
// first, below it, and between both, which is Morton order. Returns how many there are.
inline int list_wanted(global const uchar* wanted, global int* sample, global uchar* listed,
                       const int2 samples, const int stride, const int every, const int side,
                       const int a, const int b, const int shift) {
  int used = 0;
  for (int k = 0; k < side * side; ++k) {
    const int column = a + column_of(k), row = b + row_of(k);
    const int which = wanted[row * stride + column] >> shift & 7;
    if (which == 0) continue;
#pragma unroll
    for (int m = 0; m < 3; ++m) {
      const int i = every * (2 * column + (m != 1)), j = every * (2 * row + (m != 0));
      sample[used] = j * samples.x + i;  // without branches, as above
      used += which >> m & 1;
      listed[block_of(i, j, samples.x)] |= which >> m & 1;
    }
  }
  return used;
}

// The samples of a tile that interpolation leaves: those that may show surface, and those that may
// show splash.
kernel void list_between(global const uchar* wanted,  // [rows][stride] of cells, 0 where there are
                                                      // none; a multiple of 8 in a row
                         SAMPLES(, sample, count), SAMPLES(, splash_sample, splash_count),
                         global uchar* listed, const int2 samples, const int2 tiles,
                         const int stride, const int every) {
  const int tile = get_global_id(0);
  if (tile >= tiles.x * tiles.y) return;
  const int side = TILE / 2 / every;  // of the tile, cells
  const int a = tile % tiles.x * side, b = tile / tiles.x * side;
  uchar8 any_wanted = (uchar8)(0);  // of this tile and perhaps of those beside it
  for (int row = 0; row < side; ++row)
    any_wanted |= vload8(0, wanted + (b + row) * stride + a / 8 * 8);
  const int any_surface = as_ulong(any_wanted & (uchar)(7)) != 0;
  const int any_splash = as_ulong(any_wanted & (uchar)(56)) != 0;
  count[tile] = any_surface ? list_wanted(wanted, sample + tile * TILE_SAMPLES, listed, samples,
                                          stride, every, side, a, b, 0)
                            : 0;
  splash_count[tile] = any_splash ? list_wanted(wanted, splash_sample + tile * TILE_SAMPLES, listed,
                                                samples, stride, every, side, a, b, 3)
                                  : 0;
  count[tiles.x * tiles.y + tile] = splash_count[tiles.x * tiles.y + tile] = 0;
}

// Samples that are looked at before any of them is kept: a GPU's work-item waits for each it loads.
#if WIDTH == 1
#define AT_ONCE 16
#else
#define AT_ONCE 1
#endif

// Those of a list where `nearer` is less than `depth`, and where NEARER_UNLESS says so `unwanted` is not
// finite.
kernel void keep_samples(SAMPLES(const, sample, count),
                         global const float* nearer,    // [samples]
                         global const float* depth,     // [samples]
                         global const float* unwanted,  // [samples], read where NEARER_UNLESS
                         SAMPLES(, kept, kept_count),   // out
                         const int tiles, const int where) {
  const int tile = get_global_id(0);
  if (tile >= tiles) return;
  sample += tile * TILE_SAMPLES;
  kept += tile * TILE_SAMPLES;
  const int listed = count[tile];
  int used = 0;
  for (int k = 0; k < listed; k += AT_ONCE) {
    int at[AT_ONCE], keep[AT_ONCE];
#pragma unroll
    for (int m = 0; m < AT_ONCE; ++m) {
      at[m] = sample[min(k + m, listed - 1)];
      keep[m] = (k + m < listed) & (nearer[at[m]] < depth[at[m]]);
      if (where == NEARER_UNLESS) keep[m] &= !(unwanted[at[m]] < INFINITY);
    }
#pragma unroll
    for (int m = 0; m < AT_ONCE; ++m)
      if (keep[m]) kept[used++] = at[m];
  }
  kept_count[tile] = used;
  kept_count[tiles + tile] = 0;
}
