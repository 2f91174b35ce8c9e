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

// Particles that a work-item takes one after another, up to WIDTH at a time that lie in one cell or in
// SPAN cells of a row.
#if WIDTH == 1
#define BLOCK 1
#define SPAN 1
#else
#define BLOCK 128
#define SPAN (WIDTH * 3 / 8)
#endif

typedef struct {
  int cx, cy, cz;  // their first cell
  int wide;        // the last one's distance from there, cells, and one
  int count;
  int at[WIDTH];  // places; lanes that are not in use hold what follows
  intv used;
} Together;

// Those of `left` particles x, y, z at the places `at` that lie in `span` cells of a row with the first
// one, up to the first that does not.
inline Together those_together(const Cells cells, const int span, const intv at, const floatv x,
                               const floatv y, const floatv z, const int left) {
  const float c = cells.inverse_cell;
  const intv lane = TO_INTV(LANES), cx = cells_of(x, c), cy = cells_of(y, c), cz = cells_of(z, c);
  Together t;
  STOREI(at, t.at);
  t.cx = cell_of(cells.x[t.at[0]], c);
  t.cy = cell_of(cells.y[t.at[0]], c);
  t.cz = cell_of(cells.z[t.at[0]], c);
  const int same = BITS((cx >= t.cx) & (cx < t.cx + span) & (cy == t.cy) & (cz == t.cz) & (lane < left));
  t.count = popcount(same ^ (same + 1)) - 1;  // ones before the first zero
  t.wide = cell_of(cells.x[t.at[t.count - 1]], c) - t.cx + 1;
  t.used = lane < t.count;
  return t;
}

// The particle at `first` and those that follow it in `span` cells of a row, before `end`.
inline Together particles_together(const Cells cells, const int span, const int first,
                                   const int end, const int n) {
  return those_together(cells, span, min(first + TO_INTV(LANES), (intv)(n - 1)), LOADF(cells.x + first),
                        LOADF(cells.y + first), LOADF(cells.z + first), end - first);
}

// Appends the taken lanes of the values from `first` on; without branches, which nobody could
// foretell. `item` has room for WIDTH more than are counted.
#if WIDTH == 1
inline int append(const int take, const int first, int* item, const int count) {
  item[count] = first;
  return count + (take ? 1 : 0);
}
#else
// Byte k of the product is how many of the lanes 0 .. k are taken, so that no lane waits for the one
// before.
inline int append_eight(const int8 take, const int first, int* item, const int count) {
  const ulong ones = 0x0101010101010101ul;
  const ulong upto = (as_ulong(convert_char8(take)) & ones) * ones, before = upto << 8;
  int* next = item + count;
#pragma unroll
  for (int l = 0; l < 8; ++l) next[before >> 8 * l & 255] = first + l;
  return count + (int)(upto >> 56);
}
inline int append(const intv take, const int first, int* item, const int count) {
#if WIDTH == 16
  return append_eight(take.hi, first + 8, item, append_eight(take.lo, first, item, count));
#elif WIDTH == 8
  return append_eight(take, first, item, count);
#else
  int lanes[WIDTH], next = count;
  STOREI(take, lanes);
  for (int l = 0; l < WIDTH; ++l) {
    item[next] = first + l;
    next -= lanes[l];
  }
  return next;
#endif
}
#endif

// Which of the particles from p on are within `reach` of a box, with room for rounding.
inline intv near_box(const Box box, const Cells cells, const int p, const float reach) {
  const floatv none = (floatv)(0.0f);
  const floatv px = LOADF(cells.x + p), py = LOADF(cells.y + p), pz = LOADF(cells.z + p);
  const floatv dx = larger(larger(box.x0 - px, px - box.x1), none);
  const floatv dy = larger(larger(box.y0 - py, py - box.y1), none);
  const floatv dz = larger(larger(box.z0 - pz, pz - box.z1), none);
  return fma(dx, dx, fma(dy, dy, dz * dz)) < reach * reach + 0.01f;
}

// Particles that are listed before they are summed.
#if WIDTH == 1
#define AT_A_TIME 1
#else
#define AT_A_TIME 128
#endif
