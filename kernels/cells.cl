// cells.cl: which cell of a hash grid a point lies in, which bucket holds the cell's points, and
// how to tell them from those of other cells in it, as cells.hpp does on the host. Functions only.

inline int cell_of(const float coordinate, const float inverse_cell) {
  return (int)floor(fmin(fmax(coordinate * inverse_cell, -1e9f), 1e9f));
}

inline uint bucket_of(const int cx, const int cy, const int cz, const uint mask) {
  return ((uint)cx + ((uint)cy * 19349663u ^ (uint)cz * 83492791u)) & mask;
}

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
