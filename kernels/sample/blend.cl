// blend.cl: every sample's ray meets the fits near it; their intersections are blended within a
// sheet and meet in a crease between sheets (paper 2.4.2, Eqs. 6 and 7).
//
// Departs from the paper: the distance in Eq. 7 is taken in space and the weight ends at a fit's
// reach; the factor 1/b^2 is left out (it lowers the weight of similar groups); and b's growth with
// similarity is taken to its limit: similar fits form a sheet that is averaged, two sheets meet in
// the curve where they intersect. Sheets that turn away from the eye end the surface in the same way,
// and so does the mean of those that a ray grazes (docs/method.md; hidden.cl).
//
// uses: samples.cl hidden.cl

#define CACHED 48  // hits kept between the passes over a tile's list; later ones are found again

// What the passes over a tile's hits after the first go through: those of the cache, then those that are
// found again.
typedef struct {
  Hit hit[CACHED];
  int fit[CACHED];
  int count;  // in the cache
  int rest;   // first listed fit that did not fit into it
} Cache;

// Hit k and its fit. Returns whether there is one.
inline int hit_again(const Cache* cache, const int k, const List met, const Fits fits, const Sample s,
                     const float d_max, int* fit, Hit* hit) {
  if (k < cache->count) {
    *fit = cache->fit[k];
    *hit = cache->hit[k];
    return 1;
  }
  *fit = met.fit[cache->rest + k - cache->count];
  return hit_fit(fits, *fit, s, d_max, hit);
}

// All that rays meet, but the hits themselves (Cache).
typedef struct {
  Sums sum;     // as if all hits were of one sheet
  floatv best;  // the heaviest hit's weight,
  Axis axis;    // gradient,
  intv group;   // and fit
  floatv trust, firm, height;
} Met;

INLINED void add_met(const Fits fits, const int fit, const Sample s, const Entry* entry, Hit* hit,
                     Met* met) {
  // Fits that a ray grazes are company, too.
  met->firm = fma(hit->weight, (floatv)(fits.record[FIT * fit + 14]), met->firm);
  fade_hit(*entry, hit);
  const intv better = hit->weight > met->best;
  met->best = SELECT(met->best, hit->weight, better);
  met->group = SELECT(met->group, (intv)(fit), better);
  take_gradient(&met->axis, hit, better);
  met->trust = fma(hit->weight, (floatv)(fits.record[FIT * fit + 12]), met->trust);
  met->height = fma(hit->weight, entry->height, met->height);
  add_hit(&met->sum, fits.foot + 4 * fit, s, *hit, (floatv)(1.0f));
}

INLINED void meet_all(const List list, const Fits fits, const Sample s, const float d_max,
                      const Beam beam, Cache* cache, Met* met) {
  const floatv none = (floatv)(0.0f);
  const Axis nowhere = {none, none, none};
  cache->count = 0;
  cache->rest = list.count;
  clear_sums(&met->sum);
  met->best = met->trust = met->firm = met->height = none;
  met->axis = nowhere;
  met->group = (intv)(-1);
  int place[BLOCK + WIDTH];
  for (int from = 0; from < list.count; from += BLOCK) {
    const int to = min(from + BLOCK, list.count);
    Entry entry[BLOCK];
    int found = 0, count = 0;
    for (int k = from; k < to; k += WIDTH) found = list_lanes(near_beam(list, k, beam), k, place, found);
    for (int n = 0; n < found; ++n) {
      // Read before it is stored: else it waits for `count`, and so for the fit before.
      const int at = place[n];
      place[count] = at;
      entry[count] = meet_fit(fits, list.fit[at], s, d_max);
      count += counts(entry[count]);
    }
    for (int n = 0; n < count; ++n) {
      const int fit = list.fit[place[n]];
      Hit hit;
      if (!weigh_fit(fits, fit, s, d_max, entry[n], &hit)) continue;
      add_met(fits, fit, s, &entry[n], &hit, met);
      if (cache->count < CACHED) {
        cache->hit[cache->count] = hit;
        cache->fit[cache->count++] = fit;
      } else {
        cache->rest = min(cache->rest, place[n]);
      }
    }
  }
}

inline int hits_of(const Cache* cache, const List list) {
  return cache->count + (list.count - cache->rest);
}

