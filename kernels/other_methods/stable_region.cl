// stable_region.cl: the region of the surface of one quadric per visible particle: which samples it covers
// and which particle owns each (paper 2.4.1).
//
// Departs from the paper: groups are single particles; and Eqs. 3 to 5, which shrink the region, are
// replaced by capsules along its contour and a closing by a disc (docs/method.md).
//
// Records of particles are those of stable.cl. Depth maps are positive floats, whose bits order like
// integers: the nearest is kept by atomic_min, then the lowest owner among the equally near.

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
