// settle.cl: what each sample of a layer shows, the blend or the density field's level (paper 2.4.1
// and, for the splash, the end of 3: particles too few for a fit are rendered directly).
// A work-item takes TAKES samples of a tile's list (samples.cl) at a time.
//
// uses: field.cl samples.cl

// Rays are followed in windows of this depth, so that one search serves several steps.
#define WINDOW 8.0f  // particle radii

#define TAKES (VECTORS * WIDTH)

#define REFINE 8                 // positions of a crossing within a step, at most
#define NEWTON (1.0f / 2048.0f)  // particle radii: a shorter step of Newton's need not be taken

typedef struct {
  floatv depth;       // +infinity: nowhere, or already reached at the start
  floatv nx, ny, nz;  // unit outward normal, eye axes
  floatv most;        // the largest value found on the way, up to the level
} Crossing;

// VECTORS times WIDTH lanes from place `begin` on, whose rays share a search. Returns how many
// vectors are in use.
inline int load_work(const int tile, const int begin, global const int* sample,
                     global const int* count, const Screen screen, Lanes* lanes,
                     Around* around) {
  int v = 0;
  for (; v < VECTORS; ++v) {
    const int place = begin + v * WIDTH;
    if (!load_lanes(tile, place, sample, count, screen, lanes + v)) break;
    around->rays[v] = lanes[v].rays;
    around->wanted[v] = lanes[v].used;
  }
  around->vectors = v;
  around->from = (floatv)(INFINITY);
  around->to = (floatv)(0.0f);
  around->count = -2;
  return v;
}

// What is near lanes between these depths will be needed, where wanted.
inline void need_between(const floatv from, const floatv to, const intv wanted, Around* around) {
  around->from = SELECT(around->from, smaller(around->from, from), wanted);
  around->to = SELECT(around->to, larger(around->to, to), wanted);
}

// Depths of rays at which the density is measured, and what it is.
typedef struct {
  global const float* weight;
  floatv at;
  intv wanted;
  floatv density;  // 0 where not wanted
} Probes;

// Finds the crossings between `low` and `high`, where the field lies short_of < 0 and `over` above the
// level: by false position first, then by the cubic through both ends' values and the last value and
// slope, mostly once. It comes within 1/1024 particle radii.
INLINED void refine_crossing(const Cells cells, global const float* weight, const Near* near,
                             const Lines* line, const Rays r, const float level, intv found, floatv low,
                             floatv short_of, floatv high, floatv over, Crossing* crossing) {
  floatv middle = low + (high - low) * (short_of / (short_of - over));
  for (int round = 1;; ++round) {
    const Field f = field_near(cells, weight, near, line, middle, 1);
    const floatv gx = gradient_of(f.gx), gy = gradient_of(f.gy), gz = gradient_of(f.gz);
    const floatv there = f.c * NORM - level, slope = line->deep * (gx * r.dx + gy * r.dy - gz);
    const intv ready = slope * NEWTON >= fabs(there);
    const intv last = found & (ready | (intv)(round == REFINE ? -1 : 0));
    const floatv size = sqrt(gx * gx + gy * gy + gz * gz);
    const intv crossed = last & (size > 0.0f);
    crossing->depth = SELECT(crossing->depth, line->deep * middle, crossed);
    crossing->nx = SELECT(crossing->nx, -gx / size, crossed);
    crossing->ny = SELECT(crossing->ny, -gy / size, crossed);
    crossing->nz = SELECT(crossing->nz, -gz / size, crossed);
    found &= !last;
    if (!ANY(found)) return;
    const floatv a = low - middle, b = high - middle;
    const floatv bend_a = (short_of - there - slope * a) / (a * a);
    const floatv bend_b = (over - there - slope * b) / (b * b);
    const floatv cube = (bend_b - bend_a) / (b - a), square = bend_a - cube * a;
    floatv away = -there / slope;
    for (int k = 0; k < 2; ++k)
      away -= (there + away * (slope + away * (square + away * cube))) /
              (slope + away * (2.0f * square + 3.0f * cube * away));
    const intv less = found & (there < 0.0f), more = found & !(there < 0.0f);
    low = SELECT(low, middle, less);
    short_of = SELECT(short_of, there, less);
    high = SELECT(high, middle, more);
    over = SELECT(over, there, more);
    const floatv guess = middle + away;
    middle = SELECT(0.5f * (low + high), guess, (guess > low) & (guess < high));
  }
}

