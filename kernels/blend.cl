// blend.cl: every sample's ray meets the fits near it; their intersections are blended within a
// sheet and meet in a crease between sheets (paper 2.4.2, Eqs. 6 and 7).
//
// Departs from the paper: the distance in Eq. 7 is taken in space and the weight ends at a fit's
// reach; the factor 1/b^2 is left out (it lowers the weight of similar groups); and b's growth with
// similarity is taken to its limit: similar fits form a sheet that is averaged, two sheets meet in
// the curve where they intersect. Sheets that turn away from the eye end the surface in the same way
// (docs/method.md).
//
// A fit's record is 24 floats: 0-2 particle, 3-5 normal, 6-15 quadric (see fit.hpp), 16 one over the
// reach squared, 17 weight where the fluid ends, 18 weight in the blend, 19-21 foot, 22 one over the
// trust that is part of the weights (trust.hpp).
// Fits are listed by tile of 16x16 samples.

#define RECORD 24
#define CACHED 48  // hits kept between the passes over a tile's list; later ones are found again

typedef struct {
  floatv sx, sy, t;  // point of the ray at the reference depth: eye (sx, sy, -t)
  floatv dx, dy;     // direction (dx, dy, -1)
} Sample;

typedef struct {
  floatv tau;         // depth behind the reference depth, particle radii
  floatv weight;      // of the fit there; 0: no hit
  floatv gx, gy, gz;  // unit gradient there
} Hit;

// The gradient of a fit's quadric at X from its particle.
inline void gradient_at(global const float* g, const floatv x, const floatv y, const floatv z,
                        floatv* gx, floatv* gy, floatv* gz) {
  *gx = g[7] + 2.0f * g[10] * x + g[13] * y + g[15] * z;
  *gy = g[8] + 2.0f * g[11] * y + g[13] * x + g[14] * z;
  *gz = g[9] + 2.0f * g[12] * z + g[14] * y + g[15] * x;
}

// Where the ray enters a fit's fluid.
inline Hit hit_fit(global const float* g, const Sample s, const float d_max) {
  const floatv none = (floatv)(0.0f);
  const floatv x = s.sx - g[0], y = s.sy - g[1], z = -s.t - g[2];
  floatv gx, gy, gz;
  gradient_at(g, x, y, z, &gx, &gy, &gz);
  // f along the ray: C + B tau + A tau^2
  const floatv C = g[6] + 0.5f * ((gx + g[7]) * x + (gy + g[8]) * y + (gz + g[9]) * z);
  const floatv B = gx * s.dx + gy * s.dy - gz;
  const floatv A = (g[10] * s.dx + g[13] * s.dy - g[15]) * s.dx + (g[11] * s.dy - g[14]) * s.dy +
                   g[12];
  const floatv D = B * B - 4.0f * A * C;
  const floatv root = sqrt(fmax(D, none));
  // The entering root in its stable form: f falls there.
  const floatv bent = SELECT((floatv)(1.0f), A, fabs(A) > 1e-12f);
  floatv tau = SELECT(-(B + root) / (2.0f * bent), 2.0f * C / (root - B), B < 0.0f);
  intv met = (D >= 0.0f) & (fabs(tau) <= 4.0f * d_max) & ((B < 0.0f) | (fabs(A) > 1e-12f));
  tau = SELECT(none, tau, met);
  const floatv px = x + tau * s.dx, py = y + tau * s.dy, pz = z - tau;
  const floatv fx = px + (g[0] - g[19]), fy = py + (g[1] - g[20]), fz = pz + (g[2] - g[21]);
  const floatv squared = (fx * fx + fy * fy + fz * fz) * g[16];
  const floatv d = sqrt(fmin(squared, (floatv)(1.0f)));
  const floatv q = (1.0f - d) * (1.0f - d);
  gradient_at(g, px, py, pz, &gx, &gy, &gz);
  const floatv slope = 1.0f / sqrt(fmax(gx * gx + gy * gy + gz * gz, (floatv)(1e-20f)));
  Hit hit;
  hit.tau = tau;
  // A grazing ray enters far before the reference, which lies inside: there depths count less.
  const floatv facing = fabs(gx * s.dx + gy * s.dy - gz) * slope;
  met &= fabs(tau) * fmin(2.0f * facing, (floatv)(1.0f)) <= d_max;
  hit.weight = SELECT(none, q * q * (4.0f * d + 1.0f) * g[18], met);
  hit.gx = gx * slope;
  hit.gy = gy * slope;
  hit.gz = gz * slope;
  return hit;
}

