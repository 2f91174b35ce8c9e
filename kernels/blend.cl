// blend.cl: every sample's ray meets the groups near it; their intersections are blended within a
// sheet and meet in a crease between sheets (paper 2.4.2, Eqs. 6 and 7).
//
// Departs from the paper: the distance in Eq. 7 is taken in space and the weight ends at the
// billboard's edge; the factor 1/b^2 is left out (it lowers the weight of similar groups); and
// b's growth with similarity is taken to its limit: similar groups form a sheet that is averaged,
// two sheets meet in the curve where they intersect (docs/method.md).
//
// A group's record is 24 floats: 0-2 centre, 3-5 normal, 6-15 quadric (see fit.hpp), 16 one over
// the reach squared, 17 one over 2 b^2, 18 weight factor, 19-21 centre raised to the surface, 22
// one over the trust that is part of the weight factor (trust.hpp).
// Groups are listed by tile of 16x16 samples.

#define RECORD 24
#define CACHED 40  // hits kept between the passes over a tile's list; later ones are recomputed

typedef struct {
  floatv tau;     // depth behind the reference depth, particle radii
  floatv weight;  // beta of Eq. 7; 0: no hit
} Hit;

typedef struct {
  floatv ox, oy, dx, dy;  // ray: eye point (o + t d, -t)
  floatv t;               // reference depth
} Sample;

// The gradient of a group's quadric at X from the centre.
inline void gradient_at(global const float* g, const floatv x, const floatv y, const floatv z,
                        floatv* gx, floatv* gy, floatv* gz) {
  *gx = g[7] + 2.0f * g[10] * x + g[13] * y + g[15] * z;
  *gy = g[8] + 2.0f * g[11] * y + g[13] * x + g[14] * z;
  *gz = g[9] + 2.0f * g[12] * z + g[14] * y + g[15] * x;
}

// Where the ray enters the group's fluid, sought from the reference depth.
inline Hit hit_group(global const float* g, const Sample s, const float d_max) {
  const floatv x = s.ox + s.t * s.dx - g[0];
  const floatv y = s.oy + s.t * s.dy - g[1];
  const floatv z = -s.t - g[2];
  floatv gx, gy, gz;
  gradient_at(g, x, y, z, &gx, &gy, &gz);
  // f along the ray: C + B tau + A tau^2; d = (dx, dy, -1)
  const floatv C = g[6] + 0.5f * ((gx + g[7]) * x + (gy + g[8]) * y + (gz + g[9]) * z);
  const floatv B = gx * s.dx + gy * s.dy - gz;
  const floatv A = (g[10] * s.dx + g[13] * s.dy - g[15]) * s.dx + (g[11] * s.dy - g[14]) * s.dy +
                   g[12];
  const floatv D = B * B - 4.0f * A * C;
  const floatv root = sqrt(fmax(D, (floatv)(0.0f)));
  // The root nearest the reference in its stable form; entering where B < 0.
  const floatv tau = 2.0f * C / (root - B);
  const floatv px = x + tau * s.dx - (g[19] - g[0]);
  const floatv py = y + tau * s.dy - (g[20] - g[1]);
  const floatv pz = z - tau - (g[21] - g[2]);
  const floatv squared = px * px + py * py + pz * pz;
  const floatv edge = fmax(1.0f - squared * g[16], (floatv)(0.0f));
  const floatv beta = exp_negative(-squared * g[17]) * edge * edge * g[18];
  Hit hit;
  // Squares of smaller weights would vanish. A miss has depth 0: it may be infinite, and other
  // lanes' hits still add it, times its weight of 0.
  const intv met = (D >= 0.0f) & (B < 0.0f) & (fabs(tau) <= d_max) & (beta > 1e-12f);
  hit.tau = SELECT((floatv)(0.0f), tau, met);
  hit.weight = SELECT((floatv)(0.0f), beta, met);
  return hit;
}

typedef struct {
  floatv depth;            // particle radii; +infinity where no group is met
  floatv nx, ny, nz;       // unit, eye axes
  floatv trust;            // of the groups met, 0 .. 1
  intv group;              // the heaviest
} Blended;

