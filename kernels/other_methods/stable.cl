// stable.cl: the surface of one quadric per visible particle: which samples it covers and which
// particle owns each (paper 2.4.1), and the blend of the quadrics there (paper 2.4.2).
//
// Departs from the paper: groups are single particles, so nothing jumps when groups merge
// differently; and Eqs. 3 to 5, which shrink the region, are replaced by capsules along its contour
// and a closing by a disc (docs/method.md).
//
// A particle's record is 24 floats: 0-2 position, 3-5 normal, 6-15 quadric (see
// fit.hpp), 16 one over the blend radius squared, 18 weight e v (0: no fit), 19-21 foot;
// the others are not used.
// Depth maps are positive floats, whose bits order like integers: the nearest is kept by
// atomic_min, then the lowest owner among the equally near.

#define PARTICLE_RECORD 24

// --- Region --------------------------------------------------------------------------------------

// Samples between two pixel coordinates: first and last, clamped to the grid.
inline int2 samples_between(const float low, const float high, const float first, const float step,
                            const int n) {
  return (int2)(max(0, (int)ceil(clamp((low - first) / step, -1.0f, 1e6f))),
                min(n - 1, (int)floor(clamp((high - first) / step, -1.0f, 1e6f))));
}

// Triangles: depth at every sample, and as its owner the corner with the largest barycentric
// coordinate times the corner's edge factor. One work-item per triangle. With owner_pass 0 the
// depths are drawn, with 1 the owners where the depth is the drawn one.
kernel void own_triangles(global const float* corners,  // [12][stride] u, v, t, e of three corners
                          global const int* particle,   // [3][stride] owner that a corner stands for
                          OWNED(depth, owner),  // bits of the depth, +inf before; INT_MAX before
                          const int n, const int stride, const Lattice samples,
                          const int perspective, const int owner_pass) {
  const int k = get_global_id(0);
  if (k >= n) return;
  float u[3], v[3], t[3], e[3];
#pragma unroll
  for (int c = 0; c < 3; ++c) {
    u[c] = corners[(4 * c) * stride + k];
    v[c] = corners[(4 * c + 1) * stride + k];
    t[c] = corners[(4 * c + 2) * stride + k];
    e[c] = corners[(4 * c + 3) * stride + k];
    if (perspective) t[c] = 1.0f / t[c];
  }
  const float doubled = (u[1] - u[0]) * (v[2] - v[0]) - (u[2] - u[0]) * (v[1] - v[0]);
  if (fabs(doubled) < 1e-9f) return;
  const float inverse = 1.0f / doubled;
  const int2 is = samples_between(fmin(u[0], fmin(u[1], u[2])), fmax(u[0], fmax(u[1], u[2])),
                                  samples.first, samples.step, samples.nx);
  const int2 js = samples_between(fmin(v[0], fmin(v[1], v[2])), fmax(v[0], fmax(v[1], v[2])),
                                  samples.first, samples.step, samples.ny);
  for (int j = js.x; j <= js.y; ++j)
    for (int i = is.x; i <= is.y; ++i) {
      const float x = samples.first + samples.step * (float)i,
                  y = samples.first + samples.step * (float)j;
      const float l1 = ((x - u[0]) * (v[2] - v[0]) - (u[2] - u[0]) * (y - v[0])) * inverse;
      const float l2 = ((u[1] - u[0]) * (y - v[0]) - (x - u[0]) * (v[1] - v[0])) * inverse;
      const float l0 = 1.0f - l1 - l2;
      if (l0 < -1e-5f || l1 < -1e-5f || l2 < -1e-5f) continue;
      float d = l0 * t[0] + l1 * t[1] + l2 * t[2];
      if (perspective) d = 1.0f / d;
      if (!(d > 0.0f)) continue;
      const int s = j * samples.nx + i;
      if (!owner_pass) {
        atomic_min(depth + s, as_uint(d));
      } else if (depth[s] == as_uint(d)) {
        const float q0 = l0 * e[0], q1 = l1 * e[1], q2 = l2 * e[2];
        const int c = q0 >= q1 && q0 >= q2 ? 0 : q1 >= q2 ? 1 : 2;
        atomic_min(owner + s, particle[c * stride + k]);
      }
    }
}

// Where the ray enters the fluid of a quadric, from depth t on: the root of f = C + B tau + A tau^2
// at which f falls, in its stable form. `miss` receives D < 0: the ray passes the fluid.
inline float entering_root(const float A, const float B, const float C, int* miss) {
  const float D = B * B - 4.0f * A * C;
  *miss = D < 0.0f;
  const float root = sqrt(fmax(D, 0.0f));
  return B < 0.0f ? 2.0f * C / (root - B) : fabs(A) > 1e-12f ? -(B + root) / (2.0f * A) : INFINITY;
}

