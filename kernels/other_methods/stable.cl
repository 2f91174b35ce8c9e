// stable.cl: the surface of one quadric per visible particle: the blend of the quadrics (paper 2.4.2) at the
// samples that stable_region.cl covers.
//
// Departs from the paper: groups are single particles, so nothing jumps when groups merge differently.
//
// A particle's record is PARTICLE_RECORD floats: 0-2 position, 3-5 normal, 6-15 quadric (see fit.hpp), 16
// one over the blend radius squared, 18 weight e v (0: no fit), 19-21 foot; the others are not used.

#define CACHED 48  // hits kept between the passes over a tile's list; later ones are found again

typedef struct {
  floatv sx, sy, t;  // point of the ray at the reference depth: eye (sx, sy, -t)
  floatv dx, dy;     // direction (dx, dy, -1)
} Sample;

typedef struct {
  floatv tau;         // depth behind the reference depth, particle radii
  floatv weight;      // 0: no hit
  floatv gx, gy, gz;  // unit gradient there
} Hit;

// Where the ray passes the fluid by, the hit is where it comes nearest, and its weight negative.
inline Hit hit_particle(global const float* g, const Sample s, const float d_max) {
  const floatv none = (floatv)(0.0f);
  const floatv x = s.sx - g[0], y = s.sy - g[1], z = -s.t - g[2];
  floatv gx = g[7] + 2.0f * g[10] * x + g[13] * y + g[15] * z;
  floatv gy = g[8] + 2.0f * g[11] * y + g[13] * x + g[14] * z;
  floatv gz = g[9] + 2.0f * g[12] * z + g[14] * y + g[15] * x;
  const floatv C = g[6] + 0.5f * ((gx + g[7]) * x + (gy + g[8]) * y + (gz + g[9]) * z);
  const floatv B = gx * s.dx + gy * s.dy - gz;
  const floatv A = (g[10] * s.dx + g[13] * s.dy - g[15]) * s.dx + (g[11] * s.dy - g[14]) * s.dy +
                   g[12];
  const floatv D = B * B - 4.0f * A * C;
  const floatv root = sqrt(fmax(D, none));
  // Where the ray enters, in the stable form of the root: f falls there.
  const floatv bent = SELECT((floatv)(1.0f), A, fabs(A) > 1e-12f);
  const intv passes = D < 0.0f;
  floatv tau = SELECT(-(B + root) / (2.0f * bent), 2.0f * C / (root - B), (B < 0.0f) & !passes);
  intv met = (fabs(tau) <= 4.0f * d_max) & ((B < 0.0f) | (fabs(A) > 1e-12f));
  tau = SELECT(none, tau, met);
  const floatv px = x + tau * s.dx, py = y + tau * s.dy, pz = z - tau;
  const floatv fx = px + (g[0] - g[19]), fy = py + (g[1] - g[20]), fz = pz + (g[2] - g[21]);
  const floatv squared = (fx * fx + fy * fy + fz * fz) * g[16];
  const floatv d = sqrt(fmin(squared, (floatv)(1.0f)));
  const floatv q = (1.0f - d) * (1.0f - d);
  gx = g[7] + 2.0f * g[10] * px + g[13] * py + g[15] * pz;
  gy = g[8] + 2.0f * g[11] * py + g[13] * px + g[14] * pz;
  gz = g[9] + 2.0f * g[12] * pz + g[14] * py + g[15] * px;
  const floatv slope = 1.0f / sqrt(fmax(gx * gx + gy * gy + gz * gz, (floatv)(1e-20f)));
  Hit hit;
  hit.tau = tau;
  // A grazing ray enters far before the reference, which lies inside: there depths count less.
  const floatv facing = fabs(gx * s.dx + gy * s.dy - gz) * slope;
  met &= fabs(tau) * fmin(2.0f * facing, (floatv)(1.0f)) <= d_max;
  const floatv weight = SELECT(none, q * q * (4.0f * d + 1.0f) * g[18], met);
  hit.weight = SELECT(weight, -weight, passes);
  hit.gx = gx * slope;
  hit.gy = gy * slope;
  hit.gz = gz * slope;
  return hit;
}

