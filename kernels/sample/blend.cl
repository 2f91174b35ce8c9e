// blend.cl: every sample's ray meets the fits near it; their intersections are blended within a
// sheet and meet in a crease between sheets (paper 2.4.2, Eqs. 6 and 7).
//
// Departs from the paper: the distance in Eq. 7 is taken in space and the weight ends at a fit's
// reach; the factor 1/b^2 is left out (it lowers the weight of similar groups); and b's growth with
// similarity is taken to its limit: similar fits form a sheet that is averaged, two sheets meet in
// the curve where they intersect. Sheets that turn away from the eye end the surface in the same way,
// and so does the mean of those that a ray grazes (docs/method.md).
//
// Fits are listed by tile of 16x16 samples, as samples are (samples.cl).
//
// uses: samples.cl hits.cl

// Fits of a list that are met before any is weighed: whether a fit that is met counts is a branch that
// nobody foresees, in front of a root and a division. A work-item with one ray has no room for them.
#if WIDTH == 1
#define BLOCK 1
#else
#define BLOCK 128
#endif
#define CACHED 48  // hits kept between the passes over a tile's list; later ones are found again

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
// and, for find_near, the unit normal there and how far from the plane at its foot a fit is looked for.
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
inline intv find_near(const List list, const int k, const Beam b) {
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
inline intv near_box(const List list, const int k, const Box b) {
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

typedef struct {
  floatv depth;       // particle radii; +infinity where no fit is met
  floatv nx, ny, nz;  // unit, eye axes
  floatv trust;       // of the fits met, 0 .. 1, plus ON_EDGE, ENDED or PASSED
  intv group;         // the heaviest
} Blended;

inline void add_hit(Sums* sum, global const float* foot, const Sample s, const Hit hit,
                    const floatv share) {
  const floatv pull = share * hit.pull;
  const floatv px = fma(hit.tau, s.dx, s.sx - foot[0]), py = fma(hit.tau, s.dy, s.sy - foot[1]),
               pz = -s.t - foot[2] - hit.tau;
  add_to_sheet(sum, share * hit.weight, hit.tau, foot[0], foot[1], foot[2], hit.gx, hit.gy, hit.gz, pull,
               px, py, pz);
}

// A sheet's gradient, or a sum of gradients.
typedef struct {
  floatv x, y, z;
} Axis;

inline void add_gradient(Axis* sum, const Hit* hit, const floatv weight) {
  sum->x = fma(weight, hit->gx, sum->x);
  sum->y = fma(weight, hit->gy, sum->y);
  sum->z = fma(weight, hit->gz, sum->z);
}

inline void take_gradient(Axis* axis, const Hit* hit, const intv where) {
  axis->x = SELECT(axis->x, hit->gx, where);
  axis->y = SELECT(axis->y, hit->gy, where);
  axis->z = SELECT(axis->z, hit->gz, where);
}

// How far a hit's gradient agrees with a sheet's.
inline floatv alike(const Fits fits, const int fit, const Hit* hit, const Axis* axis) {
  return leeway_of(fits.record + FIT * fit) +
         dot_of(hit->gx, hit->gy, hit->gz, axis->x, axis->y, axis->z);
}

// The fits of a tile: those that rays may meet, and those that may be steep to them or turn away.
typedef struct {
  List met, rim;
} Listed;

// What of a hit belongs to a sheet, by its gradient.
inline floatv of_sheet(const Fits fits, const int fit, const Hit* hit, const Axis* axis,
                       const Blending by) {
  return smooth_step(by.same_low, by.same_high, alike(fits, fit, hit, axis));
}

// How far a sheet of so much of the weights counts.
inline floatv counts_by(const floatv share) { return smooth_step(0.003f, 0.02f, share); }

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

// A sheet: its depth behind the reference, the middle of its feet, and the direction of its gradients.
typedef struct {
  floatv z, cx, cy, cz, nx, ny, nz;
} Sheet;

inline Sheet sheet_of(const Sums* s) {
  const floatv tiny = (floatv)(1e-30f), v = 1.0f / larger(s->w, tiny);
  const floatv size = 1.0f / sqrt(larger(square_of(s->nx, s->ny, s->nz), tiny));
  const Sheet sheet = {s->value * v,  s->cx * v,     s->cy * v,    s->cz * v,
                       s->nx * size, s->ny * size, s->nz * size};
  return sheet;
}

// Sheet a where `first` is set, else b.
inline Sheet either_sheet(const Sheet* a, const Sheet* b, const intv first) {
  const Sheet sheet = {SELECT(b->z, a->z, first),   SELECT(b->cx, a->cx, first),
                       SELECT(b->cy, a->cy, first), SELECT(b->cz, a->cz, first),
                       SELECT(b->nx, a->nx, first), SELECT(b->ny, a->ny, first),
                       SELECT(b->nz, a->nz, first)};
  return sheet;
}

// Whether two sheets meet in a convex edge: the mean of each one's middle over the other's plane.
inline intv convex_between(const Sheet* a, const Sheet* b) {
  return dot_of(b->cx - a->cx, b->cy - a->cy, b->cz - a->cz, a->nx - b->nx, a->ny - b->ny,
                a->nz - b->nz) < 0.0f;
}

// Whether depths of two sheets are near enough to meet.
inline intv near_each(const floatv a, const floatv b, const float crease) {
  return fabs(a - b) <= crease;
}

// How far a sheet's depth b takes the place of a, if up to `share`: on a convex edge the deeper one
// counts, on a concave edge the nearer.
inline floatv takes_over(const floatv a, const floatv b, const intv convex, const floatv share,
                         const float crease) {
  const floatv meeting = SELECT(fmin(a, b), fmax(a, b), convex);
  return SELECT((floatv)(0.0f), share, (meeting == b) & near_each(a, b, crease));
}

// How much of what a ray meets is of sheets B and C, in the corner of A, B and C. Of three edges two
// are of one kind: the sheets of the other edge meet first, then the third (as in implicit.cl). B and C
// count as far as `some_b` and `some_c` say; B alone where A has no weight.
typedef struct {
  floatv b, c;
} Shares;

inline Shares shares_in_corner(const Sheet* a, const Sheet* b, const Sheet* c, const floatv some_b,
                               const floatv some_c, const intv only_b, const float crease) {
  const floatv one = (floatv)(1.0f);
  const intv ab = convex_between(a, b), ac = convex_between(a, c), bc = convex_between(b, c);
  // A with B, then C
  const floatv b1 = SELECT(takes_over(a->z, b->z, ab, some_b, crease), one, only_b);
  const floatv c1 = takes_over(a->z + (b->z - a->z) * b1, c->z, ac, some_c, crease);
  // A with C, then B
  const floatv c2 = takes_over(a->z, c->z, ac, some_c, crease);
  const floatv b2 = SELECT(takes_over(a->z + (c->z - a->z) * c2, b->z, ab, some_b, crease), one, only_b);
  // B with C, then A
  const floatv c3 = takes_over(b->z, c->z, bc, some_c, crease);
  const floatv b3 = SELECT(takes_over(a->z, b->z + (c->z - b->z) * c3, ab, some_b, crease), one, only_b);
  const intv odd_ac = (ab == bc) & (ab != ac), odd_bc = (ab == ac) & (ab != bc);
  const Shares shares = {SELECT(SELECT(b1 * (one - c1), b2, odd_ac), b3 * (one - c3), odd_bc),
                         SELECT(SELECT(c1, c2 * (one - b2), odd_ac), b3 * c3, odd_bc)};
  return shares;
}

// The direction of a sum, where it has one.
inline void turn_to(const Axis* sum, Axis* axis) {
  const floatv size = square_of(sum->x, sum->y, sum->z);
  const floatv scale = 1.0f / sqrt(larger(size, (floatv)(1e-30f)));
  axis->x = SELECT(axis->x, sum->x * scale, size > 1e-30f);
  axis->y = SELECT(axis->y, sum->y * scale, size > 1e-30f);
  axis->z = SELECT(axis->z, sum->z * scale, size > 1e-30f);
}

// How far what is not of sheet A is of two faces, by how long the mean of its gradients is; as far as
// it is some of what a ray meets.
inline floatv third_of(const Sums* a, const Sums* b) {
  const floatv tiny = (floatv)(1e-30f);
  const floatv length = sqrt(square_of(b->nx, b->ny, b->nz)) / larger(b->w, tiny);
  return (1.0f - smooth_step(0.95f, 0.98f, length)) *
         counts_by(b->w / larger(a->w + b->w, tiny));
}

// Adds a sheet's share to a normal: of the gradient of sum(w f) / sum(w) at the blended point, sum(w
// grad f + f grad w), with f = (depth - t_k) (grad f . d) to first order. The whole second term carries
// the fits' noise into the normal, without it waves look too flat: hits bring the share of it that PULL
// says.
inline void add_normal(const Sums* s, const floatv z, const floatv share, floatv* nx, floatv* ny,
                       floatv* nz) {
  const floatv gx = s->nx + (z * s->vx - s->ux), gy = s->ny + (z * s->vy - s->uy),
               gz = s->nz + (z * s->vz - s->uz);
  const floatv scale = share / sqrt(larger(square_of(gx, gy, gz), (floatv)(1e-30f)));
  *nx = fma(gx, scale, *nx);
  *ny = fma(gy, scale, *ny);
  *nz = fma(gz, scale, *nz);
}

// A fit at a point: its value, a distance there, and unit gradient; its weight where the fluid ends, less
// the farther the point lies off its surface.
typedef struct {
  floatv f, gx, gy, gz, weight, per_slope;
} FaceValue;

// Returns whether any of the points (x, y, z) is within the fit's reach.
inline int face_at(const Fits fits, const int fit, const floatv x, const floatv y, const floatv z,
                   FaceValue* face) {
  global const float* g = fits.record + FIT * fit;
  global const float* foot = fits.foot + 4 * fit;
  const floatv px = x - foot[0], py = y - foot[1], pz = z - foot[2], none = (floatv)(0.0f);
  const floatv squared = square_of(px, py, pz) * g[10];
  if (!ANY(squared < 1.0f)) return 0;
  floatv gx, gy, gz;
  gradient_at(g, px, py, pz, &gx, &gy, &gz);
  const floatv slope = 1.0f / sqrt(larger(square_of(gx, gy, gz), (floatv)(1e-20f)));
  const floatv f = value_at(g, px, py, pz, gx, gy, gz) * slope;
  const floatv q = larger(1.0f - squared, none);
  face->f = f;
  face->gx = gx * slope;
  face->gy = gy * slope;
  face->gz = gz * slope;
  face->per_slope = slope;
  face->weight = g[13] * q * q * q * larger(1.0f - 0.25f * f * f, none);
  return 1;
}

// The product of a unit normal and a ray's direction from which on a face is steep, or turns away.
inline floatv steep_for(const Sample s) {
  return -STEEP * sqrt(square_of(s.dx, s.dy, (floatv)(1.0f)));
}

// Sums over round fits of the sheet that is shown, as far as they are steep to the ray or turn away:
// weights, values at the blended point, and how these change along the ray. Where a drop or an arm turns
// away, the ray misses one of its fits after the other, and the last one that it meets would be drawn as
// a flag beside the outline.
typedef struct {
  floatv w, f, along, bend;
} Turning;

inline void add_turning(Turning* sum, global const float* g, const Sample s, const FaceValue* face,
                        const floatv along, const floatv weight) {
  sum->w += weight;
  sum->f = fma(weight, face->f, sum->f);
  sum->along = fma(weight, along, sum->along);
  sum->bend = fma(weight, bend_along(g, s) * face->per_slope, sum->bend);
}

// How high above the mean of these fits and of those that the ray meets, which it touches at that point,
// the ray passes; below 0 where it enters. `met` is what the latter weigh, `entering` how their values
// change along the ray.
inline floatv height_over(const Turning* sum, const floatv met, const floatv entering) {
  const floatv per = 1.0f / larger(sum->w + met, (floatv)(1e-30f));
  const floatv f = sum->f * per, along = (sum->along + entering) * per;
  return f - 0.25f * along * along / larger(sum->bend * per, (floatv)(LEAST_BEND));
}

// How far the nearer of two sheets that meet in a convex edge stays, because a third face holds it: one
// that rays meet far away or not at all, in a convex edge with the nearer sheet and a concave one with
// the deeper. At the end of a step's inner edge the step's riser holds the wall beside it.
inline floatv held_by(const Sample s, const List rim, const Fits fits, const Blending by,
                      const Sheet* near, const Sheet* deep, const floatv all, const intv wanted) {
  const floatv none = (floatv)(0.0f);
  const floatv x = s.sx + near->z * s.dx, y = s.sy + near->z * s.dy, z = -(s.t + near->z);
  const floatv steep = steep_for(s);
  const Box box = box_of(x, y, z, wanted);
  floatv within = none, beyond = none;
  int place[BLOCK + WIDTH];
  for (int from = 0; from < rim.count; from += BLOCK) {
    const int to = min(from + BLOCK, rim.count);
    int found = 0;
    for (int k = from; k < to; k += WIDTH) found = list_lanes(near_box(rim, k, box), k, place, found);
    for (int n = 0; n < found; ++n) {
      const int fit = rim.fit[place[n]];
      FaceValue face;
      if (!face_at(fits, fit, x, y, z, &face)) continue;
      const floatv with_near = dot_of(face.gx, face.gy, face.gz, near->nx, near->ny, near->nz),
                   with_deep = dot_of(face.gx, face.gy, face.gz, deep->nx, deep->ny, deep->nz);
      const floatv same = smooth_step(by.same_low, by.same_high, larger(with_near, with_deep));
      global const float* foot = fits.foot + 4 * fit;
      const floatv nx = foot[0] - near->cx, ny = foot[1] - near->cy, nz = foot[2] - near->cz;
      const floatv dx = foot[0] - deep->cx, dy = foot[1] - deep->cy, dz = foot[2] - deep->cz;
      const intv convex = (dot_of(nx, ny, nz, near->nx, near->ny, near->nz) < 0.0f) &
                          (dot_of(nx, ny, nz, face.gx, face.gy, face.gz) > 0.0f);
      const intv concave = (dot_of(dx, dy, dz, deep->nx, deep->ny, deep->nz) > 0.0f) &
                           (dot_of(dx, dy, dz, face.gx, face.gy, face.gz) < 0.0f);
      const floatv along = fma(face.gx, s.dx, fma(face.gy, s.dy, -face.gz));
      const floatv holds =
          SELECT(none, face.weight * (1.0f - same), convex & concave & (along > steep));
      within += SELECT(holds, none, face.f > 0.0f);
      beyond += SELECT(none, holds, face.f > 0.0f);
    }
  }
  return SELECT(none, smooth_step(HOLDING, HOLDING_SURE, within / larger(all, (floatv)(1e-30f))),
                wanted & (within > beyond));
}

// The steps of a blend.

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
    for (int k = from; k < to; k += WIDTH) found = list_lanes(find_near(list, k, beam), k, place, found);
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

// Sums over the faces at the point that is shown. Where the fluid turns away from the eye no ray enters
// it, and hidden fits tell of sheet R. A convex edge between the surface and R ends the surface where it
// leaves R's fluid. Within it R vouches for the surface, as sheet B does, and so do faces so steep that
// the ray meets them far away.
typedef struct {
  // Of R: weights, values, feet and gradients; what those weigh that the point lies outside of; and both
  // times their own weight in the blend.
  floatv w, f, cx, cy, cz, nx, ny, nz, outside, strong, strong_outside;
  floatv within, beyond;  // what faces weigh that the point lies in, and outside of
  Turning turning;
} Hidden;

// `middle` is that of the sheet that is shown, `steep` what steep_for says.
INLINED void add_face(Hidden* sum, const Fits fits, const int fit, const Sample s,
                      const FaceValue* face, const Axis* middle, const Blended* shown,
                      const floatv steep, const Blending by) {
  global const float* foot = fits.foot + 4 * fit;
  global const float* g = fits.record + FIT * fit;
  const floatv none = (floatv)(0.0f);
  const floatv cosine = dot_of(face->gx, face->gy, face->gz, shown->nx, shown->ny, shown->nz);
  const floatv weight = face->weight * (1.0f - smooth_step(by.same_low, by.same_high, cosine));
  const floatv along = fma(face->gx, s.dx, fma(face->gy, s.dy, -face->gz));
  if (g[15] > 0.5f * ROUNDEST) {
    const floatv same = smooth_step(by.same_low, by.same_high, leeway_of(g) + cosine) *
                        smooth_step(0.5f * ROUNDEST, ROUNDEST, (floatv)(g[15]));
    const floatv turned = SELECT(none, face->weight * same, along > steep);
    add_turning(&sum->turning, g, s, face, along, turned);
  }
  const floatv tx = foot[0] - middle->x, ty = foot[1] - middle->y, tz = foot[2] - middle->z;
  const intv convex = (dot_of(tx, ty, tz, shown->nx, shown->ny, shown->nz) < 0.0f) &
                      (dot_of(tx, ty, tz, face->gx, face->gy, face->gz) > 0.0f);
  const floatv hidden = SELECT(none, weight, convex & (along > steep));
  sum->within += SELECT(hidden, none, face->f > 0.0f);
  sum->beyond += SELECT(none, hidden, face->f > 0.0f);
  const floatv w = SELECT(none, weight, along > 0.0f);
  const floatv own = (floatv)(g[13]);
  const floatv outside = SELECT(w, none, face->f < 0.0f);
  sum->w += w;
  sum->outside += outside;
  sum->strong = fma(w, own, sum->strong);
  sum->strong_outside = fma(outside, own, sum->strong_outside);
  // Of several faces one that the point lies outside of ends the surface, however far within the
  // others it lies. The next ones are no numbers where the depth is infinite; w is 0 there.
  sum->f = fma(w, larger(face->f, (floatv)(WITHIN)), sum->f);
  sum->cx = fma(w, (floatv)(foot[0]), sum->cx);
  sum->cy = fma(w, (floatv)(foot[1]), sum->cy);
  sum->cz = fma(w, (floatv)(foot[2]), sum->cz);
  sum->nx = fma(w, face->gx, sum->nx);
  sum->ny = fma(w, face->gy, sum->ny);
  sum->nz = fma(w, face->gz, sum->nz);
}

INLINED void look_at_hidden(const List rim, const Fits fits, const Sample s, const Axis* middle,
                            const Blended* shown, const Blending by, Hidden* sum) {
  const floatv none = (floatv)(0.0f);
  const Hidden nothing = {none, none, none, none, none, none, none, none,
                          none, none, none, none, none, {none, none, none, none}};
  *sum = nothing;
  const floatv end = shown->depth - s.t, ex = s.sx + end * s.dx, ey = s.sy + end * s.dy;
  const floatv steep = steep_for(s);
  const Box box = box_of(ex, ey, -shown->depth, shown->depth < INFINITY);
  int place[BLOCK + WIDTH];
  for (int from = 0; from < rim.count; from += BLOCK) {
    const int to = min(from + BLOCK, rim.count);
    int found = 0;
    for (int k = from; k < to; k += WIDTH) found = list_lanes(near_box(rim, k, box), k, place, found);
    for (int n = 0; n < found; ++n) {
      const int fit = rim.fit[place[n]];
      FaceValue face;
      if (face_at(fits, fit, ex, ey, -shown->depth, &face))
        add_face(sum, fits, fit, s, &face, middle, shown, steep, by);
    }
  }
}

// Whether hidden faces end the surface.
INLINED intv ended_by(const Hidden* r, const Axis* middle, const Blended* shown) {
  const floatv per = 1.0f / larger(r->w, (floatv)(1e-30f));
  const floatv x = r->cx * per - middle->x, y = r->cy * per - middle->y, z = r->cz * per - middle->z;
  // Bevels between hidden faces end nothing that these hold.
  const intv credible = r->strong_outside * r->w > CREDIBLE * (r->strong * r->outside);
  return (r->w > 1e-3f) & (r->f > 0.0f) & credible &
         (x * shown->nx + y * shown->ny + z * shown->nz < 0.0f) &
         (x * r->nx + y * r->ny + z * r->nz > 0.0f);
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

inline List list_of(const int tile, global const int* start, global const int* fit,
                    global const float* place, const int stride) {
  const int first = start[tile];
  const List list = {fit + first, place + first, start[tile + 1] - first, stride};
  return list;
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