inline Blended blend_at(const Sample s, global const int* list, const int count,
                        global const float* groups, const float d_max, const float4 sheets,
                        const float crease) {
  Hit cache[CACHED];
  int cached_group[CACHED];
  int kept = 0;     // groups in the cache
  int rest = count;  // first listed group that did not fit into it
  floatv best = (floatv)(0.0f);
  intv best_group = (intv)(-1);
  floatv ax = (floatv)(0.0f), ay = (floatv)(0.0f), az = (floatv)(0.0f);
  for (int k = 0; k < count; ++k) {
    const int id = list[k];
    global const float* g = groups + id * RECORD;
    const Hit hit = hit_group(g, s, d_max);
    if (!ANY(hit.weight > 0.0f)) continue;
    if (kept < CACHED) {
      cache[kept] = hit;
      cached_group[kept++] = id;
    } else {
      rest = min(rest, k);
    }
    const intv better = hit.weight > best;
    best = SELECT(best, hit.weight, better);
    best_group = SELECT(best_group, (intv)(id), better);
    ax = SELECT(ax, (floatv)(g[3]), better);
    ay = SELECT(ay, (floatv)(g[4]), better);
    az = SELECT(az, (floatv)(g[5]), better);
  }

  Blended out;
  out.group = best_group;
  if (!ANY(best > 0.0f)) {
    out.depth = (floatv)(INFINITY);
    out.nx = out.ny = out.nz = out.trust = (floatv)(0.0f);
    return out;
  }

  // Two rounds of mean shift to the normal that dominates; then the sums of both sheets.
  floatv wa, ta, cax, cay, caz, gax, gay, gaz;
  floatv trust = (floatv)(0.0f);
  floatv vax, vay, vaz, uax, uay, uaz, vbx, vby, vbz, ubx, uby, ubz;
  floatv wb, tb, cbx, cby, cbz, gbx, gby, gbz, nbx, nby, nbz;
  for (int round = 0; round < 3; ++round) {
    floatv mx = (floatv)(0.0f), my = (floatv)(0.0f), mz = (floatv)(0.0f);
    wa = ta = cax = cay = caz = gax = gay = gaz = (floatv)(0.0f);
    vax = vay = vaz = uax = uay = uaz = vbx = vby = vbz = ubx = uby = ubz = (floatv)(0.0f);
    wb = tb = cbx = cby = cbz = gbx = gby = gbz = nbx = nby = nbz = (floatv)(0.0f);
    const int total = kept + (count - rest);
    for (int k = 0; k < total; ++k) {
      const int id = k < kept ? cached_group[k] : list[rest + k - kept];
      global const float* g = groups + id * RECORD;
      const Hit hit = k < kept ? cache[k] : hit_group(g, s, d_max);
      const floatv same = smooth_step(sheets.x, sheets.y, ax * g[3] + ay * g[4] + az * g[5]);
      const floatv a = hit.weight * same, b = hit.weight - a;
      mx += a * g[3];
      my += a * g[4];
      mz += a * g[5];
      if (round < 2) continue;
      trust += hit.weight * g[22];
      const floatv t = s.t + hit.tau;
      floatv gx, gy, gz;
      gradient_at(g, s.ox + t * s.dx - g[0], s.oy + t * s.dy - g[1], -t - g[2], &gx, &gy, &gz);
      // Half the weight's own gradient times how f changes along the ray (see the normal below).
      const floatv qx = s.ox + t * s.dx - g[19], qy = s.oy + t * s.dy - g[20], qz = -t - g[21];
      const floatv edge = fmax(1.0f - (qx * qx + qy * qy + qz * qz) * g[16], (floatv)(1e-3f));
      const floatv pull = -(g[17] + 2.0f * g[16] / edge) * (gx * s.dx + gy * s.dy - gz);
      const floatv pa = a * pull, pb = b * pull;
      vax += pa * qx;
      vay += pa * qy;
      vaz += pa * qz;
      uax += pa * qx * hit.tau;
      uay += pa * qy * hit.tau;
      uaz += pa * qz * hit.tau;
      vbx += pb * qx;
      vby += pb * qy;
      vbz += pb * qz;
      ubx += pb * qx * hit.tau;
      uby += pb * qy * hit.tau;
      ubz += pb * qz * hit.tau;
      wa += a;
      ta += a * hit.tau;
      cax += a * g[0];
      cay += a * g[1];
      caz += a * g[2];
      gax += a * gx;
      gay += a * gy;
      gaz += a * gz;
      wb += b;
      tb += b * hit.tau;
      cbx += b * g[0];
      cby += b * g[1];
      cbz += b * g[2];
      gbx += b * gx;
      gby += b * gy;
      gbz += b * gz;
      nbx += b * g[3];
      nby += b * g[4];
      nbz += b * g[5];
    }
    const floatv size = sqrt(fmax(mx * mx + my * my + mz * mz, (floatv)(1e-30f)));
    if (round < 2) {
      ax = mx / size;
      ay = my / size;
      az = mz / size;
    }
  }

  const floatv va = 1.0f / fmax(wa, (floatv)(1e-30f)), vb = 1.0f / fmax(wb, (floatv)(1e-30f));
  const floatv za = ta * va, zb = tb * vb;
  const floatv nb = 1.0f / sqrt(fmax(nbx * nbx + nby * nby + nbz * nbz, (floatv)(1e-30f)));
  const floatv dx = cbx * vb - cax * va, dy = cby * vb - cay * va, dz = cbz * vb - caz * va;
  const floatv b_over_a = dx * ax + dy * ay + dz * az;             // B's centre above A's plane
  const floatv a_over_b = -(dx * nbx + dy * nby + dz * nbz) * nb;  // A's centre above B's plane
  // The sheets' distance across the flatter view of them: along a grazing ray depths differ more.
  const floatv slope_a = fabs(gax * s.dx + gay * s.dy - gaz) /
                         sqrt(fmax(gax * gax + gay * gay + gaz * gaz, (floatv)(1e-30f)));
  const floatv slope_b = fabs(gbx * s.dx + gby * s.dy - gbz) /
                         sqrt(fmax(gbx * gbx + gby * gby + gbz * gbz, (floatv)(1e-30f)));
  const intv meet = (wb > sheets.z * wa) & (fabs(za - zb) * fmin(slope_a, slope_b) < crease);
  const intv convex = meet & (b_over_a < 0.0f) & (a_over_b < 0.0f) & (zb > za);
  const intv concave = meet & (b_over_a > 0.0f) & (a_over_b > 0.0f) & (zb < za);
  const intv take_b = convex | concave;
  out.depth = SELECT((floatv)(INFINITY), s.t + SELECT(za, zb, take_b), best > 0.0f);
  // The normal is the gradient of sum(beta f) / sum(beta) at the blended point X:
  // sum(beta grad f + f grad beta), with f(X) = (depth - t_k) (grad f . d) to first order. The
  // whole second term carries the fits' noise into the normal, without it waves look too flat: half
  // of it has the smallest error (median .92 degrees over seven scenes; 0: .93, all: .99; waves
  // 1.8, 2.5, 1.6).
  const floatv gx = SELECT(gax + (za * vax - uax), gbx + (zb * vbx - ubx), take_b);
  const floatv gy = SELECT(gay + (za * vay - uay), gby + (zb * vby - uby), take_b);
  const floatv gz = SELECT(gaz + (za * vaz - uaz), gbz + (zb * vbz - ubz), take_b);
  const floatv size = 1.0f / sqrt(fmax(gx * gx + gy * gy + gz * gz, (floatv)(1e-30f)));
  out.nx = gx * size;
  out.ny = gy * size;
  out.nz = gz * size;
  // The mean trust under the weights without it; what only rounding keeps from 1 is 1.
  out.trust = fmin(1.001f * (wa + wb) / fmax(trust, (floatv)(1e-30f)), (floatv)(1.0f));
  return out;
}