// Whether any ray passes a particle's foot within the blend radius. A hundredth more is let through,
// so that rounding, which depends on no width, never decides about a hit with weight.
inline int in_reach(global const float* g, const Sample s) {
  const floatv x = s.sx - g[19], y = s.sy - g[20], z = -s.t - g[21];
  const floatv along = x * s.dx + y * s.dy - z, squared = s.dx * s.dx + s.dy * s.dy + 1.0f;
  const floatv apart = (x * x + y * y + z * z) * squared - along * along;
  return ANY(apart * g[16] < 1.01f * squared);
}

// The rays of WIDTH samples of a row, from (i, j) on; the last ones may lie beyond its end.
typedef struct {
  float t[WIDTH], front[WIDTH];  // reference depth, +inf: leave the sample; depth where no fit is met
  int owner[WIDTH];
  float x[WIDTH], y[WIDTH], z[WIDTH];  // the owner's gradient
} Given;

// Returns whether there is anything to do.
inline int load_given(STABLE_REGION(reference, front, owner), global const float* records, const int i,
                      const int j, const int nx, Given* given) {
  int covered = 0;
  for (int k = 0; k < WIDTH; ++k) {
    const int at = j * nx + i + k, inside = i + k < nx;
    given->t[k] = inside ? reference[at] : INFINITY;
    given->front[k] = inside ? front[at] : INFINITY;
    given->owner[k] = inside ? owner[at] : -1;
    given->x[k] = given->y[k] = 0.0f;
    given->z[k] = 1.0f;
    if (!(given->t[k] < INFINITY)) continue;
    covered = 1;
    global const float* g = records + given->owner[k] * PARTICLE_RECORD;
    given->x[k] = g[3];
    given->y[k] = g[4];
    given->z[k] = g[5];
  }
  return covered;
}

inline Sample sample_from(const Screen screen, const floatv t, const int i, const int j) {
  const floatv u = screen.first + screen.step * ((float)i + LANES);
  const float v = screen.first + screen.step * (float)j;
  Sample s;
  s.t = SELECT((floatv)(1.0f), t, t < INFINITY);
  s.dx = screen.rays.dx + screen.rays.dx_u * u + screen.rays.dx_v * v;
  s.dy = screen.rays.dy + screen.rays.dy_u * u + screen.rays.dy_v * v;
  s.sx = screen.rays.ox + screen.rays.ox_u * u + screen.rays.ox_v * v + s.t * s.dx;
  s.sy = screen.rays.oy + screen.rays.oy_u * u + screen.rays.oy_v * v + s.t * s.dy;
  return s;
}

// A tile's particles.
typedef struct {
  global const float* record;
  global const int* id;
  int begin, end;
} Listed;

// What rays meet: hits that are kept, and the first listed particle that did not fit among them.
typedef struct {
  Hit hit[CACHED];
  int id[CACHED];
  int kept, rest;
} Cache;

// What they pass by: sums of weights, depths and gradients.
typedef struct {
  floatv w, t, nx, ny, nz;
} Passed;

// Takes the gradient of the heaviest hit, and whose it is.
inline void meet_particles(const Listed listed, const Sample s, const float d_max, Cache* cache,
                           Passed* passed, intv* heaviest, floatv* ax, floatv* ay, floatv* az) {
  floatv best = (floatv)(0.0f);
  passed->w = passed->t = passed->nx = passed->ny = passed->nz = best;
  cache->kept = 0;
  cache->rest = listed.end;
  for (int k = listed.begin; k < listed.end; ++k) {
    const int id = listed.id[k];
    if (!in_reach(listed.record + id * PARTICLE_RECORD, s)) continue;
    const Hit hit = hit_particle(listed.record + id * PARTICLE_RECORD, s, d_max);
    const floatv by = fmax(-hit.weight, (floatv)(0.0f));
    passed->w += by;
    passed->t += by * hit.tau;
    passed->nx += by * hit.gx;
    passed->ny += by * hit.gy;
    passed->nz += by * hit.gz;
    if (!ANY(hit.weight > 0.0f)) continue;
    if (cache->kept < CACHED) {
      cache->hit[cache->kept] = hit;
      cache->id[cache->kept++] = id;
    } else {
      cache->rest = min(cache->rest, k);
    }
    const intv better = hit.weight > best;
    best = SELECT(best, hit.weight, better);
    *heaviest = SELECT(*heaviest, (intv)(id), better);
    *ax = SELECT(*ax, hit.gx, better);
    *ay = SELECT(*ay, hit.gy, better);
    *az = SELECT(*az, hit.gz, better);
  }
}

