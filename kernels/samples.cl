// samples.cl: lists of the samples that a stage has to work on, tile by tile, so that the items of
// a work-group have work that lies close together on the screen.
//
// A tile is 16 x 16 samples. Its list has room for all of them, in Morton order: neighbours in the
// list form small blocks on the screen.

// Whether lanes `place` .. `place + WIDTH - 1` of a tile's list are in use; their samples (unused
// lanes repeat the first) and positions on the screen.
inline intv load_samples(global const int* list, const int place, const int count, const int nx,
                         const float first, const float step, int* at, floatv* u, floatv* v) {
  float us[WIDTH], vs[WIDTH];
  int used[WIDTH];
#pragma unroll
  for (int k = 0; k < WIDTH; ++k) {
    used[k] = place + k < count ? 1 : 0;
    at[k] = list[used[k] ? place + k : place];
    us[k] = first + step * (float)(at[k] % nx);
    vs[k] = first + step * (float)(at[k] / nx);
  }
  *u = LOADF(us);
  *v = LOADF(vs);
#if WIDTH == 1
  return 1;
#else
  return LOADI(used) != 0;
#endif
}
