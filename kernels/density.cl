// density.cl: the particles' density field C(x) = sum of W(|x - x_j|), the cubic spline of
// smoothing length h = s (two particle radii, support two h), V_j = s^3: 1 inside the fluid, 1/2 on
// a flat face, 1/4 on a square edge, 1/pi at a lone particle. It decides where the surface ends
// (paper 2.4.1) and draws the splash (paper 3: particles too few for a fit are rendered directly).

typedef struct {
  global const float* x;  // [n] eye space in bucket order, particle radii
  global const float* y;
  global const float* z;
  global const float* weight;  // [n]
  global const int* start;     // [buckets + 1]
  float inverse_cell;       // 1 / (four particle radii or more)
  uint mask;
} Cells;

inline int cell_of(const float coordinate, const float inverse_cell) {
  return (int)floor(fmin(fmax(coordinate * inverse_cell, -1e9f), 1e9f));
}

// C in .w and its gradient in .xyz of the result, each particle's share times its weight.
inline float4 density_at(const Cells cells, const float x, const float y, const float z) {
  const int cx = cell_of(x, cells.inverse_cell), cy = cell_of(y, cells.inverse_cell),
            cz = cell_of(z, cells.inverse_cell);
  // Distance to the cell's lower neighbour along each axis, in cells; the support is one cell.
  const float fx = x * cells.inverse_cell - (float)cx, fy = y * cells.inverse_cell - (float)cy,
              fz = z * cells.inverse_cell - (float)cz;
  float c = 0.0f, gx = 0.0f, gy = 0.0f, gz = 0.0f;
  for (int k = -1; k <= 1; ++k)
    for (int j = -1; j <= 1; ++j)
      for (int i = -1; i <= 1; ++i) {
        const float ax = i == 0 ? 0.0f : i < 0 ? fx : 1.0f - fx;
        const float ay = j == 0 ? 0.0f : j < 0 ? fy : 1.0f - fy;
        const float az = k == 0 ? 0.0f : k < 0 ? fz : 1.0f - fz;
        if (ax * ax + ay * ay + az * az > 1.001f) continue;  // out of reach, with room for rounding
        const uint bucket = ((uint)(cx + i) * 73856093u ^ (uint)(cy + j) * 19349663u ^
                             (uint)(cz + k) * 83492791u) &
                            cells.mask;
        const int end = cells.start[bucket + 1];
        for (int p = cells.start[bucket]; p < end; ++p) {
          const float px = cells.x[p], py = cells.y[p], pz = cells.z[p];
          const float dx = x - px, dy = y - py, dz = z - pz;
          const float squared = (dx * dx + dy * dy + dz * dz) * 0.25f;  // (distance / h)^2
          if (squared >= 4.0f) continue;
          if (cell_of(px, cells.inverse_cell) != cx + i ||
              cell_of(py, cells.inverse_cell) != cy + j ||
              cell_of(pz, cells.inverse_cell) != cz + k)
            continue;
          const float q = sqrt(squared);
          const float r = 2.0f - q;
          const float w = cells.weight[p];
          c += w * (q < 1.0f ? 1.0f - 1.5f * squared + 0.75f * squared * q : 0.25f * r * r * r);
          // dW/dq / q, times (x - x_j) / h^2
          const float g = w * (q < 1.0f ? -3.0f + 2.25f * q : -0.75f * r * r / q);
          gx += g * dx;
          gy += g * dy;
          gz += g * dz;
        }
      }
  const float norm = 0.318309886f;
  return (float4)(gx * (0.25f * norm), gy * (0.25f * norm), gz * (0.25f * norm), c * norm);
}

// The density at points of the surface: .w of density_at. One work-item per point.
kernel void measure_density(global const float* x, global const float* y, global const float* z,
                            global float* density,  // [n]
                            global const float* cell_x, global const float* cell_y,
                            global const float* cell_z, global const float* cell_weight,
                            global const int* cell_start, const float inverse_cell,
                            const uint mask, const int n) {
  const int p = get_global_id(0);
  if (p >= n) return;
  const Cells cells = {cell_x, cell_y, cell_z, cell_weight, cell_start, inverse_cell, mask};
  density[p] = density_at(cells, x[p], y[p], z[p]).w;
}