// The same at a list of positions: one work-item per point, WIDTH 1.
#if WIDTH == 1
kernel void blend_points(global const float* reference,  // [n] depth; +inf: leave the point
                         global const float* points,     // [2][n] u, v, pixels
                         global const float* groups, global const int* tile_start,
                         global const int* tile_group, global float* depth,
                         global float* normal,  // [3][n]
                         global int* group, global float* trust, const int n,
                         const int2 tiles,  // of the grid whose lists these are
                         const float first, const float inverse_tile,  // pixels
                         const float16 rays, const float d_max, const float4 sheets,
                         const float crease) {
  const int p = get_global_id(0);
  if (p >= n || !(reference[p] < INFINITY)) return;
  const float u = points[p], v = points[n + p];
  const int i = clamp((int)((u - first) * inverse_tile), 0, tiles.x - 1);
  const int j = clamp((int)((v - first) * inverse_tile), 0, tiles.y - 1);
  const int tile = j * tiles.x + i;
  const int begin = tile_start[tile];
  Sample s;
  s.t = reference[p];
  s.ox = rays.s0 + rays.s1 * u + rays.s2 * v;
  s.oy = rays.s3 + rays.s4 * u + rays.s5 * v;
  s.dx = rays.s6 + rays.s7 * u + rays.s8 * v;
  s.dy = rays.s9 + rays.sa * u + rays.sb * v;
  const Blended b = blend_at(s, tile_group + begin, tile_start[tile + 1] - begin, groups, d_max,
                             sheets, crease);
  depth[p] = b.depth;
  normal[p] = b.nx;
  normal[n + p] = b.ny;
  normal[2 * n + p] = b.nz;
  group[p] = b.group;
  trust[p] = b.trust;
}
#endif

