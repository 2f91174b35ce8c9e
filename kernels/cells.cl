// cells.cl: which cell of a hash grid a point lies in, which bucket holds the cell's points, and
// how to tell them from those of other cells in it, as cells.hpp does on the host. Functions only.

inline int cell_of(const float coordinate, const float inverse_cell) {
  const float scaled = fmin(fmax(coordinate * inverse_cell, -1e9f), 1e9f);
  const int cut = (int)scaled;  // floor(), which on some devices is a function of twenty operations
  return cut - (scaled < (float)cut ? 1 : 0);
}

inline intv cells_of(const floatv coordinate, const float inverse_cell) {
  const floatv scaled = smaller(larger(coordinate * inverse_cell, (floatv)(-1e9f)), (floatv)(1e9f));
  const intv cut = TO_INTV(scaled);
  return cut - SELECT((intv)(0), (intv)(1), scaled < TO_FLOATV(cut));
}

inline uint bucket_of(const int cx, const int cy, const int cz, const uint mask) {
  return ((uint)cx + ((uint)cy * 19349663u ^ (uint)cz * 83492791u)) & mask;
}

typedef struct {
  global const float* x;  // [n] eye space in bucket order, particle radii
  global const float* y;
  global const float* z;
  global const uint* tag;   // [n] of the particle's cell
  global const int* start;  // [buckets + 1]
  float inverse_cell;       // 1 / particle radii
  uint mask;
} Cells;

// Tells the particles of a cell from others in its bucket.
inline uint tag_of(const int cx, const int cy, const int cz) {
  return ((uint)cx & 2047u) | ((uint)cy & 2047u) << 11 | ((uint)cz & 1023u) << 22;
}

// Whether a tag is that of a cell of the row (along x) that `tag` is of.
#define SAME_ROW(tag, other) ((((tag) ^ (other)) & ~2047) == 0)

// Cells of a row lie in buckets one behind the other, so their particles in one range of places, or
// in two where the last bucket lies between them.
typedef struct {
  uint bucket;
  int left;        // cells
  int begin, end;  // of the range
} Row;

inline Row row_of(const int cx, const int cy, const int cz, const int cells, const uint mask) {
  const Row row = {bucket_of(cx, cy, cz, mask), cells, 0, 0};
  return row;
}

// Goes to the next range; 0: there is none.
inline int next_range(Row* row, global const int* start, const uint mask) {
  if (row->left <= 0) return 0;
  const int count = min(row->left, (int)(mask + 1u - row->bucket));
  row->begin = start[row->bucket];
  row->end = start[row->bucket + count];
  row->left -= count;
  row->bucket = 0;
  return 1;
}

// Particles that a work-item takes one after another, up to WIDTH of one cell at a time.
#if WIDTH == 1
#define BLOCK 1
#else
#define BLOCK 128
#endif

typedef struct {
  int cx, cy, cz;  // their cell
  int count;
  int at[WIDTH];  // places; lanes that are not in use hold what follows
  intv used;
} Together;

// The particle at `first` and those that follow it in the same cell, before `end`.
inline Together particles_together(const Cells cells, const int first, const int end, const int n) {
  const float c = cells.inverse_cell;
  const intv lane = TO_INTV(LANES);
  const intv x = cells_of(LOADF(cells.x + first), c), y = cells_of(LOADF(cells.y + first), c),
             z = cells_of(LOADF(cells.z + first), c);
  Together t;
  t.cx = cell_of(cells.x[first], c);
  t.cy = cell_of(cells.y[first], c);
  t.cz = cell_of(cells.z[first], c);
  const int same = BITS((x == t.cx) & (y == t.cy) & (z == t.cz) & (lane < end - first));
  t.count = popcount(same ^ (same + 1)) - 1;  // ones before the first zero
  STOREI(min(first + lane, (intv)(n - 1)), t.at);
  t.used = lane < t.count;
  return t;
}