// Hit k of all, and its record: a kept one, or one of the rest, which is found again.
inline global const float* hit_again(const Cache* cache, const int k, const Listed listed,
                                     const Sample s, const float d_max, Hit* hit) {
  const int is_kept = k < cache->kept;
  const int id = is_kept ? cache->id[k] : listed.id[cache->rest + k - cache->kept];
  global const float* g = listed.record + id * PARTICLE_RECORD;
  *hit = is_kept ? cache->hit[k] : hit_particle(g, s, d_max);
  return g;
}

inline int hits_in(const Cache* cache, const Listed listed) {
  return cache->kept + (listed.end - cache->rest);
}

// What a hit weighs in the sheet around a gradient.
inline floatv weight_in(const Hit* hit, const floatv x, const floatv y, const floatv z,
                        const Blending blending) {
  const floatv same = smooth_step(blending.same_low, blending.same_high,
                                  hit->gx * x + hit->gy * y + hit->gz * z);
  return fmax(hit->weight, (floatv)(0.0f)) * same;
}

// Two rounds of mean shift to the gradient that dominates.
inline void shift_axis(const Cache* cache, const Listed listed, const Sample s, const Blending blending,
                       floatv* ax, floatv* ay, floatv* az) {
  for (int round = 0; round < 2; ++round) {
    floatv nx = (floatv)(0.0f), ny = nx, nz = nx;
    for (int k = 0; k < hits_in(cache, listed); ++k) {
      Hit hit;
      hit_again(cache, k, listed, s, blending.d_max, &hit);
      const floatv a = weight_in(&hit, *ax, *ay, *az, blending);
      nx += a * hit.gx;
      ny += a * hit.gy;
      nz += a * hit.gz;
    }
    const floatv size = nx * nx + ny * ny + nz * nz;
    const floatv scale = 1.0f / sqrt(fmax(size, (floatv)(1e-30f)));
    *ax = SELECT(*ax, nx * scale, size > 1e-30f);
    *ay = SELECT(*ay, ny * scale, size > 1e-30f);
    *az = SELECT(*az, nz * scale, size > 1e-30f);
  }
}

// Sums over the hits of a sheet: weights, depths, feet, gradients; half the weights' own gradients
// times how f changes along the ray, and these times the depths.
typedef struct {
  floatv w, t, cx, cy, cz, nx, ny, nz, vx, vy, vz, ux, uy, uz;
} Sheet;

inline void clear_sheet(Sheet* sum) {
  sum->w = sum->t = sum->cx = sum->cy = sum->cz = sum->nx = sum->ny = sum->nz = (floatv)(0.0f);
  sum->vx = sum->vy = sum->vz = sum->ux = sum->uy = sum->uz = (floatv)(0.0f);
}

// Adds a hit with weight w and (qx, qy, qz) from its foot.
inline void add_to_sheet(Sheet* sum, const Hit* hit, global const float* g, const floatv w,
                         const floatv pull, const floatv qx, const floatv qy, const floatv qz) {
  sum->w += w;
  sum->t += w * hit->tau;
  sum->cx += w * g[19];
  sum->cy += w * g[20];
  sum->cz += w * g[21];
  sum->nx += w * hit->gx;
  sum->ny += w * hit->gy;
  sum->nz += w * hit->gz;
  const floatv v = w * pull;
  sum->vx += v * qx;
  sum->vy += v * qy;
  sum->vz += v * qz;
  sum->ux += v * qx * hit->tau;
  sum->uy += v * qy * hit->tau;
  sum->uz += v * qz * hit->tau;
}