// Where the levelled field first reaches `level` on rays between depths `from` and `to`. A window's
// particles serve `probes`, too.
inline Crossing first_crossing(const Cells cells, global const float* weight, const Rays r,
                               const floatv from, const floatv to, const float level,
                               const intv wanted, Around* around, Probes* probes) {
  const floatv none = (floatv)(0.0f), nowhere = (floatv)(INFINITY);
  Crossing crossing = {nowhere, none, none, none, none};
  const Lines line = lines_of(r);
  Near near;
  const floatv at = line.length * probes->at, end = line.length * to;
  const float per_sum = -1.5f * NORM / level;
  floatv l = line.length * from, low = l;  // the last point below the level
  floatv short_of = (floatv)(-level);      // how far below
  intv going = wanted & (from <= to), fresh = going, steps = (intv)(0), left = probes->wanted;
  probes->density = none;
  while (ANY(going | left)) {
    const floatv next = SELECT(SELECT(nowhere, at, left), SELECT(l, smaller(l, at), left), going);
    const floatv window = line.length * (least_lane(line.deep * next) + WINDOW);
    const intv probed = left & (at <= window), stepped = going & (l <= window);
    const floatv last = smaller(end, window);
    // A crossing lies up to one step before the point that shows it.
    list_near(cells, around, &line, probed | stepped,
              SELECT(at, SELECT(low, smaller(low, at), probed), stepped),
              SELECT(at, SELECT(last, larger(last, at), probed), stepped), &near);
    if (ANY(probed)) {
      const floatv c = field_near(cells, probes->weight, &near, &line, at, 0).c * NORM;
      probes->density = SELECT(probes->density, c, probed);
      left &= !probed;
    }
    intv here = stepped, found = (intv)(0);
    floatv over = none;
    while (ANY(here)) {
      const floatv sum = field_near(cells, weight, &near, &line, l, 0).c, c = sum * NORM;
      const intv inside = here & (c >= level), below = here & (c < level);
      over = SELECT(over, c - level, inside);
      found |= inside & !fresh;
      fresh &= !here;
      low = SELECT(low, l, below);
      short_of = SELECT(short_of, c - level, below);
      crossing.most = SELECT(crossing.most, larger(crossing.most, smaller(c, (floatv)(level))), here);
      // Twice what the steepest rise on usual frames, 4/3 levels a radius, needs to the level. What
      // a step passes over is shorter than half a radius, at a lone particle than a tenth of one.
      const floatv wish = fma(sum, (floatv)(per_sum), (floatv)(1.5f));
      const floatv step =
          smaller(larger(wish, (floatv)(0.3f)), (floatv)(1.0f));
      l = SELECT(l, l + step, below);
      steps += SELECT((intv)(0), (intv)(1), here);
      going &= !inside & (l <= end) & (steps < 1000);
      here = going & (l <= window);
    }
    if (!ANY(found)) continue;
    refine_crossing(cells, weight, &near, &line, r, level, found, low, short_of, l, over, &crossing);
  }
  return crossing;
}

// The density at depth t of rays, where wanted.
inline floatv density_on(const Cells cells, global const float* weight, const Rays r,
                         const floatv t, const intv wanted, Around* around) {
  const Lines line = lines_of(r);
  const floatv l = line.length * t;
  floatv density = (floatv)(0.0f);
  intv left = wanted;
  Near near;
  while (ANY(left)) {
    const float window = least_lane(SELECT((floatv)(INFINITY), t, left)) + WINDOW;
    const intv here = left & (t <= window);
    list_near(cells, around, &line, here, l, l, &near);
    density = SELECT(density, field_near(cells, weight, &near, &line, l, 0).c * NORM, here);
    left &= !here;
  }
  return density;
}

// Blended samples carry where they lie with their trust (blend.cl): at a convex crease the sheets
// vouch for each other down to a third of the contour's density, beyond an edge nothing shows, nor
// where the ray has passed by the surface.
typedef struct {
  floatv trust;
  intv on_edge, ended, passed;  // ended where passed, too
} Carried;

inline Carried carried_by(const floatv carried) {
  Carried c;
  c.passed = carried > PASSED - 0.5f;
  c.ended = carried > ENDED - 0.5f;
  c.on_edge = !c.ended & (carried > ON_EDGE - 0.5f);
  const floatv added = SELECT((floatv)(0.0f), (floatv)(ON_EDGE), c.on_edge);
  c.trust = carried - SELECT(SELECT(added, (floatv)(ENDED), c.ended), (floatv)(PASSED), c.passed);
  return c;
}

