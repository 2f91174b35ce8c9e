// implicit.cl: the fluid's implicit function F at points in space, < 0 inside, about the distance
// from the surface in particle radii near it, and its gradient (paper 2.4.2, without a camera).
//
// As blend.cl and settle.cl do along rays: fits average within a sheet, sheets meet in a crease, and
// where fits are not trusted the levelled density field counts. Where blend.cl has two sheets there
// are three here: at a corner of a box no camera chooses two of its faces (docs/mesh.md).
//
// Fits lie in cells by their feet, records in the order of the cells.
//
// uses: field.cl hits.cl

// Fits that are listed before they are evaluated; where more are near, each pass looks for them again.
#define LISTED 256
// The values of so many listed fits are kept from pass to pass. Processors have room for that.
#define KEPT (WIDTH > 1 ? 48 : 1)
// Between these densities fits give way to the field, which knows that the fluid is all around: a
// concave corner has 7/8.
#define FILLING 0.9f
#define FILLED 0.97f
#define FARTHEST 4.0f  // particle radii, either way: a fit's value farther off means nothing
// Between these levels per particle radius the levelled field is taken for a distance. A face has
// .56, a lone particle .7.
#define FLATTEST 0.35f
#define STEEPEST 1.3f
// From the first share of the weights on another sheet is a sheet, from the second in full. (Rays,
// which see one side, take .003 to .02 in blend.cl.)
#define SOME 0.03f
#define ENOUGH 0.1f
// Sheets whose centres lie within this of each other's planes are between convex and concave.
#define HINGE 0.25f

// A function's value and gradient.
typedef struct {
  floatv f, x, y, z;
} Level;

// Both density fields: C, and the levelled one with a quarter of its gradient.
typedef struct {
  floatv c, l, gx, gy, gz;
} Fields;

// Goes through what cells hold within `reach` of a box, in the order of cells: z, then y, then x.
typedef struct {
  Box box;
  float reach;
  int i0, wide, j0, j1, k0, k1;  // cells
  int j, k, tag, p;              // the row that is next; of the one under way
  Row row;
  int whole;  // how many there are, once all have been listed at a time; else -1
} Search;

inline void rewind(Search* s) {
  s->j = s->j0;
  s->k = s->k0;
  s->p = s->row.end = s->row.left = 0;
}

inline Search search_of(const Cells cells, const Box box, const float reach) {
  const float c = cells.inverse_cell;
  Search s;
  s.box = box;
  s.reach = reach;
  s.i0 = cell_of(box.x0 - reach, c);
  s.wide = cell_of(box.x1 + reach, c) - s.i0 + 1;
  s.j0 = cell_of(box.y0 - reach, c);
  s.j1 = cell_of(box.y1 + reach, c);
  s.k0 = cell_of(box.z0 - reach, c);
  s.k1 = cell_of(box.z1 + reach, c);
  s.whole = -1;
  rewind(&s);
  return s;
}

// Lists the next ones; 0: there are no more. A list that held all is used again.
inline int list_more(Search* s, const Cells cells, int* item) {
  if (s->whole >= 0) {
    const int count = s->k > s->k1 ? 0 : s->whole;
    s->k = s->k1 + 1;
    return count;
  }
  const int first = s->k == s->k0 && s->j == s->j0 && s->row.left == 0 && s->p >= s->row.end;
  int count = 0;
  for (;;) {
    for (; s->p < s->row.end; s->p += WIDTH) {
      if (count >= LISTED) return count;
      count = append(near_box(s->box, cells, s->p, s->reach) &
                         SAME_ROW(LOADI((global const int*)cells.tag + s->p), s->tag) &
                         (LANES < (float)(s->row.end - s->p)),
                     s->p, item, count);
    }
    if (next_range(&s->row, cells.start, cells.mask)) {
      s->p = s->row.begin;
      continue;
    }
    if (s->k > s->k1) break;
    s->tag = (int)tag_of(s->i0, s->j, s->k);
    s->row = row_of(s->i0, s->j, s->k, s->wide, cells.mask);
    if (++s->j > s->j1) {
      s->j = s->j0;
      ++s->k;
    }
  }
  if (first) s->whole = count;
  return count;
}