// Two rounds of mean shift to the gradient that dominates. Where all hits belong to its sheet, both
// give the sum of them all, and there is no other sheet: most samples. Returns whether that is so.
INLINED int find_axis(const Cache* cache, const List list, const Fits fits, const Sample s,
                      const Blending by, const Sums* all, Axis* axis) {
  const floatv none = (floatv)(0.0f);
  int one_sheet = cache->rest == list.count;
  for (int round = 0; round < 2; ++round) {
    if (one_sheet) {
      floatv least = (floatv)(1.0f);
      for (int k = 0; k < cache->count; ++k)
        least = smaller(SELECT((floatv)(1.0f), alike(fits, cache->fit[k], &cache->hit[k], axis),
                               cache->hit[k].weight > 0.0f),
                        least);
      one_sheet = !ANY(smooth_step(by.same_low, by.same_high, least) < 1.0f);
    }
    Axis sum = {all->nx, all->ny, all->nz};
    if (!one_sheet) {
      sum.x = sum.y = sum.z = none;
      for (int k = 0; k < hits_of(cache, list); ++k) {
        int fit;
        Hit hit;
        if (!hit_again(cache, k, list, fits, s, by.d_max, &fit, &hit)) continue;
        add_gradient(&sum, &hit, hit.weight * of_sheet(fits, fit, &hit, axis, by));
      }
    }
    turn_to(&sum, axis);
  }
  return one_sheet;
}

// Sheet A lies around an axis. Where what is not of A faces two ways, three faces meet: it makes two
// sheets, B and C, as far as the returned value says.
INLINED floatv split_hits(const Cache* cache, const List list, const Fits fits, const Sample s,
                          const Blending by, const Axis* axis, Sums* A, Sums* B, Sums* C) {
  const floatv none = (floatv)(0.0f);
  Axis other = {none, none, none};  // of what is not of A, the heaviest
  floatv most = none;
  int fit;
  Hit hit;
  clear_sums(A);
  for (int k = 0; k < hits_of(cache, list); ++k) {
    if (!hit_again(cache, k, list, fits, s, by.d_max, &fit, &hit)) continue;
    const floatv share = of_sheet(fits, fit, &hit, axis, by);
    add_hit(A, fits.foot + 4 * fit, s, hit, share);
    add_hit(B, fits.foot + 4 * fit, s, hit, 1.0f - share);
    const floatv left = (1.0f - share) * hit.weight;
    const intv better = left > most;
    most = SELECT(most, left, better);
    take_gradient(&other, &hit, better);
  }
  const floatv third = third_of(A, B);
  if (!ANY(third > 0.0f)) return third;
  Axis sum = {none, none, none};
  for (int k = 0; k < hits_of(cache, list); ++k) {
    if (!hit_again(cache, k, list, fits, s, by.d_max, &fit, &hit)) continue;
    const floatv rest = 1.0f - of_sheet(fits, fit, &hit, axis, by);
    add_gradient(&sum, &hit, rest * hit.weight * of_sheet(fits, fit, &hit, &other, by));
  }
  turn_to(&sum, &other);
  clear_sums(B);
  for (int k = 0; k < hits_of(cache, list); ++k) {
    if (!hit_again(cache, k, list, fits, s, by.d_max, &fit, &hit)) continue;
    const floatv rest = 1.0f - of_sheet(fits, fit, &hit, axis, by);
    const floatv of_c = third * (1.0f - of_sheet(fits, fit, &hit, &other, by));
    add_hit(B, fits.foot + 4 * fit, s, hit, rest * (1.0f - of_c));
    add_hit(C, fits.foot + 4 * fit, s, hit, rest * of_c);
  }
  return third;
}

// What rays meet: up to three sheets, what they weigh together, and the convex edges between them.
typedef struct {
  Sheet a, b, c;
  floatv all;
  intv edge;
} Meeting;

// Sets how much of what is shown is of sheets B and C, and the edges.
INLINED void share_out(const Sample s, const List rim, const Fits fits, const Blending by,
                       const Sums* A, const Sums* B, const Sums* C, const floatv third, Meeting* m,
                       Shares* shares) {
  const Sheet *const a = &m->a, *const b = &m->b, *const c = &m->c;
  const float crease = by.crease;
  const floatv per_all = 1.0f / larger(m->all, (floatv)(1e-30f));
  const floatv some_b = counts_by(B->w * per_all);
  const intv convex = convex_between(a, b), only_b = !(A->w > 1e-9f * B->w);
  shares->c = (floatv)(0.0f);
  m->edge = (B->w > 0.03f * A->w) & convex & near_each(a->z, b->z, crease);
  if (ANY(third > 0.0f)) {
    const floatv some_c = counts_by(C->w * per_all);
    *shares = shares_in_corner(a, b, c, some_b, some_c, only_b, crease);
    m->edge |= (C->w > 0.03f * A->w) & convex_between(a, c) & near_each(a->z, c->z, crease);
  } else {
    shares->b = SELECT(takes_over(a->z, b->z, convex, some_b, crease), (floatv)(1.0f), only_b);
  }
  const intv beside = convex & near_each(a->z, b->z, crease) & !only_b & (some_b > 0.0f) &
                      (fabs(a->z - b->z) > MEETING);
  if (ANY(beside)) {
    const intv is_near = a->z < b->z;
    const Sheet near = either_sheet(a, b, is_near), deep = either_sheet(b, a, is_near);
    const floatv held = held_by(s, rim, fits, by, &near, &deep, m->all, beside);
    shares->b = SELECT(fma(held, some_b * (1.0f - shares->c) - shares->b, shares->b),
                       shares->b * (1.0f - held), is_near);
  }
}

