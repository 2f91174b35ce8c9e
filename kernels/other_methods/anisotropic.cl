// anisotropic.cl: anisotropic kernels (Yu and Turk 2013) and the surface of their field as rays
// meet it, which is the surface itself and not a splat of it.
// Departures: a kernel is stretched at most 1.25 times as much as a full neighbourhood's, so that a
// hash grid finds all kernels
// that reach a point; the authors' k_s is one over the variance of a full neighbourhood times ours.
//
// uses: cells.cl

// A hash grid over points (cells.hpp); positions in bucket order.
typedef struct {
  global const float* x;  // particle radii, eye axes
  global const float* y;
  global const float* z;
  global const int* start;  // [buckets + 1]
  float inverse_cell;
  uint mask;
} Grid;

// The cubic spline over its value at zero; support 2.
inline float spline(const float q) {
  const float r = fmax(2.0f - q, 0.0f);
  return q < 1.0f ? 1.0f - q * q * (1.5f - 0.75f * q) : 0.25f * r * r * r;
}

// One rotation of Jacobi's method for a symmetric matrix: zeroes the element at (p, q), where r is
// the third axis, and turns the columns p and q of `axes` (column-major) alike.
inline void turn(float* pp, float* qq, float* pq, float* pr, float* qr, float* axis_p,
                 float* axis_q) {
  if (*pq == 0.0f) return;
  const float theta = (*qq - *pp) / (2.0f * *pq);
  const float t = (theta < 0.0f ? -1.0f : 1.0f) / (fabs(theta) + sqrt(theta * theta + 1.0f));
  const float c = 1.0f / sqrt(t * t + 1.0f), s = t * c;
  *pp -= t * *pq;
  *qq += t * *pq;
  *pq = 0.0f;
  const float a = *pr, b = *qr;
  *pr = c * a - s * b;
  *qr = s * a + c * b;
  for (int k = 0; k < 3; ++k) {
    const float u = axis_p[k], v = axis_q[k];
    axis_p[k] = c * u - s * v;
    axis_q[k] = s * u + c * v;
  }
}

// Centre, shape and volume of each particle's kernel (Yu and Turk, Eqs. 6 and 9 to 16), from its
// neighbours within 2 h with the weights w = 1 - (d / 2h)^3. One work-item per particle.
//   C = sum w (x_j - m)(x_j - m)^T / sum w,   m = sum w x_j / sum w
//   centre (1 - lambda) x + lambda m
//   G = 1/h R diag(1 / s~_k) R^T,   s~_k = k_s max(s_k, s_1 / k_r), or k_n with N_eps or fewer
//   V = 1 / sum_j W(x - x_j), the particle's mass over its density
kernel void shape_kernels(POINTS(x, y, z), global const int* start,
                          global float* kernels,  // [11][n] centre; G xx, yy, zz, xy, xz, yz;
                                                  // V det G / pi; square of the reach, radii^2
                          const int n, const CellGrid cells,
                          const KernelShape shape) {
  const float inverse_cell = cells.inverse_cell;
  const uint mask = cells.mask;
  const int p = get_global_id(0);
  if (p >= n) return;
  const Grid grid = {x, y, z, start, cells.inverse_cell, cells.mask};
  const float px = x[p], py = y[p], pz = z[p];
  const float h = shape.h, inverse_h = 1.0f / h;
  const int cx = cell_of(px, inverse_cell), cy = cell_of(py, inverse_cell),
            cz = cell_of(pz, inverse_cell);
  float total = 0.0f, density = 0.0f, count = -1.0f;  // the particle itself is no neighbour
  float mx = 0.0f, my = 0.0f, mz = 0.0f;
  float xx = 0.0f, yy = 0.0f, zz = 0.0f, xy = 0.0f, xz = 0.0f, yz = 0.0f;
  for (int k = -1; k <= 1; ++k)
    for (int j = -1; j <= 1; ++j)
      for (int i = -1; i <= 1; ++i) {
        const uint bucket = bucket_of(cx + i, cy + j, cz + k, mask);
        const int end = grid.start[bucket + 1];
        for (int o = grid.start[bucket]; o < end; ++o) {
          const float dx = grid.x[o] - px, dy = grid.y[o] - py, dz = grid.z[o] - pz;
          const float q = sqrt(dx * dx + dy * dy + dz * dz) * inverse_h;
          if (q >= 2.0f || cell_of(grid.x[o], inverse_cell) != cx + i ||
              cell_of(grid.y[o], inverse_cell) != cy + j ||
              cell_of(grid.z[o], inverse_cell) != cz + k)
            continue;
          const float w = 1.0f - 0.125f * (q * q * q);
          count += 1.0f;
          density += spline(q);
          total += w;
          mx += w * dx;
          my += w * dy;
          mz += w * dz;
          xx += w * (dx * dx);
          yy += w * (dy * dy);
          zz += w * (dz * dz);
          xy += w * (dx * dy);
          xz += w * (dx * dz);
          yz += w * (dy * dz);
        }
      }
  const float inverse_total = 1.0f / total;  // the particle itself weighs 1
  mx *= inverse_total;
  my *= inverse_total;
  mz *= inverse_total;
  float axes[9] = {1.0f, 0.0f, 0.0f, 0.0f, 1.0f, 0.0f, 0.0f, 0.0f, 1.0f};
  float stretch[3] = {shape.k_n, shape.k_n, shape.k_n};
  if (count > shape.n_eps) {
    xx = xx * inverse_total - mx * mx;
    yy = yy * inverse_total - my * my;
    zz = zz * inverse_total - mz * mz;
    xy = xy * inverse_total - mx * my;
    xz = xz * inverse_total - mx * mz;
    yz = yz * inverse_total - my * mz;
    for (int sweep = 0; sweep < 5; ++sweep) {
      turn(&xx, &yy, &xy, &xz, &yz, axes, axes + 3);
      turn(&xx, &zz, &xz, &xy, &yz, axes, axes + 6);
      turn(&yy, &zz, &yz, &xy, &xz, axes + 3, axes + 6);
    }
    const float least = fmax(xx, fmax(yy, zz)) / shape.k_r;
    stretch[0] = fmin(shape.per_variance * fmax(xx, least), shape.most);
    stretch[1] = fmin(shape.per_variance * fmax(yy, least), shape.most);
    stretch[2] = fmin(shape.per_variance * fmax(zz, least), shape.most);
  }
  const float a = inverse_h / stretch[0], b = inverse_h / stretch[1], c = inverse_h / stretch[2];
  kernels[p] = px + shape.lambda * mx;
  kernels[n + p] = py + shape.lambda * my;
  kernels[2 * n + p] = pz + shape.lambda * mz;
  kernels[3 * n + p] = a * axes[0] * axes[0] + b * axes[3] * axes[3] + c * axes[6] * axes[6];
  kernels[4 * n + p] = a * axes[1] * axes[1] + b * axes[4] * axes[4] + c * axes[7] * axes[7];
  kernels[5 * n + p] = a * axes[2] * axes[2] + b * axes[5] * axes[5] + c * axes[8] * axes[8];
  kernels[6 * n + p] = a * axes[0] * axes[1] + b * axes[3] * axes[4] + c * axes[6] * axes[7];
  kernels[7 * n + p] = a * axes[0] * axes[2] + b * axes[3] * axes[5] + c * axes[6] * axes[8];
  kernels[8 * n + p] = a * axes[1] * axes[2] + b * axes[4] * axes[5] + c * axes[7] * axes[8];
  // V = pi h^3 / sum of the spline over its value at zero, and det G = a b c.
  kernels[9 * n + p] = (h * h * h) / density * (a * b * c);
  const float reach = 2.0f * h * fmax(stretch[0], fmax(stretch[1], stretch[2]));
  kernels[10 * n + p] = reach * reach;
}

