// field.cl: the particles' density field C(x) = sum of W(|x - x_j|): 1 inside the fluid, 1/2 on a
// flat face, 1/4 on a square edge, 1/pi at a lone particle. Functions only: density.cl measures it,
// settle.cl follows it along rays.
//
// W is the cubic spline of smoothing length h = s (two particle radii, support two h) times s^3, but
// for .004 of its peak, as a polynomial in the squared distance, which needs neither a root nor a
// division:
//   W = (W0 v^3 + W1 v^4 + W2 v^5 + W3 v^6) / pi,    v = 4^2 - d^2
// with the spline's value at the middle and at a particle's radius, and its integral 1
// (docs/method.md).
//
// Whatever the way, a sum takes its particles in one order: by cell (z, then y, then x), then by
// place. So every way and every WIDTH gives the same bits.
//
// uses: cells.cl

#define NORM 0.318309886f  // 1 / pi
#define W0 (0.243067f / 4096.0f)  // v^3 of a v that is 1 in the middle
#define W1 (0.456322f / 65536.0f)
#define W2 (-0.842290f / 1048576.0f)
#define W3 (1.142901f / 16777216.0f)

// pi C and a quarter of its gradient, 1 / particle radii.
typedef struct {
  floatv c, gx, gy, gz;
} Field;

// A part of C's gradient. A sum of fused products that is zero has whatever sign the device gives it.
inline floatv gradient_of(const floatv sum) { return plain_zero(sum * (4.0f * NORM)); }

// Adds what the particle with `weight` at distance (dx, dy, dz) does to the field, v = 0 where it is
// out of reach.
inline void add_share(Field* sum, const floatv v, const floatv dx, const floatv dy, const floatv dz,
                      const float weight, const int with_gradient) {
  const floatv vv = weight * (v * v);
  const floatv share =
      fma(fma(fma((floatv)(W3), v, (floatv)(W2)), v, (floatv)(W1)), v, (floatv)(W0));
  sum->c = fma(share, vv * v, sum->c);
  if (!with_gradient) return;
  // -dW/dv / 2, times x - x_j
  const floatv cubic = fma((floatv)(-3.0f * W3), v, (floatv)(-2.5f * W2));
  const floatv g = fma(fma(cubic, v, (floatv)(-2.0f * W1)), v, (floatv)(-1.5f * W0)) * vv;
  sum->gx = fma(g, dx, sum->gx);
  sum->gy = fma(g, dy, sum->gy);
  sum->gz = fma(g, dz, sum->gz);
}

inline void add_particle(Field* sum, const floatv dx, const floatv dy, const floatv dz,
                         const float weight, const int with_gradient) {
  const floatv v =
      fma(-dx, dx, fma(-dy, dy, fma(-dz, dz, (floatv)(DENSITY_SUPPORT * DENSITY_SUPPORT))));
  add_share(sum, larger(v, (floatv)(0.0f)), dx, dy, dz, weight, with_gradient);
}

// Adds the listed particles.
inline void add_listed(const Cells cells, global const float* weight, const int* item,
                       const int count, const floatv x, const floatv y, const floatv z,
                       const int with_gradient, Field* sum) {
  Field field = *sum;  // else it is stored after each of them
  for (int k = 0; k < count; ++k) {
    const int p = item[k];
    add_particle(&field, x - cells.x[p], y - cells.y[p], z - cells.z[p], weight[p], with_gradient);
  }
  *sum = field;
}