// Adds the listed particles. Without the gradient what it has means nothing.
inline void add_fields(const Cells cells, global const float* weight, const int* item,
                       const int count, const floatv x, const floatv y, const floatv z,
                       const int with_gradient, Fields* result) {
  Fields sum = *result;
  for (int k = 0; k < count; ++k) {
    const int p = item[k];
    const float w = weight[p];
    const floatv dx = x - cells.x[p], dy = y - cells.y[p], dz = z - cells.z[p];
    const floatv within = (floatv)(DENSITY_SUPPORT * DENSITY_SUPPORT);
    const floatv v = larger(fma(-dx, dx, fma(-dy, dy, fma(-dz, dz, within))), (floatv)(0.0f));
    const floatv vv = v * v;
    const floatv share =
        fma(fma(fma((floatv)(W3), v, (floatv)(W2)), v, (floatv)(W1)), v, (floatv)(W0));
    const floatv c = share * (vv * v);
    sum.c += c;
    sum.l = fma((floatv)(w), c, sum.l);
    if (!with_gradient) continue;
    const floatv cubic = fma((floatv)(-3.0f * W3), v, (floatv)(-2.5f * W2));
    const floatv g = fma(fma(cubic, v, (floatv)(-2.0f * W1)), v, (floatv)(-1.5f * W0)) * (vv * w);
    sum.gx = fma(g, dx, sum.gx);
    sum.gy = fma(g, dy, sum.gy);
    sum.gz = fma(g, dz, sum.gz);
  }
  *result = sum;
}

// The value of a fit at points: how far outside they are, its unit gradient, and its weight there, 0
// beyond its reach.
typedef struct {
  floatv weight, steep, f, gx, gy, gz, x, y, z;  // x, y, z: from its foot
} FitValue;

inline FitValue evaluate_fit(global const float* g, const float fx, const float fy, const float fz,
                             const floatv x, const floatv y, const floatv z) {
  FitValue n;
  n.x = x - fx;
  n.y = y - fy;
  n.z = z - fz;
  const floatv near = larger(1.0f - square_of(n.x, n.y, n.z) * g[FIT_NARROWNESS], (floatv)(0.0f));
  n.steep = near * near * g[FIT_WEIGHT];
  n.weight = n.steep * near;
  floatv gx, gy, gz;
  gradient_at(g, n.x, n.y, n.z, &gx, &gy, &gz);
  const floatv slope = 1.0f / sqrt(larger(square_of(gx, gy, gz), (floatv)(1e-20f)));
  const floatv f = clamp(value_at(g, n.x, n.y, n.z, gx, gy, gz) * slope, -FARTHEST, FARTHEST);
  // Where a quadric has turned round it comes back to the surface from within: this is inside.
  const intv turned = dot_of(gx, gy, gz, (floatv)(g[1]), (floatv)(g[2]), (floatv)(g[3])) < 0.0f;
  n.f = SELECT(f, -fabs(f), turned);
  n.gx = SELECT(gx, -gx, turned) * slope;
  n.gy = SELECT(gy, -gy, turned) * slope;
  n.gz = SELECT(gz, -gz, turned) * slope;
  return n;
}

// What of a weight's own gradient goes into the gradient of F: less than in views (pull_of), because
// nothing evens it out afterwards.
inline float solid_pull_of(global const float* fit) {
  return 6.0f * fit[FIT_NARROWNESS] * (fit[FIT_ROUND] - 0.5f);
}

inline void add_near(Sums* s, const FitValue* n, const float pull, const float fx, const float fy,
                     const float fz, const floatv share) {
  add_to_sheet(s, share * n->weight, n->f, fx, fy, fz, n->gx, n->gy, n->gz, share * (pull * n->steep),
               n->x, n->y, n->z);
}

