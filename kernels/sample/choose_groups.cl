// choose_groups.cl: which fits interpolated samples show (interpolate.cl).
//
// uses: hits.cl

// How many samples of the lattice lie among and around those that choose_groups takes together, at most:
// those from two apart.
#define CHOICES ((TILE / 2 + 2) * (CHOICE_ROWS / 2 + 2))

// The groups of the lattice's samples among and around the ones that are taken together with (i, j), each
// once. Returns how many.
inline int list_choices(const int i, const int j, global const float* depth,
                        global const int* found, const int2 samples, const int every,
                        int* choices) {
  const int first_i = i / TILE * TILE, first_j = j / CHOICE_ROWS * CHOICE_ROWS;
  const int2 low = max((int2)(first_i, first_j) / every - 1, 0) * every;
  const int2 high = min((int2)(first_i + TILE, first_j + CHOICE_ROWS) + every, samples);
  int count = 0;
  for (int y = low.y; y < high.y; y += every)
    for (int x = low.x; x < high.x; x += every) {
      const int at = y * samples.x + x;
      if (!(depth[at] < INFINITY) || found[at] < 0) continue;
      const int group = found[at] & ~OF_CORNER;
      int known = 0;
      for (int k = 0; k < count; ++k) known |= choices[k] == group;
      choices[count] = group;
      count += !known;
    }
  return count;
}

// The groups of interpolated samples: of those that are the heaviest at the lattice's samples around,
// the heaviest there. A work-item takes WIDTH samples of CHOICE_ROWS rows, or one.
kernel void choose_groups(global const float* depth,  // [samples]
                          global const int* found,    // [samples] where there is a depth; see
                                                      // OF_CORNER
                          FITS(record, foot),
                          global int* group,  // [samples] out
                          const Screen screen, const float d_max,
                          const int every) {  // samples from one of the lattice to the next, 2 .. TILE
  const int rows = WIDTH == 1 ? 1 : CHOICE_ROWS;
  const int i = get_global_id(0) * WIDTH, top = get_global_id(1) * rows;
  const int2 samples = (int2)(screen.nx, screen.ny);
  if (i >= samples.x || top >= samples.y) return;
  const Fits fits = {record, foot};
  int choices[CHOICES];
  int count = -1;  // not known yet
  for (int j = top; j < min(top + rows, samples.y); ++j) {
    int at[WIDTH], own[WIDTH], here[WIDTH], open[WIDTH];
    float t[WIDTH];
    int any_open = 0;
    for (int k = 0; k < WIDTH; ++k) {
      const int s = j * samples.x + min(i + k, samples.x - 1);
      at[k] = s;
      here[k] = i + k < samples.x ? -1 : 0;
      own[k] = depth[s] < INFINITY ? found[s] : -1;
      open[k] = own[k] >= OF_CORNER ? -1 : 0;
      t[k] = open[k] ? depth[s] : 0.0f;
      any_open |= open[k];
    }
    intv chosen = LOADI(own);
    if (any_open) {
      if (count < 0) count = list_choices(i, top, depth, found, samples, every, choices);
      const intv at_corner = LOADI(open);
      chosen = SELECT(chosen, chosen & ~OF_CORNER, at_corner);
      const Rays r = rays_at(screen.rays, screen.first + screen.step * ((float)i + LANES),
                             (floatv)(screen.first + screen.step * (float)j));
      const Sample s = sample_at(r, LOADF(t));
      floatv best = (floatv)(0.0f);
      for (int k = 0; k < count; ++k) {
        Hit hit;
        if (!hit_fit(fits, choices[k], s, d_max, &hit)) continue;
        const intv better = at_corner & (hit.weight > best);
        best = SELECT(best, hit.weight, better);
        chosen = SELECT(chosen, (intv)(choices[k]), better);
      }
    }
    int id[WIDTH];
    STOREI(chosen, id);
    for (int k = 0; k < WIDTH; ++k)
      if (here[k]) group[at[k]] = id[k];
  }
}