// Adds the field at points where wanted, which lie in few cells; what other lanes get means nothing.
// Others of the same row in the buckets are far away. Half of what the cells around hold is out of reach
// of the wanted points' box, and adds nothing: a fourth of what a sum takes shows it.
inline void add_cells_around(const Cells cells, global const float* weight, const floatv x,
                             const floatv y, const floatv z, const intv wanted,
                             const int with_gradient, Field* sum) {
  global const int* tags = (global const int*)cells.tag;
  const Box box = box_of(x, y, z, wanted);
  const float c = cells.inverse_cell;
  const int cx = cell_of(box.x0, c), wide = cell_of(box.x1, c) - cx + 1;
  const int y0 = cell_of(box.y0, c), y1 = cell_of(box.y1, c);
  const int z0 = cell_of(box.z0, c), z1 = cell_of(box.z1, c);
  int item[AT_A_TIME + 2 * WIDTH], count = 0;
  for (int cz = z0 - 1; cz <= z1 + 1; ++cz)
    for (int cy = y0 - 1; cy <= y1 + 1; ++cy) {
      const int tag = (int)tag_of(cx, cy, cz);
      Row row = row_of(cx - 1, cy, cz, wide + 2, cells.mask);
      while (next_range(&row, cells.start, cells.mask))
        for (int p = row.begin; p < row.end; p += WIDTH) {
          count = append(near_box(box, cells, p, DENSITY_SUPPORT) & SAME_ROW(LOADI(tags + p), tag) &
                             (LANES < (float)(row.end - p)),
                         p, item, count);
          if (count < AT_A_TIME) continue;
          add_listed(cells, weight, item, count, x, y, z, with_gradient, sum);
          count = 0;
        }
    }
  add_listed(cells, weight, item, count, x, y, z, with_gradient, sum);
}

// Points by the cells they lie in.
typedef struct {
  intv x, y, z;  // their cells
  intv left;     // those not taken yet
  int cx, cy, cz;
} Points;

inline Points points_at(const Cells cells, const floatv x, const floatv y, const floatv z) {
  const float c = cells.inverse_cell;
  const Points points = {cells_of(x, c), cells_of(y, c), cells_of(z, c), (intv)(-1), 0, 0, 0};
  return points;
}

// The value of the one lane that is set; in memory, lanes would be a loop each on some devices.
inline int at_lane(const intv v, const intv lane) {
#if WIDTH == 1
  return v;
#else
  const long2 pair = as_long2(FOUR(v & lane, |));
  const long both = pair.x | pair.y;
  return (int)(both | both >> 32);
#endif
}

// Which cells are at most so many away from one along an axis.
inline intv near_cell(const intv cell, const int from, const int away) {
  return (cell >= from - away) & (cell <= from + away);
}

// Takes those that lie in the cell of the first that is left, or at most so many cells `away` from it
// along each axis.
inline intv take_cells(Points* p, const int away) {
  const int left = BITS(p->left);
  const intv first = TO_INTV(LANES) == popcount((left & -left) - 1);
  p->cx = at_lane(p->x, first);
  p->cy = at_lane(p->y, first);
  p->cz = at_lane(p->z, first);
  const intv here = p->left & near_cell(p->x, p->cx, away) & near_cell(p->y, p->cy, away) &
                    near_cell(p->z, p->cz, away);
  p->left &= !here;
  return here;
}

inline void take_field(Field* field, const Field from, const intv here) {
  field->c = SELECT(field->c, from.c, here);
  field->gx = SELECT(field->gx, from.gx, here);
  field->gy = SELECT(field->gy, from.gy, here);
  field->gz = SELECT(field->gz, from.gz, here);
}

// Rays by their length: l from the plane of depth 0 on, they are at depth t = l deep. Along
// a ray the squared distance from a particle is a parabola, so
//   v = most - (l + at)^2
// with `most`, the greatest v there is, and `at` of the ray and the particle.
typedef struct {
  Rays r;
  floatv deep;    // t / l = 1 / |D|
  floatv length;  // l / t
  floatv ex, ey;  // D / |D|
} Lines;

inline Lines lines_of(const Rays r) {
  const floatv length = sqrt(r.a), deep = 1.0f / length;
  const Lines line = {r, deep, length, deep * r.dx, deep * r.dy};
  return line;
}

typedef struct {
  floatv at, most;
} Parabola;

// From where the rays are as deep as the particle.
inline Parabola parabola_of(const Lines* line, const float px, const float py, const float pz) {
  const floatv t = (floatv)(-pz);
  const floatv x = fma(t, line->r.dx, line->r.ox) - px, y = fma(t, line->r.dy, line->r.oy) - py;
  const floatv along = fma(x, line->ex, y * line->ey), apart = fma(x, x, y * y);
  const Parabola p = {
      fma((floatv)(pz), line->length, along),
      fma(along, along, DENSITY_SUPPORT * DENSITY_SUPPORT - apart)};
  return p;
}