// The density below which the surface has ended.
inline floatv contour_of(const intv on_edge, const FieldLimits limits) {
  return SELECT((floatv)(1.0f), (floatv)(0.3f), on_edge) * limits.contour;
}

// The samples are the field's.
inline void mark_splash(const int* at, const intv wanted, global int* group, global uchar* kind) {
  int want[WIDTH];
  STOREI(wanted, want);
  for (int k = 0; k < WIDTH; ++k) {
    if (!want[k]) continue;
    group[at[k]] = -1;
    kind[at[k]] = 2;
  }
}

// What samples of a layer show before any density is measured.
typedef struct {
  floatv t0, t;    // depths of the reference and of the blend
  floatv contour;  // the density that doubted samples need
  intv gone, passed, doubted, mixed;  // passed: gone because the ray has passed by
} Verdict;

// Where the groups are trusted, the blend stays if it lies on a kept triangle or if the density at
// its point, which is in doubt, reaches the contour's. Where they are not, or no group was met, the
// density field is followed near by: in between the two are mixed by the trust, without it the blend
// goes.
inline Verdict judge(const int* at, const intv listed, global const float* triangle,
                     global const float* reference, global const float* trust,
                     global const float* depth, const FieldLimits limits,
                     const int only_gaps) {
  const floatv none = (floatv)(0.0f);
  Verdict v;
  v.t0 = gather_float(reference, at);
  v.t = gather_float(depth, at);
  const intv met = v.t < INFINITY;
  intv live = listed & (v.t0 < INFINITY);
  if (only_gaps) live &= !met;
  // Maps are read only where they matter: they are large, and a CPU waits for them.
  const intv blended = live & met;
  floatv carried = none;
  if (ANY(blended)) carried = SELECT(none, gather_float(trust, at), blended);
  const Carried c = carried_by(carried);
  v.contour = contour_of(c.on_edge, limits);
  const intv sure = live & (c.ended | (c.trust >= 1.0f));
  intv alone = sure;
  if (ANY(sure)) alone &= !(fabs(v.t - gather_float(triangle, at)) < limits.vouching);
  v.gone = alone & c.ended;
  v.passed = alone & c.passed;
  v.doubted = alone & !c.ended;
  v.mixed = live & !v.gone & (c.trust < 1.0f);
  return v;
}

// Decides what samples show: a trusted surface that has ended lets what lies
// behind it be seen. `behind` receives the depth beyond which a sample that shows nothing may look
// again (its reference), and infinity elsewhere. Where v.mixed, the field is to be followed, which
// needs what `behind` held. Where the ray has passed by, the reference moves behind: the field, which
// may lie a little farther out, would fill the gap with a rim of its own. It is entered before the
// search begins then (search_from).
inline void settle(const Verdict v, const Lanes* lanes, const FieldLimits limits,
                   global float* reference, global float* depth, global float* behind,
                   const Cells cells, global const float* weight, Around* around) {
  const int* at = lanes->at;
  const floatv nowhere = (floatv)(INFINITY);
  intv gone = v.gone;
  if (ANY(v.doubted))
    gone |= v.doubted & (density_on(cells, weight, lanes->rays, v.t, v.doubted, around) < v.contour);
  scatter_float(nowhere, depth, at, gone);
  scatter_float(v.t + 2.0f * limits.before, reference, at, v.passed);
  scatter_float(SELECT(nowhere, v.t0, gone), behind, at, lanes->used & (v.t0 < INFINITY) & !v.mixed);
}

// Between which depths the field is followed: from before the blend's depth t and the reference t0
// to behind them. (A blend far before the reference once ended the search in the air: holes in rims.)
// A sample that looks again, because it has shown nothing at its `last` reference, goes on where the
// search behind that ended: the spheres that tell what lies behind leave gaps between particles, where
// it would see through a thin layer. At the first look `last` is infinity.
inline floatv search_from(const floatv t, const floatv t0, const floatv last,
                          const FieldLimits limits) {
  const floatv from = smaller(smaller(t, t0) - limits.before, last + limits.beyond);
  return larger(from, (floatv)(1e-3f));
}