// The field's gradient (1 / particle radii) and value at the particles' own positions, in bucket
// order. One work-item per particle.
kernel void measure_gradients(global float* result,  // [4][n] x, y, z, density
                              global const float* cell_x, global const float* cell_y,
                              global const float* cell_z, global const float* cell_weight,
                              global const int* cell_start, const float inverse_cell,
                              const uint mask, const int n) {
  const int p = get_global_id(0);
  if (p >= n) return;
  const Cells cells = {cell_x, cell_y, cell_z, cell_weight, cell_start, inverse_cell, mask};
  const float4 g = density_at(cells, cell_x[p], cell_y[p], cell_z[p]);
  result[p] = g.x;
  result[n + p] = g.y;
  result[2 * n + p] = g.z;
  result[3 * n + p] = g.w;
}

// Turns densities at the particles' own positions into the weights with which the field's level is
// even: `level` for a lone particle (1/pi), 0.45 inside the fluid, so that a blob is a sphere of
// the particle's radius and the field's face lies where the fitted one does.
// One work-item per particle.
kernel void level_weights(global const float* field,  // [4][n] of measure_gradients
                          global float* weight,       // [n]
                          const float level, const int n) {
  const int p = get_global_id(0);
  if (p >= n) return;
  const float t = clamp((field[3 * n + p] - 0.35f) / 0.5f, 0.0f, 1.0f);
  weight[p] = level / (level + (0.45f - level) * (t * t * (3.0f - 2.0f * t)));
}

// Where the levelled field first reaches `level` on a ray between depths `from` and `to`.
typedef struct {
  float depth;       // +infinity: nowhere, or already reached at `from`
  float nx, ny, nz;  // unit outward normal, eye axes
} Crossing;

inline Crossing first_crossing(const Cells cells, const Ray r, const float from, const float to,
                               const float level) {
  Crossing crossing = {INFINITY, 0.0f, 0.0f, 0.0f};
  // Depth of one particle radius along the ray.
  const float unit = 1.0f / sqrt(1.0f + r.dx * r.dx + r.dy * r.dy);
  float t = from, low = from, short_of = -level;  // the last point below the level, and how far
  for (int k = 0; k < 1000 && t <= to; ++k) {
    const float c = density_at(cells, r.ox + t * r.dx, r.oy + t * r.dy, -t).w;
    if (c < level) {
      // The field of a lone particle falls below 0.35 levels at two radii and below 0.1 at three,
      // so that these steps do not pass over one.
      low = t;
      short_of = c - level;
      t += unit * (c < 0.1f * level ? 1.0f : c < 0.35f * level ? 0.6f : 0.3f);
      continue;
    }
    if (k == 0) return crossing;
    // False position with the Illinois rule (the value of an end that stays twice is halved): five
    // steps come within the 1/1024 radii that ten bisections would.
    float high = t, over = c - level, middle = t;
    int side = 0;  // the end that moved last: -1 low, 1 high
    for (int step = 0; step < 5; ++step) {
      middle = low + (high - low) * (short_of / (short_of - over));
      const float there =
          density_at(cells, r.ox + middle * r.dx, r.oy + middle * r.dy, -middle).w - level;
      if (there < 0.0f) {
        low = middle;
        short_of = there;
        if (side < 0) over *= 0.5f;
        side = -1;
      } else {
        high = middle;
        over = there;
        if (side > 0) short_of *= 0.5f;
        side = 1;
      }
    }
    const float4 g = density_at(cells, r.ox + middle * r.dx, r.oy + middle * r.dy, -middle);
    const float size = sqrt(g.x * g.x + g.y * g.y + g.z * g.z);
    if (!(size > 0.0f)) return crossing;
    crossing.depth = middle;
    crossing.nx = -g.x / size;
    crossing.ny = -g.y / size;
    crossing.nz = -g.z / size;
    return crossing;
  }
  return crossing;
}