// Points of rays.
typedef struct {
  floatv l, x, y, z;
} Stops;

inline Stops stops_at(const Lines* line, const floatv l) {
  const floatv t = line->deep * l;
  const Stops s = {l, line->r.ox + t * line->r.dx, line->r.oy + t * line->r.dy, -t};
  return s;
}

// Adds what a particle does to the field there.
inline void add_on_lines(Field* sum, const Stops s, const Parabola parabola, const Cells cells,
                         global const float* weight, const int p, const int with_gradient) {
  const floatv u = s.l + parabola.at;
  const floatv v = larger(fma(-u, u, parabola.most), (floatv)(0.0f));
  add_share(sum, v, s.x - cells.x[p], s.y - cells.y[p], s.z - cells.z[p], weight[p], with_gradient);
}

// The field at any points of rays, seldom asked for and without lists of what is near: some devices
// copy this to wherever it is called, lane by lane.
inline Field field_at(const Cells cells, global const float* weight, const Lines* line,
                      const floatv l, const int with_gradient) {
  const floatv none = (floatv)(0.0f);
  const Stops s = stops_at(line, l);
  Field field = {none, none, none, none};
  Points points = points_at(cells, s.x, s.y, s.z);
  while (ANY(points.left)) {
    const intv here = take_cells(&points, 0);
    Field sum = {none, none, none, none};
    for (int row_at = 0; row_at < 9; ++row_at) {
      const int y_at = points.cy + row_at % 3 - 1, z_at = points.cz + row_at / 3 - 1;
      const uint tag = tag_of(points.cx, y_at, z_at);
      Row row = row_of(points.cx - 1, y_at, z_at, 3, cells.mask);
      while (next_range(&row, cells.start, cells.mask))
        for (int p = row.begin; p < row.end; ++p)
          if (SAME_ROW(cells.tag[p], tag))
            add_on_lines(&sum, s, parabola_of(line, cells.x[p], cells.y[p], cells.z[p]), cells,
                         weight, p, with_gradient);
    }
    take_field(&field, sum, here);
  }
  return field;
}

// The particles near rays between depths, so that the field along them needs no search.
#define MOST_NEAR 384
#define NEAR_ROOM (WIDTH == 1 ? 4 : WIDTH)
typedef struct {
  int count;  // -1: more than MOST_NEAR, search at every point
  int item[MOST_NEAR + NEAR_ROOM];
  Parabola parabola[MOST_NEAR + NEAR_ROOM];
} Near;

// Vectors of rays that one search of the cells serves: each then takes its own from what is found.
#if WIDTH == 1
#define VECTORS 1
#elif WIDTH == 16
#define VECTORS 4
#else
#define VECTORS 6
#endif

#define DEEPEST 24.0f  // particle radii
typedef struct {
  int vectors;
  Rays rays[VECTORS];
  intv wanted[VECTORS];
  floatv from, to;  // the depths that lanes ask for
  float low, high;  // depths between which it holds all that is near the rays
  int count;        // -2: not searched yet, -1: more than MOST_NEAR
  int item[MOST_NEAR + NEAR_ROOM];
} Around;

inline float sum_of_lanes(const floatv v) {
#if WIDTH == 1
  return v;
#else
  const float4 four = FOUR(v, +);
  const float2 two = four.lo + four.hi;
  return two.x + two.y;
#endif
}

// The beam of the wanted rays between two depths: an axis from (x, y, z) along (ex, ey, ez), and how
// far from it particles reach a ray. (Copies of rays in beam_of make rusticl crash at width 8.)
typedef struct {
  float x, y, z, ex, ey, ez, per_length, reach;
} Beam;