inline floatv search_to(const floatv t, const floatv t0, const FieldLimits limits) {
  return SELECT(t0, larger(t, t0), t < INFINITY) + limits.beyond;
}

// What n samples show (SHOWN), in and out.
typedef struct {
  global float* depth;
  global float* normal;
  global int* group;
  global uchar* kind;
  int n;
} Shown;

// How far the field may miss its level where the blend stays, of the level, with as much trust as doubt.
#define NEARLY 0.1f

// Where the blend is not fully trusted, the rest is the field's. The blend's share is its trust, or
// nothing outside the fluid: with less trust the contour draws in to where the field has its own.
// And it gives way where it disagrees with the field, as far as it is compared with it, but for convex
// creases, which the field rounds. Where the field does not reach its level, the blend stays as far as
// the field comes near it: less trust asks for more. So outlines run between those of fits and field.
// On convex edges the larger share decides.
inline void follow(const Lanes* lanes, const floatv last, global const float* reference,
                   global const float* trust, const Shown shown, global float* behind,
                   const Cells cells, global const float* weight, global const float* level_weight,
                   const FieldLimits limits, Around* around) {
  const int* at = lanes->at;
  const intv listed = lanes->used;
  const Rays r = lanes->rays;
  const floatv none = (floatv)(0.0f), nowhere = (floatv)(INFINITY);
  const floatv t0 = gather_float(reference, at), t = gather_float(shown.depth, at);
  const intv met = t < INFINITY;
  const Carried carried = carried_by(SELECT(none, gather_float(trust, at), met));
  const floatv from = search_from(t, t0, last, limits), to = search_to(t, t0, limits);
  const intv reaches = listed & (from <= to);
  Probes probes = {weight, t, listed & met, none};
  const Crossing c =
      first_crossing(cells, level_weight, r, from, to, limits.level, reaches, around, &probes);
  const floatv inside =
      probes.density - contour_of(carried.on_edge, limits) - 0.1f * (1.0f - carried.trust);
  floatv share = carried.trust * clamp(20.0f * inside, 0.0f, 1.0f);
  const intv crossed = c.depth < INFINITY, compared = crossed & (share > 0.0f);
  floatv mx = none, my = none, mz = none;
  if (ANY(compared)) {  // maps that a CPU waits for
    mx = gather_float(shown.normal, at);
    my = gather_float(shown.normal + shown.n, at);
    mz = gather_float(shown.normal + 2 * shown.n, at);
    const floatv apart = fabs(c.depth - t) * fabs(mx * r.dx + my * r.dy - mz);
    const floatv alike = mx * c.nx + my * c.ny + mz * c.nz;
    const floatv agreement = agreement_of(apart, alike, limits.disorder);
    const floatv keeps = 1.0f - compared_at(carried.trust) * (1.0f - agreement);
    share = SELECT(share, share * keeps, compared & !carried.on_edge);
  }
  const floatv missing = limits.level - c.most;
  const intv near_it = (1.0f - share) * missing < (NEARLY * limits.level) * share;
  const intv stays = (carried.on_edge & (share > 0.5f)) | (!carried.on_edge & near_it);
  const floatv choice = SELECT(none, (floatv)(1.0f), stays);
  share = SELECT(choice, share, crossed);
  const intv changed = listed & (share < 1.0f), both = share > 0.0f;
  const intv drawn = changed & crossed, gone = changed & !crossed;
  const floatv rest = 1.0f - share;
  floatv nx = SELECT(c.nx, share * mx + rest * c.nx, both);
  floatv ny = SELECT(c.ny, share * my + rest * c.ny, both);
  floatv nz = SELECT(c.nz, share * mz + rest * c.nz, both);
  const floatv size = 1.0f / sqrt(larger(nx * nx + ny * ny + nz * nz, (floatv)(1e-30f)));
  nx *= size;
  ny *= size;
  nz *= size;
  face_eye(r.dx, r.dy, &nx, &ny, &nz);
  store_surface(SELECT(c.depth, share * t + rest * c.depth, both), nx, ny, nz, at, drawn,
                shown.n, shown.depth, shown.normal);
  mark_splash(at, drawn & (share <= 0.5f), shown.group, shown.kind);
  scatter_float(nowhere, shown.depth, at, gone);
  scatter_float(SELECT(nowhere, t0, gone), behind, at, listed);
}