// Decides what sample s of a layer, at pixel (u, v), shows.
// Where the groups are trusted, the blend stays if it lies on a kept triangle or if the density at
// its point reaches the contour's. Where they are not, or no group was met, the density field is
// followed near by: in between the two are mixed by the trust, without it the blend goes.
// `behind` receives the depth beyond which a sample that shows nothing may look again (its
// reference), and infinity elsewhere.
inline void settle(const int s, const int n, const float u, const float v,
                   global const float* triangle, global const float* reference,
                   global const float* core, global const float* trust, global float* depth,
                   global float* normal, global int* group, global uchar* kind,
                   global float* behind, const Cells plain, const Cells field, const float16 rays,
                   const float4 limits, const float beyond,
                   const int only_gaps) {
  behind[s] = INFINITY;
  const float t0 = reference[s];
  if (!(t0 < INFINITY)) return;
  const Ray r = ray_at(rays, u, v);
  const float t = depth[s];
  const int met = t < INFINITY;
  if (met && only_gaps) return;
  // The blend's share: its trust, or nothing outside the fluid. With less trust the contour draws
  // in to where the field has its own.
  const int on_triangle = fabs(t - triangle[s]) < limits.z;
  // Blended samples carry where they lie with their trust (blend.cl): at a convex crease the sheets
  // vouch for each other down to a third of the contour's density, beyond an edge nothing shows.
  const float found = met ? trust[s] : 0.0f;
  const int ended = found > 3.5f, on_edge = !ended && found > 1.5f;
  const float trusted = found - (ended ? 4.0f : on_edge ? 2.0f : 0.0f);
  if (ended && !on_triangle) {
    depth[s] = INFINITY;
    behind[s] = t0;
    return;
  }
  float share = trusted;
  if (met && (trusted < 1.0f || !on_triangle)) {
    const float density = density_at(plain, r.ox + t * r.dx, r.oy + t * r.dy, -t).w;
    const float inside = density - (on_edge ? 0.3f : 1.0f) * limits.x - 0.1f * (1.0f - trusted);
    share = trusted < 1.0f  ? trusted * clamp(20.0f * inside, 0.0f, 1.0f)
            : inside < 0.0f ? 0.0f
                            : 1.0f;
  }
  if (share >= 1.0f) return;
  // A trusted surface that has ended lets what lies behind it be seen.
  if (trusted >= 1.0f && share <= 0.0f) {
    depth[s] = INFINITY;
    behind[s] = t0;
    return;
  }

  const float from = fmax(fmin(t, t0) - limits.w, 1e-3f);
  Crossing c = {INFINITY, 0.0f, 0.0f, 0.0f};
  if (core[s] < INFINITY) c = first_crossing(field, r, from, (met ? t : t0) + beyond, limits.y);
  // What is not fully trusted gives way where it disagrees with the field.
  const float apart = met ? fabs(c.depth - t) : INFINITY;
  if (apart < limits.w)
    share = fmax(share - (1.0f - share) * 2.0f * fmax(apart - 0.5f, 0.0f), 0.0f);
  else
    share = share > 0.5f ? 1.0f : 0.0f;
  if (share >= 1.0f) return;
  if (!(c.depth < INFINITY)) {
    depth[s] = INFINITY;
    behind[s] = t0;
    return;
  }
  const float nx = share > 0.0f ? share * normal[s] + (1.0f - share) * c.nx : c.nx;
  const float ny = share > 0.0f ? share * normal[n + s] + (1.0f - share) * c.ny : c.ny;
  const float nz = share > 0.0f ? share * normal[2 * n + s] + (1.0f - share) * c.nz : c.nz;
  const float size = sqrt(fmax(nx * nx + ny * ny + nz * nz, 1e-30f));
  depth[s] = share > 0.0f ? share * t + (1.0f - share) * c.depth : c.depth;
  normal[s] = nx / size;
  normal[n + s] = ny / size;
  normal[2 * n + s] = nz / size;
  if (share <= 0.5f) {
    group[s] = -1;
    kind[s] = 2;
  }
}