typedef struct {
  float t;           // depth; +infinity where the ray does not enter
  float gx, gy, gz;  // gradient there, not of unit length
} Entry;

inline Entry enter(global const float* g, const Ray r, const float t) {
  const float x = r.ox + t * r.dx - g[0], y = r.oy + t * r.dy - g[1], z = -t - g[2];
  const float gx = g[7] + 2.0f * g[10] * x + g[13] * y + g[15] * z;
  const float gy = g[8] + 2.0f * g[11] * y + g[13] * x + g[14] * z;
  const float gz = g[9] + 2.0f * g[12] * z + g[14] * y + g[15] * x;
  const float C = g[6] + 0.5f * ((gx + g[7]) * x + (gy + g[8]) * y + (gz + g[9]) * z);
  const float B = gx * r.dx + gy * r.dy - gz;
  const float A = (g[10] * r.dx + g[13] * r.dy - g[15]) * r.dx +
                  (g[11] * r.dy - g[14]) * r.dy + g[12];
  int miss;
  const float tau = entering_root(A, B, C, &miss);
  Entry entry;
  entry.t = miss ? INFINITY : t + tau;
  const float ex = x + tau * r.dx, ey = y + tau * r.dy, ez = z - tau;
  entry.gx = g[7] + 2.0f * g[10] * ex + g[13] * ey + g[15] * ez;
  entry.gy = g[8] + 2.0f * g[11] * ey + g[13] * ex + g[14] * ez;
  entry.gz = g[9] + 2.0f * g[12] * ez + g[14] * ey + g[15] * ex;
  return entry;
}

// Capsules along the contour: every sample whose ray passes within `radius` of the edge between
// particles a and b, and there either within one particle radius, or enters the quadric of one of
// them within 1 (faced) to 1.8 (grazed) radii of the edge, measured along the surface. Samples on
// triangles at like depth, or in front, are left alone. One work-item per edge.
kernel void own_capsules(global const float* ends,       // [8][stride] u, v, t, pixels per radius
                                                         // along u of both particles
                         global const int* particle,     // [2][stride]
                         global const float* records,    // [particles][PARTICLE_RECORD]
                         global const float* triangles,  // [samples] depth of own_triangles
                         OWNED(depth, owner),            // as of own_triangles
                         const Capsules capsules, const Screen screen, const int owner_pass) {
  const int n = capsules.count, stride = capsules.stride;
  const float aspect = capsules.aspect, radius = capsules.radius, apart = capsules.apart;
  const float first = screen.first, step = screen.step;
  const int k = get_global_id(0);
  if (k >= n) return;
  const float ua = ends[k], va = ends[stride + k] * aspect, ta = ends[2 * stride + k],
              ka = ends[3 * stride + k];
  const float ub = ends[4 * stride + k], vb = ends[5 * stride + k] * aspect,
              tb = ends[6 * stride + k], kb = ends[7 * stride + k];
  const int a = particle[k], b = particle[stride + k];
  global const float* ga = records + a * PARTICLE_RECORD;
  global const float* gb = records + b * PARTICLE_RECORD;
  const float reach = fmax(ka, kb) * radius;
  const int2 is = samples_between(fmin(ua, ub) - reach, fmax(ua, ub) + reach, first, step,
                                  screen.nx);
  const int2 js = samples_between((fmin(va, vb) - reach) / aspect, (fmax(va, vb) + reach) / aspect,
                                  first, step, screen.ny);
  const float eu = ub - ua, ev = vb - va, square = eu * eu + ev * ev;
  const float ex = gb[0] - ga[0], ey = gb[1] - ga[1], ez = gb[2] - ga[2];
  const float space = ex * ex + ey * ey + ez * ez;
  for (int j = js.x; j <= js.y; ++j)
    for (int i = is.x; i <= is.y; ++i) {
      const float u = first + step * (float)i, v = first + step * (float)j;
      const float du = u - ua, dv = v * aspect - va;
      const float f = square > 1e-12f ? clamp((du * eu + dv * ev) / square, 0.0f, 1.0f) : 0.0f;
      const float pu = du - f * eu, pv = dv - f * ev, scale = ka + f * (kb - ka);
      const float squared = (pu * pu + pv * pv) / (scale * scale);
      if (squared > radius * radius) continue;
      const float t = ta + f * (tb - ta);
      const int s = j * screen.nx + i;
      if (triangles[s] - t + 1.0f < apart) continue;
      float z = INFINITY;
      int by = f < 0.5f ? a : b;
      if (squared <= 1.0f) {
        z = t - sqrt(1.0f - squared);
      } else {
        const Ray r = ray_at(screen.rays, u, v);
        for (int end = 0; end < 2 && z == INFINITY; ++end) {
          const int p = end == 0 ? by : a + b - by;
          global const float* g = records + p * PARTICLE_RECORD;
          if (g[18] == 0.0f) continue;
          const Entry entry = enter(g, r, t);
          if (!(fabs(entry.t - t) <= 3.0f) || !(entry.t > 0.0f)) continue;
          const float x = r.ox + entry.t * r.dx - ga[0], y = r.oy + entry.t * r.dy - ga[1],
                      w = -entry.t - ga[2];
          const float along =
              space > 1e-12f ? clamp((x * ex + y * ey + w * ez) / space, 0.0f, 1.0f) : 0.0f;
          const float rx = x - along * ex, ry = y - along * ey, rz = w - along * ez;
          const float slope = fmax(
              sqrt(entry.gx * entry.gx + entry.gy * entry.gy + entry.gz * entry.gz), 1e-12f);
          const float height = (rx * entry.gx + ry * entry.gy + rz * entry.gz) / slope;
          const float facing = fabs(entry.gx * r.dx + entry.gy * r.dy - entry.gz) /
                               (slope * sqrt(1.0f + r.dx * r.dx + r.dy * r.dy));
          const float faced = clamp((facing - 0.15f) / 0.35f, 0.0f, 1.0f);
          const float most = 1.8f - 0.8f * (faced * faced * (3.0f - 2.0f * faced));
          if (rx * rx + ry * ry + rz * rz - height * height <= most * most &&
              fabs(height) <= 2.0f) {
            z = entry.t;
            by = p;
          }
        }
      }
      if (!(z < INFINITY) || !(z > 0.0f)) continue;
      if (!owner_pass) atomic_min(depth + s, as_uint(z));
      else if (depth[s] == as_uint(z)) atomic_min(owner + s, by);
    }
}

