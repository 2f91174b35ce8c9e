// cells.cl: which cell of a hash grid a point lies in, which bucket holds the cell's points, and
// how to tell them from those of other cells in it, as cells.hpp does on the host. Functions only.

inline int cell_of(const float coordinate, const float inverse_cell) {
  return (int)floor(fmin(fmax(coordinate * inverse_cell, -1e9f), 1e9f));
}

inline uint bucket_of(const int cx, const int cy, const int cz, const uint mask) {
  return ((uint)cx * 73856093u ^ (uint)cy * 19349663u ^ (uint)cz * 83492791u) & mask;
}

// Tells the particles of a cell from others in its bucket.
inline uint tag_of(const int cx, const int cy, const int cz) {
  return ((uint)cx & 2047u) | ((uint)cy & 2047u) << 11 | ((uint)cz & 1023u) << 22;
}
