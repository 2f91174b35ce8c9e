// behind.cl: the nearest front that lies behind what a layer has shown, at the samples that show
// nothing yet (samples.cl). Particles are those of visible.cl, as outline_discs leaves them.
//
// uses: samples.cl

// The nearest front that lies deeper than behind + gap; INFINITY where there is none. TILE_ITEMS
// work-items per tile.
kernel void splat_behind(SAMPLES(const, sample, count),
                         global const float* disc,  // [stride][8] of outline_discs
                         ENTRIES(end, entry),
                         global const float* behind,  // [samples] depth, finite where listed
                         global float* depth,         // [samples] out in the listed bins
                         const ListedBins bins, const Lattice samples, const float gap) {
  const int tile = tile_of_item();
  if (tile >= tiles_in(samples.nx, samples.ny)) return;
  for (int place = item_of_tile() * WIDTH; place < count[tile]; place += TILE_ITEMS * WIDTH) {
    int at[WIDTH], column[WIDTH], row[WIDTH], bin[WIDTH];
    global const int* list = sample + tile * TILE_SAMPLES + place;
    const intv used = TO_INTV(LANES) < count[tile] - place;
    const intv listed = SELECT((intv)(list[0]), LOADI(list), used);
    const intv j = rows_in(tile, listed, samples.nx);
    const intv i = listed - j * samples.nx, in_bin = j / BIN * bins.across + i / BIN;
    STOREI(listed, at);
    STOREI(i, column);
    STOREI(j, row);
    STOREI(in_bin, bin);
    const floatv u = samples.first + samples.step * TO_FLOATV(i),
                 v = samples.first + samples.step * TO_FLOATV(j);
    const floatv least = gather_float(behind, at) + gap;
    intv left = used & (in_bin >= bins.begin) & (in_bin < bins.end);
    for (int lane = 0; lane < WIDTH; ++lane) {  // the lanes of one bin go together
      if (!(BITS(left) >> lane & 1)) continue;
      const intv here = left & (in_bin == bin[lane]);
      left &= !here;
      const float before = least_lane(SELECT((floatv)(INFINITY), least, here));
      const intv i_in = i - column[lane] / BIN * BIN, j_in = j - row[lane] / BIN * BIN;
      floatv map = (floatv)(INFINITY);
      float deepest = INFINITY;
      const int begin = bin[lane] > bins.begin ? end[bin[lane] - 1] : 0;
      for (int e = begin; e < end[bin[lane]]; ++e) {
        const float8 d = vload8(entry[e].x, disc);
        const int packed = entry[e].y;
        const float t = d.s0, bulge = d.s5;
        if ((e - begin) % 8 == 7)
          deepest = -least_lane(SELECT((floatv)(INFINITY), -map, here));
        if (d.s6 > deepest || !(fmax(fmax(t - bulge, t), 1e-6f) > before)) continue;
        const floatv du = (u - d.s1) * d.s3, dv = (v - d.s2) * d.s4;
        const intv inside = (i_in >= (packed & 15)) & (i_in <= (packed >> 4 & 15)) &
                            (j_in >= (packed >> 8 & 15)) & (j_in <= (packed >> 12 & 15));
        // NaN beside the disc, where no comparison holds.
        floatv front = t - bulge * sqrt(1.0f - (du * du + dv * dv));
        front = SELECT(front, (floatv)(1e-6f), front < 1e-6f);
        map = SELECT(map, front, inside & (front < map) & (front > least));
      }
      scatter_float(map, depth, at, here);
    }
  }
}