inline float sum_of(const float8 v) {
  return ((v.s0 + v.s1) + (v.s2 + v.s3)) + ((v.s4 + v.s5) + (v.s6 + v.s7));
}

// The field sum_j V_j det G_j / pi spline(|G_j (x - c_j)|) in .w, and its gradient in .xyz when it
// is asked for. Eight kernels of a bucket at a time on every device: one fixed order of the sums.
inline float4 field_at(const Grid grid, global const float* kernels, const int n, const float x,
                       const float y, const float z, const int with_gradient) {
  const int cx = cell_of(x, grid.inverse_cell), cy = cell_of(y, grid.inverse_cell),
            cz = cell_of(z, grid.inverse_cell);
  // Distance to the cell's lower neighbour along each axis, in cells; no reach is longer than one.
  const float fx = x * grid.inverse_cell - (float)cx, fy = y * grid.inverse_cell - (float)cy,
              fz = z * grid.inverse_cell - (float)cz;
  const int8 lanes = (int8)(0, 1, 2, 3, 4, 5, 6, 7);
  float8 field = (float8)(0.0f), gx = field, gy = field, gz = field;
  for (int k = -1; k <= 1; ++k)
    for (int j = -1; j <= 1; ++j)
      for (int i = -1; i <= 1; ++i) {
        const float ax = i == 0 ? 0.0f : i < 0 ? fx : 1.0f - fx;
        const float ay = j == 0 ? 0.0f : j < 0 ? fy : 1.0f - fy;
        const float az = k == 0 ? 0.0f : k < 0 ? fz : 1.0f - fz;
        if (ax * ax + ay * ay + az * az > 1.001f) continue;  // out of reach, and room for rounding
        const uint bucket = bucket_of(cx + i, cy + j, cz + k, grid.mask);
        const int end = grid.start[bucket + 1];
        for (int p = grid.start[bucket]; p < end; p += 8) {
          const float8 px = vload8(0, grid.x + p), py = vload8(0, grid.y + p),
                       pz = vload8(0, grid.z + p);
          const float8 dx = x - px, dy = y - py, dz = z - pz;
          int8 counts = (p + lanes < end) &
                        (dx * dx + dy * dy + dz * dz < vload8(0, kernels + 10 * n + p));
          if (!any(counts)) continue;
          const float8 xx = vload8(0, kernels + 3 * n + p), yy = vload8(0, kernels + 4 * n + p);
          const float8 zz = vload8(0, kernels + 5 * n + p), xy = vload8(0, kernels + 6 * n + p);
          const float8 xz = vload8(0, kernels + 7 * n + p), yz = vload8(0, kernels + 8 * n + p);
          const float8 vx = xx * dx + xy * dy + xz * dz;
          const float8 vy = xy * dx + yy * dy + yz * dz;
          const float8 vz = xz * dx + yz * dy + zz * dz;
          const float8 squared = vx * vx + vy * vy + vz * vz;
          // Buckets hold points of several cells.
          counts = counts & (squared < 4.0f) &
                   (convert_int8(floor(px * grid.inverse_cell)) == cx + i) &
                   (convert_int8(floor(py * grid.inverse_cell)) == cy + j) &
                   (convert_int8(floor(pz * grid.inverse_cell)) == cz + k);
          const float8 q = sqrt(squared), r = 2.0f - q;
          const float8 scale = vload8(0, kernels + 9 * n + p);
          const int8 core = q < 1.0f;
          const float8 value =
              select(0.25f * r * r * r, 1.0f - squared * (1.5f - 0.75f * q), core);
          field += select((float8)(0.0f), scale * value, counts);
          if (with_gradient) {
            // d spline / dq / q, times G (G (x - c))
            const float8 slope = select(-0.75f * r * r / q, -3.0f + 2.25f * q, core);
            const float8 g = select((float8)(0.0f), scale * slope, counts);
            // Lanes that do not count may be anything, and a product with zero is not always zero.
            const float8 none = (float8)(0.0f);
            gx += select(none, g * (xx * vx + xy * vy + xz * vz), counts);
            gy += select(none, g * (xy * vx + yy * vy + yz * vz), counts);
            gz += select(none, g * (xz * vx + yz * vy + zz * vz), counts);
          }
        }
      }
  return (float4)(sum_of(gx), sum_of(gy), sum_of(gz), sum_of(field));
}

