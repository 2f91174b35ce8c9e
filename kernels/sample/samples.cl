// samples.cl: lists of the samples that a stage has to work on, tile by tile, so that the items of
// a work-group have work that lies close together on the screen.
//
// A tile is 16 x 16 samples. Its list has room for all of them, in Morton order: neighbours in the
// list form small blocks on the screen. Behind the counts of the tiles' samples there are those of a
// second list, of the samples that whoever works on the first leaves to another kernel; who makes the
// first list sets them to 0.

// WIDTH places of a list, as a work-item takes them.
typedef struct {
  int at[WIDTH];  // samples; lanes that are not in use repeat the first
  intv used;
  Rays rays;
} Lanes;

// The tile of a work-item. Where the items of a work-group share it, it comes from what is the same for
// all of them: loop bounds depend on it. Where an item has a tile of its own, the last ones may be beyond all
// tiles.
inline int tile_of_item(void) {
#if TILE_ITEMS == 1
  return get_global_id(0);
#else
  return (int)(get_group_id(0) * get_local_size(0)) / TILE_ITEMS;
#endif
}

// The same for work that differs much from part to part of the image: items with a tile of their own are
// dealt to DEALT parts of it. A CPU's thread takes hundreds of items that follow each other, and those
// then have about as much work as any others. Where work is even, what lies together is faster.
#define DEALT 4
inline int dealt_tile(void) {
#if TILE_ITEMS == 1
  const int item = get_global_id(0), items = get_global_size(0), part = item % DEALT;
  return part * (items / DEALT) + min(part, items % DEALT) + item / DEALT;
#else
  return tile_of_item();
#endif
}

inline int tiles_in(const int nx, const int ny) {
  return (nx + TILE - 1) / TILE * ((ny + TILE - 1) / TILE);
}

inline int tiles_of(const Screen screen) { return tiles_in(screen.nx, screen.ny); }

// Which of the TILE_ITEMS items of its tile a work-item is.
inline int item_of_tile(void) { return (int)get_global_id(0) % TILE_ITEMS; }

// The rows that samples of a tile lie in, without a division of integers for each lane: from the tile's
// first row on, small numbers, which half a sample keeps off the next row.
inline intv rows_in(const int tile, const intv at, const int nx) {
  const int tiles_x = (nx + TILE - 1) / TILE;
  const int corner = tile / tiles_x * TILE * nx + tile % tiles_x * TILE;
  return TO_INTV((TO_FLOATV(at - corner) + 0.5f) / (float)nx) + corner / nx;
}

// The lanes from `place` on of a tile. Returns whether any is in use.
inline int load_lanes(const int tile, const int place,
                      global const int* sample,  // [tiles][256]
                      global const int* count,   // [tiles]
                      const Screen screen, Lanes* lanes) {
  if (place >= count[tile]) return 0;
  // Loaded whole, which a list has room for: what is put together value by value waits to be read.
  global const int* list = sample + tile * TILE_SAMPLES + place;
  lanes->used = TO_INTV(LANES) < count[tile] - place;
  const intv at = SELECT((intv)(list[0]), LOADI(list), lanes->used);
  STOREI(at, lanes->at);
  const intv row = rows_in(tile, at, screen.nx);
  const floatv u = screen.first + screen.step * TO_FLOATV(at - row * screen.nx);
  lanes->rays = rays_at(screen.rays, u, screen.first + screen.step * TO_FLOATV(row));
  return 1;
}

// Adds samples to a tile's second list, where wanted. Where one item goes through the tile, `used` are
// there so far, and their order stays; else items come in any order. Returns how many are there.
inline int leave_samples(const int* at, const intv wanted, const int used, global int* list,
                         global int* left) {
  int next = used;
#if TILE_ITEMS == 1
  if (!ANY(wanted)) return next;
  int want[WIDTH];
  STOREI(wanted, want);
  for (int k = 0; k < WIDTH; ++k)
    if (want[k]) list[next++] = at[k];
#else
  if (wanted) list[atomic_inc(left)] = at[0];
#endif
  return next;
}

// Stores depths and normals at the samples where wanted.
// Turns a unit normal that does not face a ray (dx, dy, -1) until it does, just: what is seen faces the
// eye, and where quadrics or layers are blended near a rim the mean may not.
inline void face_eye(const floatv dx, const floatv dy, floatv* nx, floatv* ny, floatv* nz) {
  const floatv square = dx * dx + dy * dy + 1.0f;
  const floatv along = *nx * dx + *ny * dy - *nz, most = (floatv)(-0.01f) * sqrt(square);
  // Zero stays: there is no surface.
  const intv turned = (along > most) & (*nx * *nx + *ny * *ny + *nz * *nz > 0.5f);
  if (!ANY(turned)) return;
  const floatv back = (along - most) / square;
  const floatv x = *nx - back * dx, y = *ny - back * dy, z = *nz + back;
  const floatv size = 1.0f / sqrt(larger(x * x + y * y + z * z, (floatv)(1e-30f)));
  *nx = SELECT(*nx, x * size, turned);
  *ny = SELECT(*ny, y * size, turned);
  *nz = SELECT(*nz, z * size, turned);
}

inline void store_surface(const floatv t, const floatv nx, const floatv ny, const floatv nz,
                          const int* at, const intv wanted, const int n, global float* depth,
                          global float* normal) {  // [3][n]
  scatter_float(t, depth, at, wanted);
  scatter_float(nx, normal, at, wanted);
  scatter_float(ny, normal + n, at, wanted);
  scatter_float(nz, normal + 2 * n, at, wanted);
}