inline Beam beam_of(const Rays* rays, const intv* wanted, const int vectors, const float low,
                    const float high) {
  const floatv none = (floatv)(0.0f);
  floatv x0 = none, y0 = none, x1 = none, y1 = none, lanes = none;
  for (int v = 0; v < vectors; ++v) {
    const Rays* r = rays + v;
    x0 += SELECT(none, r->ox + low * r->dx, wanted[v]);
    y0 += SELECT(none, r->oy + low * r->dy, wanted[v]);
    x1 += SELECT(none, r->ox + high * r->dx, wanted[v]);
    y1 += SELECT(none, r->oy + high * r->dy, wanted[v]);
    lanes += SELECT(none, (floatv)(1.0f), wanted[v]);
  }
  const float share = 1.0f / sum_of_lanes(lanes);
  const float ax = share * sum_of_lanes(x0), ay = share * sum_of_lanes(y0);
  const float bx = share * sum_of_lanes(x1), by = share * sum_of_lanes(y1);
  floatv wide = none;
  for (int v = 0; v < vectors; ++v) {
    const Rays* r = rays + v;
    const floatv px = r->ox + low * r->dx - ax, py = r->oy + low * r->dy - ay;
    const floatv qx = r->ox + high * r->dx - bx, qy = r->oy + high * r->dy - by;
    wide = SELECT(wide, larger(wide, larger(px * px + py * py, qx * qx + qy * qy)), wanted[v]);
  }
  Beam b = {ax, ay, -low, bx - ax, by - ay, low - high, 0.0f, 0.0f};
  b.per_length = 1.0f / fmax(b.ex * b.ex + b.ey * b.ey + b.ez * b.ez, 1e-12f);
  b.reach = DENSITY_SUPPORT + sqrt(-least_lane(-wide)) + 0.01f;  // with room for rounding
  return b;
}

// Particles that a search looks at at once. A GPU's work-item waits for what it loads, and with four
// at a time a fourth as often.
#if WIDTH == 1
#define SEARCHED 4
typedef float4 floats;
typedef int4 ints;
#define LOAD_SEARCHED(p) vload4(0, (p))
#define SEARCHED_LANES ((int4)(0, 1, 2, 3))
#else
#define SEARCHED WIDTH
typedef floatv floats;
typedef intv ints;
#define LOAD_SEARCHED(p) JOIN(vload, WIDTH)(0, (p))
#define SEARCHED_LANES TO_INTV(LANES)
#endif

// Which points are within `reach` of the axis.
inline ints near_beam(const Beam b, const floats x, const floats y, const floats z,
                      const float reach) {
  const floats dx = x - b.x, dy = y - b.y, dz = z - b.z;
  const floats along = fma(dx, (floats)(b.ex), fma(dy, (floats)(b.ey), dz * b.ez));
  const floats s = -clamp(along * b.per_length, 0.0f, 1.0f);
  const floats qx = fma(s, (floats)(b.ex), dx), qy = fma(s, (floats)(b.ey), dy),
               qz = fma(s, (floats)(b.ez), dz);
  return fma(qx, qx, fma(qy, qy, qz * qz)) <= reach * reach;
}

// Cells of a row that never share a bucket (kFewestBuckets).
#define ROW_CELLS 32

// Which of the SEARCHED particles from p on a search takes.
inline ints taken_from(const Cells cells, const Beam b, const int p, const int end, const int tag,
                       const int row_cells) {
  const ints tags = LOAD_SEARCHED((global const int*)cells.tag + p);
  return near_beam(b, LOAD_SEARCHED(cells.x + p), LOAD_SEARCHED(cells.y + p),
                   LOAD_SEARCHED(cells.z + p), b.reach) &
         SAME_ROW(tags, tag) & (((tags - tag) & 2047) < row_cells) & (SEARCHED_LANES < end - p);
}

// Rows of cells that a search may visit. Points at depths that have nothing to do with each other have a
// longer and wider beam; then each finds what is near by itself.
#define MOST_ROWS 16384.0f