// Steps of a ray, of a radius where there is nothing: a stray far behind the rest is not worth more, and
// beyond 2^24 radii such a step is lost.
#define MOST_STEPS 1024

// Where the ray of each point first meets field = level between the depths `from` and `to`, within
// MOST_STEPS steps. One work-item per point.
kernel void cast_field(global const float* points,  // [2][rays] u, v, pixels
                       EXTENT(const, from, to),     // +inf: nothing to find
                       global float* depth,         // [rays] +inf: none
                       global float* normal,        // [3][rays] unit, outward, eye axes
                       SHAPES(x, y, z, start, kernels), const CellGrid cells,
                       const FieldRays field) {
  const int count = field.rays, n = field.kernels;
  const float level = field.level;
  const int p = get_global_id(0);
  if (p >= count) return;
  const Grid grid = {x, y, z, start, cells.inverse_cell, cells.mask};
  depth[p] = INFINITY;
  normal[p] = 0.0f;
  normal[count + p] = 0.0f;
  normal[2 * count + p] = 0.0f;
  if (!(from[p] < INFINITY)) return;
  const Ray r = ray_at(field.map, points[p], points[count + p]);
  const float unit = 1.0f / sqrt(1.0f + r.dx * r.dx + r.dy * r.dy);  // depth of a radius on the ray
  const float last = to[p];
  float t = from[p], low = t, short_of = -level;
  float over = -1.0f;
  for (int step = 0; t <= last && step < MOST_STEPS; ++step) {
    const float c = field_at(grid, kernels, n, r.ox + t * r.dx, r.oy + t * r.dy, -t, 0).w;
    over = c - level;
    if (over >= 0.0f) break;
    low = t;
    short_of = over;
    t += unit * (c > 0.1f * level ? 0.25f : c > 0.0f ? 0.5f : 1.0f);
  }
  if (!(over >= 0.0f)) return;
  // False position with the Illinois rule: the value of an end that stays twice is halved.
  float high = t, middle = t;
  int side = 0;  // the end that moved last: -1 low, 1 high
  for (int step = 0; step < 5 && high > low; ++step) {
    middle = low + (high - low) * (short_of / (short_of - over));
    const float there =
        field_at(grid, kernels, n, r.ox + middle * r.dx, r.oy + middle * r.dy, -middle, 0).w -
        level;
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
  const float4 g =
      field_at(grid, kernels, n, r.ox + middle * r.dx, r.oy + middle * r.dy, -middle, 1);
  const float size = sqrt(g.x * g.x + g.y * g.y + g.z * g.z);
  if (!(size > 0.0f)) return;
  depth[p] = middle;
  normal[p] = -g.x / size;
  normal[count + p] = -g.y / size;
  normal[2 * count + p] = -g.z / size;
}