inline void sum_sheets(const Cache* cache, const Listed listed, const Sample s, const Blending blending,
                       const floatv ax, const floatv ay, const floatv az, Sheet* A, Sheet* B) {
  clear_sheet(A);
  clear_sheet(B);
  for (int k = 0; k < hits_in(cache, listed); ++k) {
    Hit hit;
    global const float* g = hit_again(cache, k, listed, s, blending.d_max, &hit);
    const floatv a = weight_in(&hit, ax, ay, az, blending);
    const floatv b = fmax(hit.weight, (floatv)(0.0f)) - a;
    const floatv qx = s.sx + hit.tau * s.dx - g[19], qy = s.sy + hit.tau * s.dy - g[20],
                 qz = -(s.t + hit.tau) - g[21];
    const floatv d = sqrt(fmin((qx * qx + qy * qy + qz * qz) * g[16], (floatv)(1.0f)));
    const floatv pull = -10.0f * g[16] / ((1.0f - d) * (4.0f * d + 1.0f) + 1e-6f) *
                        (hit.gx * s.dx + hit.gy * s.dy - hit.gz);
    add_to_sheet(A, &hit, g, a, pull, qx, qy, qz);
    add_to_sheet(B, &hit, g, b, pull, qx, qy, qz);
  }
}

// A share of a sheet's normal. The normal is the gradient of sum(w f) / sum(w) at the blended
// point, sum(w grad f + f grad w), with f = (depth - t_k) (grad f . d) to first order. The whole
// second term carries the fits' noise into the normal, without it waves look too flat: half of it has
// the smallest error (median .88 degrees over seven scenes; 0: .93, all: .97; waves 2.2, 3.2, 1.8).
inline void part_of_normal(const Sheet* sheet, const floatv z, const floatv share, floatv* nx,
                           floatv* ny, floatv* nz) {
  const floatv gx = sheet->nx + (z * sheet->vx - sheet->ux),
               gy = sheet->ny + (z * sheet->vy - sheet->uy),
               gz = sheet->nz + (z * sheet->vz - sheet->uz);
  const floatv scale = share / sqrt(fmax(gx * gx + gy * gy + gz * gz, (floatv)(1e-30f)));
  *nx = gx * scale;
  *ny = gy * scale;
  *nz = gz * scale;
}

// How much of what is shown is of sheet B: where it weighs enough the surface goes over to the
// intersection of both sheets, the farther on a convex crease, the nearer on a concave one. za and zb
// are the sheets' depths.
inline floatv share_of_b(const Sheet* A, const Sheet* B, const floatv za, const floatv zb,
                         const floatv ax, const floatv ay, const floatv az, const float crease) {
  const floatv tiny = (floatv)(1e-30f);
  const floatv va = 1.0f / fmax(A->w, tiny), vb = 1.0f / fmax(B->w, tiny);
  const floatv sb = 1.0f / sqrt(fmax(B->nx * B->nx + B->ny * B->ny + B->nz * B->nz, tiny));
  const floatv hx = B->cx * vb - A->cx * va, hy = B->cy * vb - A->cy * va,
               hz = B->cz * vb - A->cz * va;
  // The mean of each sheet's centre over the other's plane.
  const floatv h = hx * ax + hy * ay + hz * az - (hx * B->nx + hy * B->ny + hz * B->nz) * sb;
  const floatv meeting = SELECT(fmin(za, zb), fmax(za, zb), h < 0.0f);
  const intv takes_b = (meeting == zb) & (fabs(za - zb) <= crease);
  const floatv some = smooth_step(0.03f, 0.15f, B->w / fmax(A->w + B->w, tiny));
  return SELECT(SELECT((floatv)(0.0f), some, takes_b), (floatv)(1.0f), !(A->w > 1e-9f));
}