// Leaves the samples where the field is to be followed to follow_field.
kernel void settle_samples(
    SAMPLES(, sample, count),       // of those that are left, out: how many
    global const float* triangle,   // [samples] depth of kept triangles
    global float* reference,        // [samples] reference depth; out where rays have passed by
    TRUSTED(, trust, depth),        // of the blend; the depth in and out
    global float* behind,           // [samples] out, but for those that are left
    global int* selected,           // [tiles][256] out, those that are left
    FIELD(cell_, weight), const Settling how) {
  const Cells cells = CELLS_OF(cell_);
  Lanes lanes[VECTORS];
  Around around;
  const int tile = tile_of_item(), tiles = tiles_of(how.screen);
  if (tile >= tiles) return;
  global int* left = count + tiles + tile;
  int used = 0;
  for (int place = item_of_tile() * TAKES;; place += TILE_ITEMS * TAKES) {
    const int vectors = load_work(tile, place, sample, count, how.screen, lanes, &around);
    if (!vectors) break;
    Verdict verdict[VECTORS];
    for (int v = 0; v < vectors; ++v) {
      verdict[v] = judge(lanes[v].at, lanes[v].used, triangle, reference, trust, depth, how.limits,
                         how.only_gaps);
      around.wanted[v] = verdict[v].doubted;
      need_between(verdict[v].t, verdict[v].t, verdict[v].doubted, &around);
    }
    for (int v = 0; v < vectors; ++v) {
      settle(verdict[v], lanes + v, how.limits, reference, depth, behind, cells, weight, &around);
      used = leave_samples(lanes[v].at, verdict[v].mixed, used, selected + tile * TILE_SAMPLES,
                           left);
    }
  }
#if TILE_ITEMS == 1
  *left = used;
#endif
}

// Of a tile's samples those that settle_samples has left.
kernel void follow_field(SAMPLES(const, selected, count),
                         global const float* reference,
                         SURFACE(, ),  // of the blend; in and out; kind 2 where the field shows
                         global float* behind,  // [samples] in and out
                         FIELD(cell_, weight), global const float* level_weight,
                         const Settling how) {
  const Cells cells = CELLS_OF(cell_);
  const Shown shown = {depth, normal, group, kind, how.screen.nx * how.screen.ny};
  Lanes lanes[VECTORS];
  floatv last[VECTORS];
  Around around;
  const int tile = dealt_tile(), tiles = tiles_of(how.screen);
  if (tile >= tiles) return;
  for (int place = item_of_tile() * TAKES;; place += TILE_ITEMS * TAKES) {
    const int vectors =
        load_work(tile, place, selected, count + tiles, how.screen, lanes, &around);
    if (!vectors) return;
    for (int v = 0; v < vectors; ++v) {
      const floatv t0 = gather_float(reference, lanes[v].at), t = gather_float(depth, lanes[v].at);
      last[v] = gather_float(behind, lanes[v].at);
      need_between(search_from(t, t0, last[v], how.limits), search_to(t, t0, how.limits), lanes[v].used,
              &around);
      need_between(t, t, lanes[v].used & (t < INFINITY), &around);
    }
    for (int v = 0; v < vectors; ++v)
      follow(lanes + v, last[v], reference, trust, shown, behind, cells, weight, level_weight,
             how.limits, &around);
  }
}

// Both at a list of positions. One work-item per point, WIDTH 1.
#if WIDTH == 1
kernel void settle_points(global const float* triangle, global float* reference, SURFACE(, ),
                          global float* behind,
                          global const float* points,  // [2][n] u, v, pixels
                          FIELD(cell_, weight), global const float* level_weight,
                          const Settling how) {
  const int p = get_global_id(0), n = how.screen.nx;
  if (p >= n) return;
  const Cells cells = CELLS_OF(cell_);
  const Shown shown = {depth, normal, group, kind, n};
  const Lanes lane = {{p}, 1, rays_at(how.screen.rays, points[p], points[n + p])};
  Around around;
  around.vectors = 1;
  around.count = -1;  // nothing to share: every point searches for itself
  const Verdict verdict = judge(&p, 1, triangle, reference, trust, depth, how.limits, 0);
  settle(verdict, &lane, how.limits, reference, depth, behind, cells, weight, &around);
  if (verdict.mixed)
    follow(&lane, INFINITY, reference, trust, shown, behind, cells, weight, level_weight, how.limits,
           &around);
}
#endif