typedef struct {
  floatv x, y, z;
} Vector;

inline Vector unit_of(const floatv x, const floatv y, const floatv z) {
  const floatv size = 1.0f / sqrt(larger(square_of(x, y, z), (floatv)(1e-30f)));
  const Vector v = {x * size, y * size, z * size};
  return v;
}

// A sheet: its level, the middle of its feet, and its mean direction.
typedef struct {
  Level level;
  Vector centre, normal;
} Sheet;

inline Sheet sheet_of(const Sums* s) {
  const floatv v = 1.0f / larger(s->w, (floatv)(1e-30f)), f = s->value * v;
  const Vector n = unit_of(s->nx + (s->ux - f * s->vx), s->ny + (s->uy - f * s->vy),
                           s->nz + (s->uz - f * s->vz));
  const Sheet sheet = {{f, n.x, n.y, n.z},
                       {s->cx * v, s->cy * v, s->cz * v},
                       unit_of(s->nx, s->ny, s->nz)};
  return sheet;
}

// How far the mean of each sheet's centre lies over the other's plane: below 0 where they meet in a
// convex edge.
inline floatv height_of(const Sheet* a, const Sheet* b) {
  return dot_of(b->centre.x - a->centre.x, b->centre.y - a->centre.y, b->centre.z - a->centre.z,
                a->normal.x - b->normal.x, a->normal.y - b->normal.y, a->normal.z - b->normal.z);
}

inline Level mix_of(const Level a, const Level b, const floatv share) {
  const floatv rest = 1.0f - share;
  const Level level = {a.f * rest + b.f * share, a.x * rest + b.x * share,
                       a.y * rest + b.y * share, a.z * rest + b.z * share};
  return level;
}

// The outer one of two levels at a convex edge (0), the inner one at a concave edge (1).
inline Level meeting_of(const Level a, const Level b, const floatv concave) {
  const intv outer = a.f > b.f;
  return mix_of(b, a, SELECT(concave, 1.0f - concave, outer));
}

inline Level select_level(const Level no, const Level yes, const intv test) {
  const Level level = {SELECT(no.f, yes.f, test), SELECT(no.x, yes.x, test),
                       SELECT(no.y, yes.y, test), SELECT(no.z, yes.z, test)};
  return level;
}

typedef struct {
  Cells cells;  // of the feet
  global const float* record;
  float reach;  // of a fit's weight, at most
} FitCells;

// The value of all fits near points together.
typedef struct {
  Level level;
  floatv trust;  // 0 .. 1
  floatv edge;   // how far they are at a convex edge, where the density is low, 0 .. 1
} Fitted;

// Where gradients agree with (x, y, z).
inline floatv same_sheet(const FitValue* n, const Vector v, const float2 sheets) {
  return smooth_step(sheets.x, sheets.y, dot_of(n->gx, n->gy, n->gz, v.x, v.y, v.z));
}

// The level where sheet a meets b and c, which count as far as they weigh, over all; how far a and b
// meet in a convex edge.
INLINED void meet_sheets(const Sheet* a, const Sums* sum_b, const Sums* sum_c, const floatv per_all,
                         Level* level, floatv* edge) {
  const Sheet b = sheet_of(sum_b), c = sheet_of(sum_c);
  const floatv share_b = smooth_step(SOME, ENOUGH, sum_b->w * per_all),
               share_c = smooth_step(SOME, ENOUGH, sum_c->w * per_all);
  const floatv ab = smooth_step(-HINGE, HINGE, height_of(a, &b)),
               ac = smooth_step(-HINGE, HINGE, height_of(a, &c)),
               bc = smooth_step(-HINGE, HINGE, height_of(&b, &c));
  const Level pair = meeting_of(a->level, b.level, ab);
  // Of three edges two are of one kind: the pair of the third meets first, then the other.
  const intv is_ab = ab > 0.5f, is_ac = ac > 0.5f, is_bc = bc > 0.5f;
  const intv odd_ac = (is_ab == is_bc) & (is_ab != is_ac);
  const intv odd_bc = (is_ab == is_ac) & (is_ab != is_bc);
  Level three = meeting_of(pair, c.level, ac);
  three = select_level(three, meeting_of(meeting_of(a->level, c.level, ac), b.level, ab), odd_ac);
  three = select_level(three, meeting_of(a->level, meeting_of(b.level, c.level, bc), ab), odd_bc);
  *level = mix_of(mix_of(a->level, pair, share_b), three, share_c);
  *edge = share_b * (1.0f - ab);
}