// One work-item per sample.
kernel void settle_samples(global const float* triangle,   // [samples] depth of kept triangles
                           global const float* reference,  // [samples] reference depth
                           global const float* core,       // [samples] finite where the ray comes
                                                           // near enough to a particle to meet the
                                                           // field's level
                           global const float* trust,      // [samples] of the blend (blend.cl)
                           global float* depth,            // [samples] in and out
                           global float* normal,           // [3][samples] in and out
                           global int* group,              // [samples] in and out
                           global uchar* kind,             // [samples] out: 2 where the field shows
                           global float* behind,           // [samples] out
                           global const float* cell_x, global const float* cell_y,
                           global const float* cell_z, global const float* cell_weight,
                           global const float* level_weight, global const int* cell_start,
                           const float inverse_cell, const uint mask, const int2 samples,
                           const float first, const float step, const float16 rays,
                           const float4 limits,  // contour density; level of the field; a triangle
                                                 // this near vouches, radii; search before, radii
                           const float beyond,    // search behind, particle radii
                           const int only_gaps) {  // 1: samples that show something stay
  const int i = get_global_id(0), j = get_global_id(1);
  if (i >= samples.x || j >= samples.y) return;
  const Cells plain = {cell_x, cell_y, cell_z, cell_weight, cell_start, inverse_cell, mask};
  const Cells field = {cell_x, cell_y, cell_z, level_weight, cell_start, inverse_cell, mask};
  settle(j * samples.x + i, samples.x * samples.y, first + step * (float)i,
         first + step * (float)j, triangle, reference, core, trust, depth, normal, group, kind,
         behind, plain, field, rays, limits, beyond, only_gaps);
}

// The same at a list of positions. One work-item per point.
kernel void settle_points(global const float* triangle, global const float* reference,
                          global const float* core, global const float* trust,
                          global float* depth, global float* normal, global int* group,
                          global uchar* kind, global float* behind,
                          global const float* points,  // [2][n] u, v, pixels
                          global const float* cell_x, global const float* cell_y,
                          global const float* cell_z, global const float* cell_weight,
                          global const float* level_weight, global const int* cell_start,
                          const float inverse_cell, const uint mask, const int n,
                          const float16 rays, const float4 limits, const float beyond) {
  const int p = get_global_id(0);
  if (p >= n) return;
  const Cells plain = {cell_x, cell_y, cell_z, cell_weight, cell_start, inverse_cell, mask};
  const Cells field = {cell_x, cell_y, cell_z, level_weight, cell_start, inverse_cell, mask};
  settle(p, n, points[p], points[n + p], triangle, reference, core, trust, depth, normal, group,
         kind, behind, plain, field, rays, limits, beyond, 0);
}

// The splash: the levelled field's first crossing between the splash particles' fronts and backs,
// where it lies in front of the surface. One work-item per sample.
kernel void draw_splash(global const float* from,  // [samples] start depth; +inf: nothing here
                        global const float* to,    // [samples] end depth
                        global float* depth,       // [samples] in and out
                        global float* normal,      // [3][samples] eye axes, in and out
                        global int* group,         // [samples] -1 where splash was drawn
                        global uchar* kind,        // [samples] 2 where splash was drawn
                        global const float* cell_x, global const float* cell_y,
                        global const float* cell_z, global const float* level_weight,
                        global const int* cell_start, const float inverse_cell, const uint mask,
                        const int2 samples, const float first, const float step,
                        const float16 rays, const float level) {
  const int i = get_global_id(0), j = get_global_id(1);
  if (i >= samples.x || j >= samples.y) return;
  const int s = j * samples.x + i;
  const float start = from[s];
  const float end = fmin(to[s], depth[s]);
  if (!(start < end)) return;
  const Cells field = {cell_x, cell_y, cell_z, level_weight, cell_start, inverse_cell, mask};
  const Ray r = ray_at(rays, first + step * (float)i, first + step * (float)j);
  const Crossing c = first_crossing(field, r, start, end, level);
  if (!(c.depth < end)) return;
  const int n = samples.x * samples.y;
  depth[s] = c.depth;
  normal[s] = c.nx;
  normal[n + s] = c.ny;
  normal[2 * n + s] = c.nz;
  group[s] = -1;
  kind[s] = 2;
}