// Between which depths there may be splash in front of the surface.
typedef struct {
  floatv start, end;
  intv any;
} Stretch;

inline Stretch splash_on(const Lanes* lanes, global const float* from, global const float* to,
                         global const float* depth) {
  Stretch s;
  s.start = gather_float(from, lanes->at);
  s.end = smaller(gather_float(to, lanes->at), gather_float(depth, lanes->at));
  s.any = lanes->used & (s.start < s.end);
  return s;
}

// The levelled field's first crossing there.
inline void draw_blobs(const Lanes* lanes, const Stretch on, const Shown shown, const Cells cells,
                       global const float* level_weight, const float level, Around* around) {
  Probes none = {level_weight, on.start, (intv)(0), (floatv)(0.0f)};
  const Crossing c = first_crossing(cells, level_weight, lanes->rays, on.start, on.end, level,
                                    on.any, around, &none);
  const intv drawn = lanes->used & (c.depth < on.end);
  store_surface(c.depth, c.nx, c.ny, c.nz, lanes->at, drawn, shown.n, shown.depth, shown.normal);
  mark_splash(lanes->at, drawn, shown.group, shown.kind);
}

// What a tile's samples show at last: where they show nothing and have a reference, the field, as
// follow_field finds it; then the splash in front of that. WIDTH 1: elsewhere few lanes would be in use.
#if WIDTH == 1
kernel void settle_gaps(SAMPLES(const, sample, count), global const float* reference,
                        SURFACE(, ),  // in and out; kind 2 where field or splash show
                        global float* behind,  // [samples] in and out
                        EXTENT(const, from, to), FIELD(cell_, weight),
                        global const float* level_weight, const Settling how) {
  const Cells cells = CELLS_OF(cell_);
  const Shown shown = {depth, normal, group, kind, how.screen.nx * how.screen.ny};
  Lanes lane;
  Around around;
  for (int place = item_of_tile();; place += TILE_ITEMS) {
    if (!load_work(tile_of_item(), place, sample, count, how.screen, &lane, &around)) return;
    const float t0 = reference[lane.at[0]], t = depth[lane.at[0]], last = behind[lane.at[0]];
    if (t0 < INFINITY && !(t < INFINITY)) {
      need_between(search_from(t, t0, last, how.limits), search_to(t, t0, how.limits), 1, &around);
      follow(&lane, last, reference, trust, shown, behind, cells, weight, level_weight, how.limits,
             &around);
    }
    const Stretch on = splash_on(&lane, from, to, depth);
    if (!on.any) continue;
    load_work(tile_of_item(), place, sample, count, how.screen, &lane, &around);  // a new search
    need_between(on.start, on.end, 1, &around);
    draw_blobs(&lane, on, shown, cells, level_weight, how.limits.level, &around);
  }
}
#endif

// The splash: the levelled field's first crossing between the splash particles' fronts and backs,
// where it lies in front of the surface.
kernel void draw_splash(SAMPLES(const, sample, count), EXTENT(const, from, to),
                        SHOWN(, ),  // in and out; group -1 and kind 2 where splash was drawn
                        CELLS_WITH(cell_, level_weight), const Screen screen,
                        const float level,         // of the field
                        global const float* open,  // [samples], read unless over_gaps
                        const int over_gaps) {     // 0: samples that are open stay (WIDTH 1; others
                                                   // are not listed)
  const Cells cells = CELLS_OF(cell_);
  const Shown shown = {depth, normal, group, kind, screen.nx * screen.ny};
  Lanes lanes[VECTORS];
  Around around;
  const int tile = dealt_tile();
  if (tile >= tiles_of(screen)) return;
  for (int place = item_of_tile() * TAKES;; place += TILE_ITEMS * TAKES) {
    const int vectors = load_work(tile, place, sample, count, screen, lanes, &around);
    if (!vectors) return;
#if WIDTH == 1
    if (!over_gaps)
      for (int v = 0; v < vectors; ++v) lanes[v].used &= !(open[lanes[v].at[0]] < INFINITY);
#endif
    for (int v = 0; v < vectors; ++v) {
      const Stretch on = splash_on(lanes + v, from, to, depth);
      need_between(on.start, on.end, on.any, &around);
    }
    for (int v = 0; v < vectors; ++v)
      draw_blobs(lanes + v, splash_on(lanes + v, from, to, depth), shown, cells, level_weight, level,
                 &around);
  }
}