// The fits near points, to be gone through several times. The values of the first ones are kept.
typedef struct {
  FitCells of;
  Search search;
  floatv x, y, z;  // the points
  float2 sheets;   // cosines between which gradients become those of one sheet
  int item[LISTED + 2 * WIDTH];
  FitValue kept[KEPT];
} NearFits;

#define FOOT(near, p) (near)->of.cells.x[p], (near)->of.cells.y[p], (near)->of.cells.z[p]

// Lists the next fits, or the first ones after rewind().
inline int list_fits(NearFits* near) { return list_more(&near->search, near->of.cells, near->item); }

// The value of the k-th listed fit: as it was kept, where all were listed at a time.
inline FitValue listed_fit(const NearFits* near, const int k) {
  const int p = near->item[k];
  if (near->search.whole >= 0 && k < KEPT) return near->kept[k];
  return evaluate_fit(near->of.record + FIT * p, FOOT(near, p), near->x, near->y, near->z);
}

inline void take_heavier(const FitValue* n, const floatv weight, floatv* most, Vector* gradient) {
  const intv heavier = weight > *most;
  *most = SELECT(*most, weight, heavier);
  gradient->x = SELECT(gradient->x, n->gx, heavier);
  gradient->y = SELECT(gradient->y, n->gy, heavier);
  gradient->z = SELECT(gradient->z, n->gz, heavier);
}

// Evaluates all fits. Returns the greatest weight; out: the gradient of its fit, and the sums of weights,
// of weights over trust, and of firm fits' weights.
INLINED floatv weigh_fits(NearFits* near, Vector* gradient, floatv* all, floatv* doubt, floatv* firm) {
  const floatv none = (floatv)(0.0f);
  floatv most = none;
  *all = *doubt = *firm = gradient->x = gradient->y = gradient->z = none;
  for (int count; (count = list_fits(near)) > 0;)
    for (int k = 0; k < count; ++k) {
      const int p = near->item[k];
      global const float* g = near->of.record + FIT * p;
      const FitValue n = evaluate_fit(g, FOOT(near, p), near->x, near->y, near->z);
      if (k < KEPT) near->kept[k] = n;
      take_heavier(&n, n.weight, &most, gradient);
      *all += n.weight;
      *doubt = fma(n.weight, (floatv)(g[FIT_DOUBT]), *doubt);
      *firm = fma(n.weight, (floatv)(g[FIT_FIRMNESS]), *firm);
    }
  return most;
}

// A round of mean shift: `to` becomes the mean gradient of the fits that agree with it; of those that
// do not agree with `first`, where it is not null.
INLINED void shift_sheet(NearFits* near, const Vector* first, Vector* to) {
  floatv nx = (floatv)(0.0f), ny = nx, nz = nx;
  rewind(&near->search);
  for (int count; (count = list_fits(near)) > 0;)
    for (int k = 0; k < count; ++k) {
      const FitValue n = listed_fit(near, k);
      floatv w = n.weight;
      if (first) w *= 1.0f - same_sheet(&n, *first, near->sheets);
      w *= same_sheet(&n, *to, near->sheets);
      nx = fma(w, n.gx, nx);
      ny = fma(w, n.gy, ny);
      nz = fma(w, n.gz, nz);
    }
  *to = unit_of(nx, ny, nz);
}