// Lists the particles near a beam; -1 where they are more than MOST_NEAR or the rows more than MOST_ROWS.
// Layer by layer, the stretch of the axis that particles in the layer may be nearest to bounds the rows,
// and its distance from a row the row's cells: hardly a cell is visited in vain.
inline int search_cells(const Cells cells, const Beam b, int* item) {
  const float c = cells.inverse_cell, side = 1.0f / c, end = b.z + b.ez;
  // What is beside the axis is at most so far above or below the point that it is nearest to.
  const float rise = b.reach * sqrt((b.ex * b.ex + b.ey * b.ey) * b.per_length);
  const float per_depth = 1.0f / fmax(-b.ez, 1e-6f);
  const float layers = 2.0f + (2.0f * b.reach - b.ez) * c, rows = 2.0f + 2.0f * b.reach * c;
  if (!(layers * rows < MOST_ROWS)) return -1;
  const int k1 = cell_of(b.z + b.reach, c);
  const floatv none = (floatv)(0.0f);
  int count = 0;
  for (int k = cell_of(end - b.reach, c); k <= k1; ++k) {
    const float z0 = (float)k * side, z1 = z0 + side;
    const float from = clamp((b.z - z1 - rise) * per_depth, 0.0f, 1.0f);
    const float to = clamp((b.z - z0 + rise) * per_depth, 0.0f, 1.0f);
    const float xa = b.x + from * b.ex, xb = b.x + to * b.ex;
    const float ya = b.y + from * b.ey, yb = b.y + to * b.ey;
    const float x0 = fmin(xa, xb), x1 = fmax(xa, xb), y0 = fmin(ya, yb), y1 = fmax(ya, yb);
    const float dz = fmax(fmax(z0 - b.z, end - z1), 0.0f);
    const float wide = sqrt(fmax(b.reach * b.reach - dz * dz, 0.0f));
    const int j1 = cell_of(y1 + wide, c);
    for (int j = cell_of(y0 - wide, c); j <= j1; j += WIDTH) {  // the bounds of WIDTH rows at once
      const floatv row_y = ((float)j + LANES) * side;
      const floatv dy = larger(larger(row_y - y1, y0 - (row_y + side)), none);
      const floatv half_row = sqrt(larger(wide * wide - dy * dy, none));
      int first[WIDTH], last[WIDTH];
      STOREI(cells_of(x0 - half_row, c), first);
      STOREI(cells_of(x1 + half_row, c), last);
      for (int row_at = 0; row_at < WIDTH && j + row_at <= j1; ++row_at)
        for (int i = first[row_at]; i <= last[row_at]; i += ROW_CELLS) {
          const int row_cells = min(last[row_at] - i + 1, ROW_CELLS);
          const int tag = (int)tag_of(i, j + row_at, k);
          Row row = row_of(i, j + row_at, k, row_cells, cells.mask);
          while (next_range(&row, cells.start, cells.mask))
            for (int p = row.begin; p < row.end; p += SEARCHED) {
              const ints take = taken_from(cells, b, p, row.end, tag, row_cells);
#if WIDTH == 1
              count = append(take.x, p, item, count);
              count = append(take.y, p + 1, item, count);
              count = append(take.z, p + 2, item, count);
              count = append(take.w, p + 3, item, count);
#else
              if (!ANY(take)) continue;
              count = append(take, p, item, count);
#endif
              if (count > MOST_NEAR) return -1;
            }
        }
    }
  }
  return count;
}

// Particles that are looked at before any of them is listed: as SEARCHED.
#if WIDTH == 1
#define AT_ONCE 4
#else
#define AT_ONCE 1
#endif