// Depth and normal of the shown sheets; sets the middle of their feet.
INLINED void show(const Sample s, const Met* met, const Sums* A, const Sums* B, const Sums* C,
                  const int one_sheet, const Meeting* m, const Shares* shares, Blended* out,
                  Axis* middle) {
  const Sheet *const a = &m->a, *const b = &m->b, *const c = &m->c;
  const floatv of_a = (floatv)(1.0f) - shares->b - shares->c, of_b = shares->b, of_c = shares->c;
  out->depth = SELECT((floatv)(INFINITY), s.t + a->z * of_a + b->z * of_b + c->z * of_c,
                      met->best > 0.0f);
  floatv nx = (floatv)(0.0f), ny = nx, nz = nx;
  add_normal(A, a->z, of_a, &nx, &ny, &nz);
  if (!one_sheet) {
    add_normal(B, b->z, of_b, &nx, &ny, &nz);
    add_normal(C, c->z, of_c, &nx, &ny, &nz);
  }
  const floatv size = 1.0f / sqrt(larger(square_of(nx, ny, nz), (floatv)(1e-30f)));
  out->nx = plain_zero(nx * size);  // see gradient_at
  out->ny = plain_zero(ny * size);
  out->nz = plain_zero(nz * size);
  face_eye(s.dx, s.dy, &out->nx, &out->ny, &out->nz);
  middle->x = fma(a->cx, of_a, fma(b->cx, of_b, c->cx * of_c));
  middle->y = fma(a->cy, of_a, fma(b->cy, of_b, c->cy * of_c));
  middle->z = fma(a->cz, of_a, fma(b->cz, of_b, c->cz * of_c));
}

// The trust of what is shown, and its mark.
INLINED floatv trust_of(const Sample s, const Met* met, const Sums* A, const Sums* B, const Sums* C,
                        const Meeting* m, const Hidden* hidden, const intv ended) {
  const floatv none = (floatv)(0.0f), tiny = (floatv)(1e-30f), all = m->all;
  // The mean trust under the weights without it; what only rounding keeps from 1 is 1. Where hardly
  // any firm fit is near, the fits that are met reach out into the air: there is nothing to trust.
  floatv trust = smaller(1.001f * all / larger(met->trust, tiny), (floatv)(1.0f)) *
                 smooth_step(ALONE, COMPANY, met->firm);
  const floatv least = SELECT((floatv)(VOUCHING), (floatv)(VOUCHING_SURE), trust >= 1.0f);
  const floatv within = hidden->within, beyond = hidden->beyond;
  intv edge = m->edge;
  edge |= (within > least) & (within > beyond);
  const floatv entering = dot_of(A->nx + B->nx + C->nx, A->ny + B->ny + C->ny, A->nz + B->nz + C->nz,
                                 s.dx, s.dy, (floatv)(-1.0f));
  const intv over = (met->height > OVER * all) | (height_over(&hidden->turning, all, entering) > OVER);
  // Where such fits are not trusted nothing is met: the field alone tells whether there is fluid.
  const intv passed = over & (trust > SURELY_OVER);
  trust = SELECT(trust, none, over & !passed);
  const floatv one_face = 1.0f - counts_by((B->w + C->w) / larger(all, tiny));
  const floatv doubt = (1.0f - trust) * (1.0f - smooth_step(SOME_FIRM, MANY_FIRM, met->firm) * one_face);
  trust = SELECT(1.0f - doubt, trust, over | ended);
  const floatv on_edge = SELECT(none, (floatv)(ON_EDGE), edge);
  return trust + SELECT(SELECT(on_edge, (floatv)(ENDED), ended), (floatv)(PASSED), passed);
}