// One work-item per WIDTH samples of a row; a work-group is a tile of 16x16 samples, so that the
// bounds of the list are the same for all its items.
kernel void blend_groups(global const float* reference,  // [samples] depth; +inf: leave the sample
                         global const float* groups,     // [groups][RECORD]
                         global const int* tile_start,   // [tiles + 1]
                         global const int* tile_group,   // group ids, ascending in each tile
                         global float* depth,            // [samples] out where reference is finite
                         global float* normal,           // [3][samples]
                         global int* group,              // [samples]
                         global float* trust,            // [samples]
                         const int2 samples, const float first, const float step,
                         const float16 rays, const float d_max,
                         const float4 sheets,   // same_low, same_high, other_share
                         const float crease) {  // particle radii
  const int i = get_global_id(0) * WIDTH, j = get_global_id(1);
  const int tile = get_group_id(1) * get_num_groups(0) + get_group_id(0);
  const int begin = tile_start[tile], count = tile_start[tile + 1] - begin;
  if (j >= samples.y || i >= samples.x) return;
  const int at = j * samples.x + i;
  const int n = samples.x * samples.y;

  Sample s;
#if WIDTH == 1
  s.t = reference[at];
#else
  // The last item of a row may reach past it.
  float part[WIDTH];
#pragma unroll
  for (int k = 0; k < WIDTH; ++k) part[k] = i + k < samples.x ? reference[at + k] : INFINITY;
  s.t = LOADF(part);
#endif
  const intv wanted = s.t < INFINITY;
  if (!ANY(wanted)) return;
  s.t = SELECT((floatv)(1.0f), s.t, wanted);
  const floatv u = first + step * ((float)i + LANES);
  const float v = first + step * (float)j;
  s.ox = rays.s0 + rays.s1 * u + rays.s2 * v;
  s.oy = rays.s3 + rays.s4 * u + rays.s5 * v;
  s.dx = rays.s6 + rays.s7 * u + rays.s8 * v;
  s.dy = rays.s9 + rays.sa * u + rays.sb * v;
  const Blended b = blend_at(s, tile_group + begin, count, groups, d_max, sheets, crease);
#if WIDTH == 1
  depth[at] = b.depth;
  normal[at] = b.nx;
  normal[n + at] = b.ny;
  normal[2 * n + at] = b.nz;
  group[at] = b.group;
  trust[at] = b.trust;
#else
  float t[WIDTH], x[WIDTH], y[WIDTH], z[WIDTH], c[WIDTH];
  int id[WIDTH], w[WIDTH];
  STOREF(b.depth, t);
  STOREF(b.nx, x);
  STOREF(b.ny, y);
  STOREF(b.nz, z);
  STOREF(b.trust, c);
  STOREI(b.group, id);
  STOREI(wanted, w);
#pragma unroll
  for (int k = 0; k < WIDTH; ++k) {
    if (!w[k] || i + k >= samples.x) continue;
    depth[at + k] = t[k];
    normal[at + k] = x[k];
    normal[n + at + k] = y[k];
    normal[2 * n + at + k] = z[k];
    group[at + k] = id[k];
    trust[at + k] = c[k];
  }
#endif
}