// Lists the particles within the support of a wanted ray between two lengths of it. The first call
// searches for all rays of `around`, as deep as they will ask or, where that finds too many, DEEPEST;
// where what is found does not serve, a search of its own follows. One place calls for all searches:
// some devices copy a function to wherever it is called.
inline void list_near(const Cells cells, Around* around, const Lines* line, const intv wanted,
                      const floatv from, const floatv to, Near* near) {
  const floatv nowhere = (floatv)(INFINITY);
  const float low = least_lane(SELECT(nowhere, line->deep * from, wanted)),
              high = -least_lane(SELECT(nowhere, -line->deep * to, wanted));
  int shared = around->count == -2, own = 0;
  if (shared) {
    around->low = least_lane(around->from);
    around->high = -least_lane(-around->to);
  }
  // Lengths taken there and back may lie a rounding beyond the depths that were asked for.
  const float room = 0.005f;
  while (shared || around->count < 0 || low < around->low - room || high > around->high + room) {
    Beam b;
    if (shared)
      b = beam_of(around->rays, around->wanted, around->vectors, around->low, around->high);
    else
      b = beam_of(&line->r, &wanted, 1, low, high);
    const int count = search_cells(cells, b, shared ? around->item : near->item);
    if (!shared) {
      near->count = count;
      own = 1;
      break;
    }
    around->count = count;
    shared = count < 0 && around->high > around->low + DEEPEST;
    if (shared) around->high = around->low + DEEPEST;
  }
  const int* item = own ? near->item : around->item;
  const int found = own ? near->count : around->count;
  const floatv middle = 0.5f * (from + to), extent = SELECT(-nowhere, 0.5f * (to - from), wanted);
  // A search goes through layers of cells, the deepest first: those at the ends may be out of reach.
  const float reach = DENSITY_SUPPORT + 0.01f;  // with room for rounding
  int begin = 0, end = found;
  while (begin < end && -cells.z[item[begin]] > high + reach) ++begin;
  while (begin < end && -cells.z[item[end - 1]] < low - reach) --end;
  int count = 0;
  for (int k = begin; k < end; k += AT_ONCE) {
    int p[AT_ONCE], reaches[AT_ONCE];
    Parabola parabola[AT_ONCE];
#pragma unroll
    for (int m = 0; m < AT_ONCE; ++m) {
      p[m] = item[min(k + m, end - 1)];
      parabola[m] = parabola_of(line, cells.x[p[m]], cells.y[p[m]], cells.z[p[m]]);
      const floatv beyond = larger(fabs(middle + parabola[m].at) - extent, (floatv)(0.0f));
      reaches[m] = ANY(fma(-beyond, beyond, parabola[m].most) > -0.016f) && k + m < end;
    }
#pragma unroll
    for (int m = 0; m < AT_ONCE; ++m) {
      near->item[count] = p[m];
      near->parabola[count] = parabola[m];
      count += reaches[m] ? 1 : 0;
    }
  }
  near->count = found < 0 ? -1 : count;
}

// The field at points between these lengths.
inline Field field_near(const Cells cells, global const float* weight, const Near* near,
                        const Lines* line, const floatv l, const int with_gradient) {
  if (near->count < 0) return field_at(cells, weight, line, l, with_gradient);
  const floatv none = (floatv)(0.0f);
  const Stops s = stops_at(line, l);
  Field field = {none, none, none, none};
  for (int k = 0; k < near->count; ++k)
    add_on_lines(&field, s, near->parabola[k], cells, weight, near->item[k], with_gradient);
  return field;
}

// How far a blend of fits counts beside the field, 1 .. 0, where its surface lies `apart` (particle
// radii) from the field's and `alike` is the cosine of both normals. Where they differ the field is
// right: on violent scenes, samples over half a radius apart err by .2 to .5 s in the blend and by .2
// to .3 s in the field, those over two radii apart by .8 to 1.4 s and .1 to .5 s
// (docs/method_decisions.md). The field of irregular particles has pits and bumps of its own: at a
// disorder of 1 it may be twice as far away, and turned by up to a right angle.
inline floatv agreement_of(const floatv apart, const floatv alike, const float disorder) {
  return (1.0f - smooth_step(0.5f + 0.5f * disorder, 1.0f + 1.0f * disorder, apart)) *
         smooth_step(0.6f - 0.6f * disorder, 0.92f - 0.32f * disorder, alike);
}

// How far a blend of fits with such a trust is compared with the field. A mark of .01 (trust.hpp)
// asks for all of it; less than that for little, so that no step shows where a mark begins.
inline floatv compared_at(const floatv trust) {
  const floatv mark = clamp(100.0f * (1.0f - trust), 0.0f, 1.0f);
  return mark * mark;
}