inline void blend_at(const Sample* sample, const Listed listed, const Fits fits,
                     const Blending blending, Blended* blended) {
  const Blending by = blending;  // read once: in the loops it would be done each time
  const floatv none = (floatv)(0.0f);
  const Sample s = *sample;
  Cache cache;
  Met met;
  meet_all(listed.met, fits, s, by.d_max, beam_of(sample), &cache, &met);
  Blended out;
  out.group = met.group;
  if (!ANY(met.best > 0.0f)) {
    out.depth = (floatv)(INFINITY);
    out.nx = out.ny = out.nz = out.trust = none;
    *blended = out;
    return;
  }

  Sums A = met.sum, B, C;
  clear_sums(&B);
  clear_sums(&C);
  Axis axis = met.axis;
  const int one_sheet = find_axis(&cache, listed.met, fits, s, by, &met.sum, &axis);
  floatv third = none;
  if (!one_sheet) third = split_hits(&cache, listed.met, fits, s, by, &axis, &A, &B, &C);

  Meeting meeting = {sheet_of(&A), sheet_of(&B), sheet_of(&C), A.w + B.w + C.w, (intv)(0)};
  Shares shares = {none, none};
  if (!one_sheet) share_out(s, listed.rim, fits, by, &A, &B, &C, third, &meeting, &shares);
  Axis middle;
  show(s, &met, &A, &B, &C, one_sheet, &meeting, &shares, &out, &middle);

  Hidden hidden;
  look_at_hidden(listed.rim, fits, s, &middle, &out, by, &hidden);
  const intv ended = ended_by(&hidden, &middle, &out);
  out.trust = trust_of(s, &met, &A, &B, &C, &meeting, &hidden, ended);
  *blended = out;
}

inline void store_blended(const Blended* b, const int* at, const intv wanted, const int n,
                          global float* depth, global float* normal, global int* group,
                          global float* trust) {
  store_surface(b->depth, b->nx, b->ny, b->nz, at, wanted, n, depth, normal);
  scatter_float(b->trust, trust, at, wanted);
  int id[WIDTH], want[WIDTH];
  STOREI(b->group, id);
  STOREI(wanted, want);
#pragma unroll
  for (int k = 0; k < WIDTH; ++k)
    if (want[k]) group[at[k]] = id[k];
}

// The same at a list of positions: one work-item per point, WIDTH 1.
#if WIDTH == 1
kernel void blend_points(global const float* reference,  // [n] depth; +inf: leave the point
                         global const float* points,     // [2][n] u, v, pixels
                         FITS(record, foot), FITS_OF_TILES(), BLENDED(, ),
                         const PointsOnTiles points_on, const Blending blending) {
  const int p = get_global_id(0), n = points_on.count;
  if (p >= n || !(reference[p] < INFINITY)) return;
  const float u = points[p], v = points[n + p];
  const int i = clamp((int)((u - points_on.first) * points_on.inverse_tile), 0, points_on.tiles_x - 1);
  const int j = clamp((int)((v - points_on.first) * points_on.inverse_tile), 0, points_on.tiles_y - 1);
  const Fits fits = {record, foot};
  const int tile = j * points_on.tiles_x + i;
  const Listed listed = {list_of(tile, met_start, met, met_place, strides.x),
                         list_of(tile, rim_start, rim, rim_place, strides.y)};
  const Sample at = sample_at(rays_at(points_on.rays, u, v), reference[p]);
  Blended b;
  blend_at(&at, listed, fits, blending, &b);
  store_blended(&b, &p, 1, n, depth, normal, group, trust);
}
#endif

// TILE_ITEMS work-items per tile; one takes WIDTH samples of its list (samples.cl) at a time.
kernel void blend_groups(SAMPLES(const, sample, count),
                         global const float* reference,  // [samples] depth; +inf: left alone
                         FITS(record, foot), FITS_OF_TILES(), BLENDED(, ),  // out where listed
                         const Screen screen,
                         const Blending blending) {
  const int tile = tile_of_item();
  if (tile >= tiles_of(screen)) return;
  const Fits fits = {record, foot};
  const Listed listed = {list_of(tile, met_start, met, met_place, strides.x),
                         list_of(tile, rim_start, rim, rim_place, strides.y)};
  Lanes lanes;
  for (int place = item_of_tile() * WIDTH;; place += TILE_ITEMS * WIDTH) {
    if (!load_lanes(tile, place, sample, count, screen, &lanes)) return;
    const floatv near = gather_float(reference, lanes.at);
    lanes.used &= near < INFINITY;
    if (!ANY(lanes.used)) continue;
    const Sample at = sample_at(lanes.rays, near);
    Blended b;
    blend_at(&at, listed, fits, blending, &b);
    store_blended(&b, lanes.at, lanes.used, screen.nx * screen.ny, depth, normal, group, trust);
  }
}