// Whether any ray passes a fit's foot within its reach. A hundredth more is let through, so that
// rounding, which depends on no width, never decides about a hit with weight.
inline int in_reach(global const float* g, const Sample s) {
  const floatv x = s.sx - g[19], y = s.sy - g[20], z = -s.t - g[21];
  const floatv along = x * s.dx + y * s.dy - z, squared = s.dx * s.dx + s.dy * s.dy + 1.0f;
  const floatv apart = (x * x + y * y + z * z) * squared - along * along;
  return ANY(apart * g[16] < 1.01f * squared);
}

typedef struct {
  floatv depth;       // particle radii; +infinity where no fit is met
  floatv nx, ny, nz;  // unit, eye axes
  floatv trust;       // of the fits met, 0 .. 1, plus ON_EDGE or ENDED
  intv group;         // the heaviest
} Blended;

#define ON_EDGE 2.0f  // at a convex crease: the density is low there although the sheets go on
#define ENDED 4.0f    // beyond a convex edge of the fluid

inline Blended blend_at(const Sample s, global const int* list, const int count,
                        global const float* groups, const float d_max, const float4 sheets) {
  Hit cache[CACHED];
  int cached_group[CACHED];
  int kept = 0;      // hits in the cache
  int rest = count;  // first listed fit that did not fit into it
  floatv best = (floatv)(0.0f);
  intv best_group = (intv)(-1);
  floatv ax = (floatv)(0.0f), ay = (floatv)(0.0f), az = (floatv)(0.0f);
  for (int k = 0; k < count; ++k) {
    const int id = list[k];
    global const float* g = groups + id * RECORD;
    if (!(g[18] > 0.0f) || !in_reach(g, s)) continue;
    const Hit hit = hit_fit(g, s, d_max);
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
    ax = SELECT(ax, hit.gx, better);
    ay = SELECT(ay, hit.gy, better);
    az = SELECT(az, hit.gz, better);
  }

  Blended out;
  out.group = best_group;
  if (!ANY(best > 0.0f)) {
    out.depth = (floatv)(INFINITY);
    out.nx = out.ny = out.nz = out.trust = (floatv)(0.0f);
    return out;
  }

  // Two rounds of mean shift to the gradient that dominates; then the sums of both sheets.
  floatv wa, ta, cax, cay, caz, nax, nay, naz;
  floatv wb, tb, cbx, cby, cbz, nbx, nby, nbz;
  floatv vax, vay, vaz, uax, uay, uaz, vbx, vby, vbz, ubx, uby, ubz;
  floatv trust = (floatv)(0.0f);
  for (int round = 0; round < 3; ++round) {
    wa = ta = cax = cay = caz = nax = nay = naz = (floatv)(0.0f);
    wb = tb = cbx = cby = cbz = nbx = nby = nbz = (floatv)(0.0f);
    vax = vay = vaz = uax = uay = uaz = vbx = vby = vbz = ubx = uby = ubz = (floatv)(0.0f);
    const int total = kept + (count - rest);
    for (int k = 0; k < total; ++k) {
      const int id = k < kept ? cached_group[k] : list[rest + k - kept];
      global const float* g = groups + id * RECORD;
      if (!(g[18] > 0.0f)) continue;
      const Hit hit = k < kept ? cache[k] : hit_fit(g, s, d_max);
      const floatv same = smooth_step(sheets.x, sheets.y, hit.gx * ax + hit.gy * ay + hit.gz * az);
      const floatv a = hit.weight * same, b = hit.weight - a;
      nax += a * hit.gx;
      nay += a * hit.gy;
      naz += a * hit.gz;
      if (round < 2) continue;
      trust += hit.weight * g[22];
      wa += a;
      ta += a * hit.tau;
      cax += a * g[19];
      cay += a * g[20];
      caz += a * g[21];
      wb += b;
      tb += b * hit.tau;
      cbx += b * g[19];
      cby += b * g[20];
      cbz += b * g[21];
      nbx += b * hit.gx;
      nby += b * hit.gy;
      nbz += b * hit.gz;
      // Half the weight's own gradient times how f changes along the ray (see the normal below).
      const floatv qx = s.sx + hit.tau * s.dx - g[19], qy = s.sy + hit.tau * s.dy - g[20],
                   qz = -(s.t + hit.tau) - g[21];
      const floatv d = sqrt(fmin((qx * qx + qy * qy + qz * qz) * g[16], (floatv)(1.0f)));
      const floatv pull = -10.0f * g[16] / ((1.0f - d) * (4.0f * d + 1.0f) + 1e-6f) *
                          (hit.gx * s.dx + hit.gy * s.dy - hit.gz);
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
    }
    if (round == 2) break;
    const floatv size = nax * nax + nay * nay + naz * naz;
    const floatv scale = 1.0f / sqrt(fmax(size, (floatv)(1e-30f)));
    ax = SELECT(ax, nax * scale, size > 1e-30f);
    ay = SELECT(ay, nay * scale, size > 1e-30f);
    az = SELECT(az, naz * scale, size > 1e-30f);
  }

  const floatv tiny = (floatv)(1e-30f);
  const floatv va = 1.0f / fmax(wa, tiny), vb = 1.0f / fmax(wb, tiny);
  const floatv za = ta * va, zb = tb * vb;
  const floatv sb = 1.0f / sqrt(fmax(nbx * nbx + nby * nby + nbz * nbz, tiny));
  const floatv hx = cbx * vb - cax * va, hy = cby * vb - cay * va, hz = cbz * vb - caz * va;
  // The mean of each sheet's centre over the other's plane.
  const floatv h = hx * ax + hy * ay + hz * az - (hx * nbx + hy * nby + hz * nbz) * sb;
  const floatv meeting = SELECT(fmin(za, zb), fmax(za, zb), h < 0.0f);
  const intv takes_b = (meeting == zb) & (fabs(za - zb) <= sheets.z);
  const intv only_b = !(wa > 1e-9f * wb);
  floatv share = smooth_step(0.003f, 0.02f, wb / fmax(wa + wb, tiny));
  share = SELECT((floatv)(0.0f), share, takes_b);
  share = SELECT(share, (floatv)(1.0f), only_b);
  const floatv rest_share = (floatv)(1.0f) - share;
  out.depth = SELECT((floatv)(INFINITY), s.t + za * rest_share + zb * share, best > 0.0f);
  // The normal is the gradient of sum(w f) / sum(w) at the blended point, sum(w grad f + f grad w),
  // with f = (depth - t_k) (grad f . d) to first order. The whole second term carries the fits' noise
  // into the normal, without it waves look too flat: half of it has the smallest error (median .88
  // degrees over seven scenes; 0: .93, all: .97; waves 2.2, 3.2, 1.8).
  const floatv gax = nax + (za * vax - uax), gay = nay + (za * vay - uay),
               gaz = naz + (za * vaz - uaz);
  const floatv gbx = nbx + (zb * vbx - ubx), gby = nby + (zb * vby - uby),
               gbz = nbz + (zb * vbz - ubz);
  const floatv la = rest_share / sqrt(fmax(gax * gax + gay * gay + gaz * gaz, tiny));
  const floatv lb = share / sqrt(fmax(gbx * gbx + gby * gby + gbz * gbz, tiny));
  const floatv nx = gax * la + gbx * lb, ny = gay * la + gby * lb, nz = gaz * la + gbz * lb;
  const floatv size = 1.0f / sqrt(fmax(nx * nx + ny * ny + nz * nz, tiny));
  out.nx = nx * size;
  out.ny = ny * size;
  out.nz = nz * size;
  // Where the fluid turns away from the eye no ray enters it, and hidden fits tell of sheet R. A
  // convex edge between the surface and R ends the surface where it leaves R's fluid.
  const floatv end = out.depth - s.t, ex = s.sx + end * s.dx, ey = s.sy + end * s.dy;
  floatv wr = (floatv)(0.0f), fr = wr, crx = wr, cry = wr, crz = wr, nrx = wr, nry = wr, nrz = wr;
  for (int k = 0; k < count; ++k) {
    global const float* g = groups + list[k] * RECORD;
    if (!(g[17] > 0.0f) || !in_reach(g, s)) continue;
    const floatv fx = ex - g[19], fy = ey - g[20], fz = -out.depth - g[21];
    const floatv squared = (fx * fx + fy * fy + fz * fz) * g[16];
    if (!ANY(squared < 1.0f)) continue;
    const floatv x = ex - g[0], y = ey - g[1], z = -out.depth - g[2];
    floatv gx, gy, gz;
    gradient_at(g, x, y, z, &gx, &gy, &gz);
    const floatv slope = 1.0f / sqrt(fmax(gx * gx + gy * gy + gz * gz, (floatv)(1e-20f)));
    const floatv f =
        (g[6] + 0.5f * ((gx + g[7]) * x + (gy + g[8]) * y + (gz + g[9]) * z)) * slope;
    gx *= slope;
    gy *= slope;
    gz *= slope;
    const floatv same =
        smooth_step(sheets.x, sheets.y, gx * out.nx + gy * out.ny + gz * out.nz);
    const floatv d = sqrt(fmin(squared, (floatv)(1.0f)));
    const floatv q = (1.0f - d) * (1.0f - d);
    const floatv near = fmax(1.0f - 0.25f * f * f, (floatv)(0.0f));
    const floatv weight = g[17] * q * q * (4.0f * d + 1.0f) * (1.0f - same) * near;
    const intv away = gx * s.dx + gy * s.dy - gz > 0.0f;
    const floatv w = SELECT((floatv)(0.0f), weight, away);
    wr += w;
    fr += SELECT((floatv)(0.0f), w * f, away);
    crx += w * g[19];
    cry += w * g[20];
    crz += w * g[21];
    nrx += SELECT((floatv)(0.0f), w * gx, away);
    nry += SELECT((floatv)(0.0f), w * gy, away);
    nrz += SELECT((floatv)(0.0f), w * gz, away);
  }
  const floatv vr = 1.0f / fmax(wr, tiny);
  const floatv rx = crx * vr - cax * va, ry = cry * vr - cay * va, rz = crz * vr - caz * va;
  const intv ended = (wr > 1e-3f) & (fr > 0.0f) & (rx * out.nx + ry * out.ny + rz * out.nz < 0.0f) &
                     (rx * nrx + ry * nry + rz * nrz > 0.0f);
  // The mean trust under the weights without it; what only rounding keeps from 1 is 1.
  // Where a ray meets hardly more than the bevel of a lone edge there is nothing to trust.
  out.trust = fmin(1.001f * (wa + wb) / fmax(trust, tiny), (floatv)(1.0f)) *
              smooth_step(0.001f, 0.005f, wa + wb);
  const intv edge = (wb > 0.03f * wa) & (h < 0.0f) & (fabs(za - zb) <= sheets.z);
  out.trust += SELECT(SELECT((floatv)(0.0f), (floatv)(ON_EDGE), edge), (floatv)(ENDED), ended);
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
                         const float16 rays, const float d_max, const float4 sheets) {
  const int p = get_global_id(0);
  if (p >= n || !(reference[p] < INFINITY)) return;
  const float u = points[p], v = points[n + p];
  const int i = clamp((int)((u - first) * inverse_tile), 0, tiles.x - 1);
  const int j = clamp((int)((v - first) * inverse_tile), 0, tiles.y - 1);
  const int tile = j * tiles.x + i;
  const int begin = tile_start[tile];
  Sample s;
  s.t = reference[p];
  s.dx = rays.s6 + rays.s7 * u + rays.s8 * v;
  s.dy = rays.s9 + rays.sa * u + rays.sb * v;
  s.sx = rays.s0 + rays.s1 * u + rays.s2 * v + s.t * s.dx;
  s.sy = rays.s3 + rays.s4 * u + rays.s5 * v + s.t * s.dy;
  const Blended b = blend_at(s, tile_group + begin, tile_start[tile + 1] - begin, groups, d_max,
                             sheets);
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
                         const float4 sheets) {  // same_low, same_high; crease, particle radii
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
  s.dx = rays.s6 + rays.s7 * u + rays.s8 * v;
  s.dy = rays.s9 + rays.sa * u + rays.sb * v;
  s.sx = rays.s0 + rays.s1 * u + rays.s2 * v + s.t * s.dx;
  s.sy = rays.s3 + rays.s4 * u + rays.s5 * v + s.t * s.dy;
  const Blended b = blend_at(s, tile_group + begin, count, groups, d_max, sheets);
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