// Puts both maps together: the capsules count off the triangles and well in front of them.
// `front` is the depth to show where no fit is met.
kernel void join_region(global float* depth,                // [samples] triangles' in, reference out
                        global int* owner,                  // [samples] in and out; -1: none
                        global float* front,                // [samples] out
                        global const float* capsule_depth,  // [samples]
                        global const int* capsule_owner,    // [samples]
                        const int n, const float apart, const float offset) {
  const int s = get_global_id(0);
  if (s >= n) return;
  const float t = owner[s] < INT_MAX ? depth[s] : INFINITY, c = capsule_depth[s];
  const int capsule = capsule_owner[s] < INT_MAX && t - c > apart;
  depth[s] = capsule ? c + 0.5f * offset : t;
  front[s] = capsule ? c : t - offset;
  owner[s] = capsule ? capsule_owner[s] : t < INFINITY ? owner[s] : -1;
}

// The nearest column of each sample's row in which `map` is negative or not (`sign` 1: negative,
// 0: not), -1 beyond `reach`; of two equally near the left one.
kernel void find_in_rows(global const int* map, global int* column, const int2 samples,
                         const int reach, const int sign) {
  const int i = get_global_id(0), j = get_global_id(1);
  if (i >= samples.x || j >= samples.y) return;
  global const int* row = map + j * samples.x;
  int found = -1;
  for (int d = 0; d <= reach && found < 0; ++d) {
    if (i - d >= 0 && (row[i - d] < 0) == sign) found = i - d;
    else if (i + d < samples.x && (row[i + d] < 0) == sign) found = i + d;
  }
  column[j * samples.x + i] = found;
}

// The nearest of those samples in the plane, -1 where none lies within the square root of
// `squared`; of equally near ones the first row.
kernel void find_in_columns(global const int* column, global int* nearest, const int2 samples,
                            const int reach, const float squared) {
  const int i = get_global_id(0), j = get_global_id(1);
  if (i >= samples.x || j >= samples.y) return;
  int found = -1;
  float best = squared;
  for (int y = max(0, j - reach); y <= min(samples.y - 1, j + reach); ++y) {
    const int x = column[y * samples.x + i];
    if (x < 0) continue;
    const float d = (float)((x - i) * (x - i) + (y - j) * (y - j));
    if (d < best || (found < 0 && d == best)) {
      best = d;
      found = y * samples.x + x;
    }
  }
  nearest[j * samples.x + i] = found;
}

// Closes the region: samples that are near covered ones (`covered`: the nearest) and not near any
// that is far from all covered ones (`far` < 0) are filled from the nearest.
kernel void fill_gaps(global float* depth, global int* owner, global float* front,
                      global const int* covered, global const int* far, const int n,
                      const float offset) {
  const int s = get_global_id(0);
  if (s >= n) return;
  const int from = covered[s];
  if (depth[s] < INFINITY || from < 0 || far[s] >= 0) return;
  // Only samples without depth are written and only ones with depth are read.
  depth[s] = depth[from];
  front[s] = depth[from] - 0.5f * offset;
  owner[s] = owner[from];
}

// --- Blend ---------------------------------------------------------------------------------------

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