// Every ray meets the quadrics near it (X: the entering hit, near the reference depth)
// with weights w = e v (1 - D)^4 (4 D + 1), D = |X - foot| / blend radius. n_A is the gradient of
// the heaviest hit, shifted to the mean of those like it; hits whose gradient is near it, sigma =
// smoothstep(n.n_A), are sheet A, the others B. Where the ray meets no fit, the place where the fits
// come nearest to it is shown.
// One work-item per WIDTH samples of a row; a work-group is a tile of 16x16 samples or
// a part of one.
kernel void blend_particles(
    STABLE_REGION(reference, front, owner),  // see Given
    global const float* records,             // [particles][PARTICLE_RECORD]
    global const int* tile_start,            // [tiles + 1]
    global const int* tile_group,            // particles, ascending in each tile
    FOUND(depth, normal, group),             // the heaviest particle
    const Screen screen,
    const Blending blending) {
  const int i = get_global_id(0) * WIDTH, j = get_global_id(1);
  const int tile = tile_under_group(screen.nx);
  if (j >= screen.ny || i >= screen.nx) return;
  Given given;
  if (!load_given(reference, front, owner, records, i, j, screen.nx, &given)) return;
  const Sample s = sample_from(screen, LOADF(given.t), i, j);
  const Listed listed = {records, tile_group, tile_start[tile], tile_start[tile + 1]};

  Cache cache;
  Passed passed;
  intv heaviest = LOADI(given.owner);
  floatv ax = LOADF(given.x), ay = LOADF(given.y), az = LOADF(given.z);
  meet_particles(listed, s, blending.d_max, &cache, &passed, &heaviest, &ax, &ay, &az);
  shift_axis(&cache, listed, s, blending, &ax, &ay, &az);
  Sheet A, B;
  sum_sheets(&cache, listed, s, blending, ax, ay, az, &A, &B);

  const floatv tiny = (floatv)(1e-30f);
  const floatv za = A.t * (1.0f / fmax(A.w, tiny)), zb = B.t * (1.0f / fmax(B.w, tiny));
  const floatv of_b = share_of_b(&A, &B, za, zb, ax, ay, az, blending.crease);
  const floatv of_a = (floatv)(1.0f) - of_b;
  floatv nx, ny, nz, bx, by, bz;
  part_of_normal(&A, za, of_a, &nx, &ny, &nz);
  part_of_normal(&B, zb, of_b, &bx, &by, &bz);
  // No hit: where the fits come nearest to the ray; no fit at all: the region's own depth.
  const intv met = A.w + B.w > 1e-9f, near = passed.w > 1e-9f;
  nx = SELECT(SELECT(ax, passed.nx, near), nx + bx, met);
  ny = SELECT(SELECT(ay, passed.ny, near), ny + by, met);
  nz = SELECT(SELECT(az, passed.nz, near), nz + bz, met);
  const floatv size = 1.0f / sqrt(fmax(nx * nx + ny * ny + nz * nz, tiny));
  const floatv nearest = SELECT(LOADF(given.front), s.t + passed.t / fmax(passed.w, tiny), near);
  const floatv shown = SELECT(nearest, s.t + za * of_a + zb * of_b, met);

  float out_t[WIDTH], out_x[WIDTH], out_y[WIDTH], out_z[WIDTH];
  int out_group[WIDTH];
  STOREF(shown, out_t);
  STOREF(nx * size, out_x);
  STOREF(ny * size, out_y);
  STOREF(nz * size, out_z);
  STOREI(heaviest, out_group);
  const int at = j * screen.nx + i, n = screen.nx * screen.ny;
  for (int k = 0; k < WIDTH; ++k) {
    if (!(given.t[k] < INFINITY)) continue;
    depth[at + k] = out_t[k];
    normal[at + k] = out_x[k];
    normal[n + at + k] = out_y[k];
    normal[2 * n + at + k] = out_z[k];
    group[at + k] = out_group[k];
  }
}
