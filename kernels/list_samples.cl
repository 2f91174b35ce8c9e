// list_samples.cl: makes the lists of samples.cl. One work-item per tile.

// The samples of a tile where one of two maps is finite, of every `every`th row and column (a power
// of two, TILE at most).
kernel void list_samples(global const float* wanted,     // [samples]
                         global const float* or_wanted,  // [samples]
                         global int* sample,             // [tiles][256] out
                         global int* count,              // [tiles] out
                         global uchar* listed,           // [blocks] 1 where one of 8 x 8 samples is
                                                         // listed, else as before
                         const int2 samples, const int2 tiles, const int every) {
  const int tile = get_global_id(0);
  if (tile >= tiles.x * tiles.y) return;
  const int i0 = tile % tiles.x * TILE, j0 = tile / tiles.x * TILE;
  const int whole = i0 + TILE <= samples.x && j0 + TILE <= samples.y;
  const int quarter = max(TILE_SAMPLES / 4 / (every * every), 1);
  int used = 0;
  for (int block = 0; block < 4; ++block) {  // of 8 x 8 samples
    const int i1 = i0 + block % 2 * 8, j1 = j0 + block / 2 * 8;
    if (whole) {  // most show nothing
      float8 least = (float8)(INFINITY);
      for (int j = j1; j < j1 + 8; ++j) {
        const float8 a = vload8(0, wanted + j * samples.x + i1);
        const float8 b = vload8(0, or_wanted + j * samples.x + i1);
        least = select(least, a, a < least);
        least = select(least, b, b < least);
      }
      const float4 four = fmin(least.lo, least.hi);
      if (!(fmin(fmin(four.x, four.y), fmin(four.z, four.w)) < INFINITY)) continue;
    }
    const int before = used;
    for (int k = block * quarter; k < (block + 1) * quarter; ++k) {
      // Morton order: the even bits of k are the column's, the odd ones the row's.
      const int column = k & 1 | k >> 1 & 2 | k >> 2 & 4 | k >> 3 & 8;
      const int row = k >> 1 & 1 | k >> 2 & 2 | k >> 3 & 4 | k >> 4 & 8;
      const int i = i0 + every * column, j = j0 + every * row;
      if (column * every >= TILE || row * every >= TILE || i >= samples.x || j >= samples.y)
        continue;
      const int at = j * samples.x + i;
      sample[tile * TILE_SAMPLES + used] = at;  // without branches, which nobody could foretell
      used += (wanted[at] < INFINITY) | (or_wanted[at] < INFINITY);
    }
    if (used > before) listed[block_of(i1, j1, samples.x)] = 1;
  }
  count[tile] = used;
}

// Those of a list where `nearer` is less than `depth`, where it is finite, or where it is not.
#define NEARER 0
#define FINITE 1
#define INFINITE 2

kernel void keep_samples(global const int* sample, global const int* count,
                         global const float* nearer,  // [samples]
                         global const float* depth,   // [samples], read where NEARER
                         global int* kept,            // [tiles][256] out
                         global int* kept_count,      // [tiles] out
                         const int tiles, const int where) {
  const int tile = get_global_id(0);
  if (tile >= tiles) return;
  int used = 0;
  for (int k = 0; k < count[tile]; ++k) {
    const int at = sample[tile * TILE_SAMPLES + k];
    const int less = nearer[at] < (where == NEARER ? depth[at] : INFINITY);
    if (less != (where == INFINITE)) kept[tile * TILE_SAMPLES + used++] = at;
  }
  kept_count[tile] = used;
}