// Sums up sheet a. Returns the weight of the rest; out: the gradient of its heaviest fit.
INLINED floatv sum_sheet(NearFits* near, const Vector a, Sums* sum, Vector* next) {
  floatv rest = (floatv)(0.0f), most = rest;
  clear_sums(sum);
  next->x = next->y = next->z = rest;
  rewind(&near->search);
  for (int count; (count = list_fits(near)) > 0;)
    for (int k = 0; k < count; ++k) {
      const int p = near->item[k];
      const FitValue n = listed_fit(near, k);
      const floatv share = same_sheet(&n, a, near->sheets), others = n.weight * (1.0f - share);
      add_near(sum, &n, solid_pull_of(near->of.record + FIT * p), FOOT(near, p), share);
      rest += others;
      take_heavier(&n, others, &most, next);
    }
  return rest;
}

// Sums up what is not of sheet a: sheet b, and c, which is all others.
INLINED void sum_other_sheets(NearFits* near, const Vector a, const Vector b, Sums* sum_b, Sums* sum_c) {
  clear_sums(sum_b);
  clear_sums(sum_c);
  rewind(&near->search);
  for (int count; (count = list_fits(near)) > 0;)
    for (int k = 0; k < count; ++k) {
      const int p = near->item[k];
      const float pull = solid_pull_of(near->of.record + FIT * p);
      const FitValue n = listed_fit(near, k);
      const floatv rest = 1.0f - same_sheet(&n, a, near->sheets),
                   share = same_sheet(&n, b, near->sheets);
      add_near(sum_b, &n, pull, FOOT(near, p), rest * share);
      add_near(sum_c, &n, pull, FOOT(near, p), rest * (1.0f - share));
    }
}

// The value of all fits together, at points where `wanted` (paper 2.4.2, Eq. 6; docs/mesh.md). The sheet that
// dominates is found by two rounds of mean shift from the gradient of the heaviest fit. What does not
// agree with it is the second sheet, found likewise, and the third. They meet in creases: meet_sheets.
inline void evaluate_fits(const FitCells of, const floatv x, const floatv y, const floatv z,
                          const intv wanted, const float2 sheets, Fitted* result) {
  const floatv none = (floatv)(0.0f), one = (floatv)(1.0f), least = (floatv)(1e-30f);
  NearFits near;
  near.of = of;
  near.x = x;
  near.y = y;
  near.z = z;
  near.sheets = sheets;
  near.search = search_of(of.cells, box_of(x, y, z, wanted), of.reach);
  floatv all, doubt, firm;
  Vector a, b;
  result->level.f = result->level.x = result->level.y = result->level.z = none;
  result->trust = result->edge = none;
  const floatv most = weigh_fits(&near, &a, &all, &doubt, &firm);
  if (!ANY(wanted & (most > 0.0f))) return;

  for (int round = 0; round < 2; ++round) shift_sheet(&near, 0, &a);
  Sums sum_a, sum_b, sum_c;
  const floatv rest = sum_sheet(&near, a, &sum_a, &b);
  const Sheet sheet_a = sheet_of(&sum_a);
  result->level = sheet_a.level;
  const floatv per_all = 1.0f / larger(all, least);
  if (ANY(wanted & (rest * per_all > SOME))) {
    shift_sheet(&near, &a, &b);
    sum_other_sheets(&near, a, b, &sum_b, &sum_c);
    meet_sheets(&sheet_a, &sum_b, &sum_c, per_all, &result->level, &result->edge);
  }
  result->trust = smaller(1.001f * all / larger(doubt, least), one) * smooth_step(ALONE, COMPANY, firm);
}

