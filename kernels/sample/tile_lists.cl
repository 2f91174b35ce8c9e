// tile_lists.cl: the fits of a tile of samples, and which of them its rays may meet or a point may be near.
// Functions only: blend.cl meets them, hidden.cl looks at those that rays do not meet.
//
// Fits are listed by tile of 16x16 samples, as samples are (samples.cl).
//
// uses: hits.cl

// Fits of a list that are met before any is weighed: whether a fit that is met counts is a branch that
// nobody foresees, in front of a root and a division. A work-item with one ray has no room for them.
#if WIDTH == 1
#define BLOCK 1
#else
#define BLOCK 128
#endif

// The beam of a work-item's rays: its middle ray, eye point (ox + t dx, oy + t dy, -t), and how far
// the rays are from it in the plane of depth t, at most wide + t spread along either axis.
typedef struct {
  float ox, oy, dx, dy;
  float wide_x, wide_y, spread_x, spread_y;
  float slant;               // a ray's length over its depth, at most
  float length, per_square;  // of the middle ray's (dx, dy, -1); one over its square
} Beam;

// The middle of the lanes, and how far they are from it.
inline void middle_of(const floatv v, float* middle, float* wide) {
  const float low = least_lane(v), high = -least_lane(-v);
  *middle = 0.5f * (low + high);
  *wide = 0.5f * (high - low);
}

inline Beam beam_of(const Sample* sample) {
  const Sample s = *sample;
  Beam b;
  middle_of(s.sx - s.t * s.dx, &b.ox, &b.wide_x);
  middle_of(s.sy - s.t * s.dy, &b.oy, &b.wide_y);
  middle_of(s.dx, &b.dx, &b.spread_x);
  middle_of(s.dy, &b.dy, &b.spread_y);
  b.slant = sqrt(1.0f - least_lane(-(s.dx * s.dx + s.dy * s.dy)));
  const float square = b.dx * b.dx + b.dy * b.dy + 1.0f;
  b.length = sqrt(square);
  b.per_square = 1.0f / square;
  return b;
}

// A tile's list of fits. Where they lie is in rows, so that a search loads vectors of them: foot, reach
// and, for near_beam, the unit normal there and how far from the plane at its foot a fit is looked for.
typedef struct {
  global const int* fit;
  global const float* place;  // [4 or 8][stride]
  int count, stride;
} List;

// Which of the WIDTH fits from place k of a list a ray of the beam may meet. It passes the foot at
// no less than its distance in the foot's plane of depth over its slant; and across the way in which
// the fit's plane tilts from the rays, it passes by no more than what the slab around that plane, seen
// along the rays, has of its width. A hundredth more is let through, so that rounding never decides
// about a hit with weight.
inline intv near_beam(const List list, const int k, const Beam b) {
  global const float* row = list.place + k;
  const floatv t = -LOADF(row + 2 * list.stride), reach = LOADF(row + 3 * list.stride);
  const floatv x = LOADF(row) - (b.ox + t * b.dx);
  const floatv y = LOADF(row + list.stride) - (b.oy + t * b.dy);
  const floatv wide_x = b.wide_x + fabs(t) * b.spread_x, wide_y = b.wide_y + fabs(t) * b.spread_y;
  const floatv none = (floatv)(0.0f), farthest = 1.01f * (reach * b.slant) + 0.01f;
  const floatv off_x = larger(fabs(x) - wide_x, none), off_y = larger(fabs(y) - wide_y, none);
  const floatv nx = LOADF(row + 4 * list.stride), ny = LOADF(row + 5 * list.stride),
               nz = LOADF(row + 6 * list.stride), thick = LOADF(row + 7 * list.stride);
  const floatv along = (nx * b.dx + ny * b.dy - nz) * b.per_square;
  const floatv facing = fabs(along) * b.length;
  const floatv tilt = sqrt(larger(1.0f - facing * facing, none));
  const floatv kx = nx - along * b.dx, ky = ny - along * b.dy;
  const floatv width = (reach * (facing + b.spread_x + b.spread_y) + thick * tilt) * tilt +
                       wide_x * fabs(kx) + wide_y * fabs(ky);
  return (off_x * off_x + off_y * off_y < farthest * farthest) &
         (fabs(x * kx + y * ky) < 1.01f * width + 0.01f) & (LANES < (float)(list.count - k));
}

// Which of the WIDTH fits from place k of a list reach a box, as above.
inline intv reach_box(const List list, const int k, const Box b) {
  global const float* row = list.place + k;
  const floatv none = (floatv)(0.0f), x = LOADF(row), y = LOADF(row + list.stride),
               z = LOADF(row + 2 * list.stride), reach = 1.01f * LOADF(row + 3 * list.stride);
  const floatv dx = larger(larger(b.x0 - x, x - b.x1), none);
  const floatv dy = larger(larger(b.y0 - y, y - b.y1), none);
  const floatv dz = larger(larger(b.z0 - z, z - b.z1), none);
  return (dx * dx + dy * dy + dz * dz < reach * reach) & (LANES < (float)(list.count - k));
}

// Appends the places of the lanes that are set, from k on; without branches, which nobody could
// foretell.
inline int list_lanes(const intv set, const int k, int* place, const int before) {
  int lanes[WIDTH], count = before;
  STOREI(set, lanes);
#pragma unroll
  for (int l = 0; l < WIDTH; ++l) {
    place[count] = k + l;
    count += lanes[l] != 0;
  }
  return count;
}

// Lists the places of those fits of a list's block, from place `from` on, that reach a box. Returns how
// many they are.
inline int list_reaching(const List list, const int from, const Box box, int* place) {
  const int to = min(from + BLOCK, list.count);
  int found = 0;
  for (int k = from; k < to; k += WIDTH) found = list_lanes(reach_box(list, k, box), k, place, found);
  return found;
}

// The fits of a tile: those that rays may meet, and those that may be steep to them or turn away.
typedef struct {
  List met, rim;
} Listed;

inline List list_of(const int tile, global const int* start, global const int* fit,
                    global const float* place, const int stride) {
  const int first = start[tile];
  const List list = {fit + first, place + first, start[tile + 1] - first, stride};
  return list;
}
