// density.cl: the particles' density field C(x) = sum of W(|x - x_j|), the cubic spline of
// smoothing length h = s (two particle radii, support two h), V_j = s^3: 1 inside the fluid, 1/2 on
// a flat face, 1/4 on a square edge, 1/pi at a lone particle. It decides where the surface ends
// (paper 2.4.1) and draws the splash (paper 3: particles too few for a fit are rendered directly).

typedef struct {
  global const float* x;  // [n] eye space in bucket order, particle radii
  global const float* y;
  global const float* z;
  global const int* start;  // [buckets + 1]
  float inverse_cell;       // 1 / (four particle radii or more)
  uint mask;
} Cells;

inline int cell_of(const float coordinate, const float inverse_cell) {
  return (int)floor(fmin(fmax(coordinate * inverse_cell, -1e9f), 1e9f));
}

// The cubic spline and, in .xyz of the result, its gradient; .w is C.
inline float4 density_at(const Cells cells, const float x, const float y, const float z) {
  const int cx = cell_of(x, cells.inverse_cell), cy = cell_of(y, cells.inverse_cell),
            cz = cell_of(z, cells.inverse_cell);
  float c = 0.0f, gx = 0.0f, gy = 0.0f, gz = 0.0f;
  for (int k = -1; k <= 1; ++k)
    for (int j = -1; j <= 1; ++j)
      for (int i = -1; i <= 1; ++i) {
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
          c += q < 1.0f ? 1.0f - 1.5f * squared + 0.75f * squared * q : 0.25f * r * r * r;
          // dW/dq / q, times (x - x_j) / h^2
          const float g = q < 1.0f ? -3.0f + 2.25f * q : -0.75f * r * r / q;
          gx += g * dx;
          gy += g * dy;
          gz += g * dz;
        }
      }
  const float norm = 0.318309886f;
  return (float4)(gx * (0.25f * norm), gy * (0.25f * norm), gz * (0.25f * norm), c * norm);
}

// The rays of the samples: eye point (o + t d, -t), affine in the pixel coordinates.
typedef struct {
  float ox, oy, dx, dy;
} Ray;

inline Ray ray_at(const float16 ray, const float u, const float v) {
  Ray r;
  r.ox = ray.s0 + ray.s1 * u + ray.s2 * v;
  r.oy = ray.s3 + ray.s4 * u + ray.s5 * v;
  r.dx = ray.s6 + ray.s7 * u + ray.s8 * v;
  r.dy = ray.s9 + ray.sa * u + ray.sb * v;
  return r;
}

// Takes back what the blend put outside the fluid: a sample stays where it lies on a kept triangle
// or where the density at its point reaches the contour's. One work-item per sample.
// `behind` receives the depth beyond which a sample that was taken back may look again (the
// reference that failed), and infinity where there is nothing to look for.
kernel void cut_contour(global const float* triangle,   // [samples] depth of the kept triangles
                        global const float* reference,  // [samples] reference depth
                        global float* depth,            // [samples] in and out
                        global float* behind,           // [samples]
                        global const float* cell_x, global const float* cell_y,
                        global const float* cell_z, global const int* cell_start,
                        const float inverse_cell, const uint mask, const int2 samples,
                        const float first, const float step, const float16 rays,
                        const float contour,  // density
                        const float near) {   // a triangle nearer than this counts, radii
  const int i = get_global_id(0), j = get_global_id(1);
  if (i >= samples.x || j >= samples.y) return;
  const int s = j * samples.x + i;
  const float t = depth[s];
  float again = reference[s];
  if (t < INFINITY) {
    int keep = fabs(t - triangle[s]) < near;
    if (!keep) {
      const Cells cells = {cell_x, cell_y, cell_z, cell_start, inverse_cell, mask};
      const Ray r = ray_at(rays, first + step * (float)i, first + step * (float)j);
      keep = density_at(cells, r.ox + t * r.dx, r.oy + t * r.dy, -t).w >= contour;
    }
    if (keep) again = INFINITY;
    else depth[s] = INFINITY;
  }
  behind[s] = again;
}

// The density at points of the surface: .w of density_at. One work-item per point.
kernel void measure_density(global const float* x, global const float* y, global const float* z,
                            global float* density,  // [n]
                            global const float* cell_x, global const float* cell_y,
                            global const float* cell_z, global const int* cell_start,
                            const float inverse_cell, const uint mask, const int n) {
  const int p = get_global_id(0);
  if (p >= n) return;
  const Cells cells = {cell_x, cell_y, cell_z, cell_start, inverse_cell, mask};
  density[p] = density_at(cells, x[p], y[p], z[p]).w;
}

// The first crossing of the density field along the ray between `from` and `to`, where it lies in
// front of the surface: the splash. One work-item per sample.
kernel void march_density(global const float* from,  // [samples] start depth; +inf: nothing here
                          global const float* to,    // [samples] end depth
                          global float* depth,       // [samples] in and out
                          global float* normal,      // [3][samples] eye axes, in and out
                          global int* group,         // [samples] -1 where a blob was drawn
                          global uchar* kind,        // [samples] 2 where a blob was drawn
                          global const float* cell_x, global const float* cell_y,
                          global const float* cell_z, global const int* cell_start,
                          const float inverse_cell, const uint mask, const int2 samples,
                          const float first, const float step, const float16 rays,
                          const float level) {
  const int i = get_global_id(0), j = get_global_id(1);
  if (i >= samples.x || j >= samples.y) return;
  const int s = j * samples.x + i;
  const float start = from[s];
  const float end = fmin(to[s], depth[s]);
  if (!(start < end)) return;
  const Cells cells = {cell_x, cell_y, cell_z, cell_start, inverse_cell, mask};
  const Ray r = ray_at(rays, first + step * (float)i, first + step * (float)j);
  // Steps of 0.3 particle radii along the ray.
  const float stride = 0.3f / sqrt(1.0f + r.dx * r.dx + r.dy * r.dy);
  for (float t = start; t < end; t += stride) {
    if (density_at(cells, r.ox + t * r.dx, r.oy + t * r.dy, -t).w < level) continue;
    float low = t - stride, high = t;
    for (int k = 0; k < 10; ++k) {
      const float middle = 0.5f * (low + high);
      const float c = density_at(cells, r.ox + middle * r.dx, r.oy + middle * r.dy, -middle).w;
      if (c < level) low = middle;
      else high = middle;
    }
    if (!(high < end)) return;
    const float4 c = density_at(cells, r.ox + high * r.dx, r.oy + high * r.dy, -high);
    const float size = sqrt(c.x * c.x + c.y * c.y + c.z * c.z);
    const int n = samples.x * samples.y;
    depth[s] = high;
    normal[s] = size > 0.0f ? -c.x / size : 0.0f;
    normal[n + s] = size > 0.0f ? -c.y / size : 0.0f;
    normal[2 * n + s] = size > 0.0f ? -c.z / size : 1.0f;
    group[s] = -1;
    kind[s] = 2;
    return;
  }
}