// F and its gradient at points that lie in cells beside each other, where wanted.
inline void implicit_at(const Cells cells, global const float* weight, const FitCells fits,
                        const floatv x, const floatv y, const floatv z, const intv wanted,
                        const Implicit of, Level* result) {
  const floatv none = (floatv)(0.0f);
  const float2 limits = (float2)(of.contour, of.level), sheets = (float2)(of.same_low, of.same_high);
  int item[LISTED + 2 * WIDTH], count;
  Search search = search_of(cells, box_of(x, y, z, wanted), DENSITY_SUPPORT);
  Fields sum = {none, none, none, none, none};
  const int alone = fits.reach < 0.0f;  // as ImplicitFunction::alone
  while ((count = list_more(&search, cells, item)) > 0)
    add_fields(cells, weight, item, count, x, y, z, !alone, &sum);
  const floatv c = sum.c * (NORM * of.mass), l = sum.l * (NORM / limits.y);
  if (alone) {
    const Level level = {1.0f - l, none, none, none};
    *result = level;
    return;
  }
  const float steep = -4.0f * NORM / limits.y;
  const floatv gx = sum.gx * steep, gy = sum.gy * steep, gz = sum.gz * steep;
  const floatv size = sqrt(square_of(gx, gy, gz));
  const floatv slope = smaller(larger(size, (floatv)(FLATTEST)), (floatv)(STEEPEST));
  const Vector n = unit_of(gx, gy, gz);
  Level level = {(1.0f - l) / slope, n.x, n.y, n.z};
  const intv open = wanted & (c > 0.3f * limits.x) & (c < FILLED);
  if (fits.reach > 0.0f && ANY(open)) {
    Fitted fitted;
    evaluate_fits(fits, x, y, z, open, sheets, &fitted);
    // Where the density falls, fits hand over to the field, slowly: else a gap beside an edge, or
    // the tip of a drop, has a step where both differ.
    const floatv contour = limits.x * (1.0f - 0.7f * fitted.edge);
    floatv share = fitted.trust * clamp(4.0f * (c - contour + 0.1f * fitted.trust), 0.0f, 1.0f);
    // Where fits follow their particles badly, their value is compared with the field.
    const floatv apart = fabs(fitted.level.f - level.f);
    const floatv alike =
        dot_of(fitted.level.x, fitted.level.y, fitted.level.z, level.x, level.y, level.z);
    const floatv agreement = agreement_of(apart, alike, of.disorder);
    const floatv compared = compared_at(fitted.trust) * (1.0f - fitted.edge);
    share *= (1.0f - compared * (1.0f - agreement)) * (1.0f - smooth_step(FILLING, FILLED, c));
    level = mix_of(level, fitted.level, SELECT(none, share, open));
  }
  *result = level;
}

// One work-item per WIDTH points.
kernel void measure_implicit(
    POINTS(x, y, z),              // [n] particle radii
    global float* result,         // [4][stride]: F, particle radii; its unit gradient
    global const float* records,  // [fits][FIT] in the order of their cells
    CELLS(foot_), CELLS_WITH(cell_, level_weight),
    const Implicit of) {
  const int p = get_global_id(0) * WIDTH, n = of.count, stride = of.stride;
  if (p >= n) return;
  const Cells cells = CELLS_OF(cell_);
  const FitCells fits = {CELLS_OF(foot_), records, of.reach};
  const floatv px = LOADF(x + p), py = LOADF(y + p), pz = LOADF(z + p), none = (floatv)(0.0f);
  Level level = {none, none, none, none};
  Points points = points_at(cells, px, py, pz);
  points.left = TO_INTV(LANES) < n - p;  // what lies beyond is in no order
  while (ANY(points.left)) {
    const intv here = take_cells(&points, 1);
    Level at;
    implicit_at(cells, level_weight, fits, px, py, pz, here, of, &at);
    level = select_level(level, at, here);
  }
  const Vector v = unit_of(level.x, level.y, level.z);
  STOREF(plain_zero(level.f), result + p);
  STOREF(plain_zero(v.x), result + stride + p);
  STOREF(plain_zero(v.y), result + 2 * stride + p);
  STOREF(plain_zero(v.z), result + 3 * stride + p);
}
