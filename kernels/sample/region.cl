// region.cl: where there is surface (paper 2.4.1).
//
// uses: outlines.cl

// What kept triangles may cover. One work-item per triangle.
kernel void outline_triangles(global const float* corners,  // [9][stride] u, v, t of three corners
                              global float* record,  // [stride][16] u, v; v and u of the sides from
                                                     // there to the others; 1 / doubled area; t
                              OUTLINES(, box, key),  // none is left out
                              const int n, const int stride, const Lattice samples,
                              const int perspective) {  // interpolate 1/t instead of t
  const int k = get_global_id(0);
  if (k >= n) return;
  const TriangleOutline o = outline_of_triangle(corners, k, stride, samples, perspective);
  box[k] = o.i0;
  box[stride + k] = o.i1;
  box[2 * stride + k] = o.j0;
  box[3 * stride + k] = o.j1;
  key[k] = -INFINITY;
  vstore16(o.record, k, record);
}

// The kept triangles' depth at every sample of the listed bins; INFINITY where there is none. Only
// bins that are `needed` are written. Kept triangles of a Delaunay triangulation do not overlap; on
// a shared edge the nearer one counts.
// The range: BIN * BIN / (WIDTH * ROWS) work-items a bin.
kernel void draw_triangles(global const float* record,  // [stride][16]
                           ENTRIES(end, entry),
                           global float* depth,  // [ny*nx]
                           const ListedBins bins, const Lattice samples, const int perspective,
                           global const int* needed) {  // [blocks] 0: no sample of a block is read
  const Part part = part_of(end, bins);
  if (part.bin >= bins.end) return;  // the range is rounded up to whole work-groups
  if (!needed[block_of(part.i, part.j, samples.nx)]) return;
  const intv column = TO_INTV(LANES) + part.column;
  const floatv x = samples.first + samples.step * TO_FLOATV(part.i - part.column + column);
  const floatv y = rows_of(part, samples.first, samples.step);
  floatv map[ROWS];
  for (int row = 0; row < ROWS; ++row) map[row] = (floatv)(INFINITY);
  for (int e = part.begin; e < part.end; ++e) {
    const int packed = entry[e].y;
    const int j0 = max(packed >> 8 & 15, part.row),
              j1 = min(packed >> 12 & 15, part.row + ROWS - 1);
    const float16 r = vload16(entry[e].x, record);
    const float inverse = r.s6;
    const floatv du = x - r.s0, a = du * r.s5, b = du * r.s3;
    const intv within = (column >= (packed & 15)) & (column <= (packed >> 4 & 15));
    float a_of_row[WIDTH], b_of_row[WIDTH];
    STOREF(r.s4 * (y - r.s1), a_of_row);
    STOREF(r.s2 * (y - r.s1), b_of_row);
    for (int j = j0; j <= j1; ++j) {
      const int row = j - part.row;
      const floatv l1 = (a - a_of_row[row]) * inverse, l2 = (b_of_row[row] - b) * inverse;
      const floatv l0 = 1.0f - l1 - l2;
      const intv inside = within & (l0 >= -1e-5f) & (l1 >= -1e-5f) & (l2 >= -1e-5f);
      if (WIDTH == 1 && !ANY(inside)) continue;  // of eight samples nobody could foretell it
      floatv d = l0 * r.s7 + l1 * r.s8 + l2 * r.s9;
      if (perspective) d = 1.0f / d;
      map[row] = SELECT(map[row], d, inside & (d > 0.0f) & (d < map[row]));
    }
  }
  store_rows(part, map, depth, samples.nx, samples.ny);
}
