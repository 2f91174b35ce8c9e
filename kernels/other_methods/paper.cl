// paper.cl: what the method `paper` does as the paper prints it and the method `fit` does not.
//
// Decided where the text leaves it open (src/stages/other_methods/paper.hpp says the rest):
// - Eq. 2 fits f to z, so f is a height field over the group's plane: six coefficients, z along the
//   group's normal. (With z among the basis functions f = z would solve it whatever the points.)
// - In Eq. 3 z is the region, 1 inside and 0 outside, and the result is cut at 1/2. A sample
//   outside has no normal; w_n is 1 wherever one of the two samples has none.
// - In Eq. 7 b = R (b_share.x + b_share.y s^4), .15 and .45 by default, R the group's radius, s the dot
//   product of its normal and that of the group that the sample's triangle belongs to, 0 where it is
//   negative.
// - In Eq. 6 the denominator's sum runs over k.

// h(x, y) = a0 + a1 x + a2 y + a3 xx + a4 xy + a5 yy.
#define TERMS 6
#define AT(r, s) ((r) * ((r) + 1) / 2 + (s))

inline void height_terms(float* f, const float x, const float y) {
  f[0] = 1.0f;
  f[1] = x;
  f[2] = y;
  f[3] = x * x;
  f[4] = x * y;
  f[5] = y * y;
}

// Minimises sum of w (h(x, y) - z)^2 for each group (Eq. 2) by Cholesky on the normal matrix. A
// group of fewer than `least` points gets a plane. One work-item per group.
kernel void fit_heights(global const float* points,  // [4][slots] x, y, z over R, and w
                        global const int* start,     // [groups + 1] first slot of each group
                        global float* height,        // [7][groups] a0 .. a5; RMS of h - z
                        const int slots, const int groups, const int least,
                        const float2 ridge) {  // on the linear and the quadratic terms, times sum w
  const int g = get_global_id(0);
  if (g >= groups) return;
  const int begin = start[g], end = start[g + 1];
  float A[TERMS * (TERMS + 1) / 2], b[TERMS], f[TERMS];
#pragma unroll
  for (int k = 0; k < TERMS * (TERMS + 1) / 2; ++k) A[k] = 0.0f;
#pragma unroll
  for (int k = 0; k < TERMS; ++k) b[k] = 0.0f;
  for (int p = begin; p < end; ++p) {
    const float z = points[2 * slots + p], w = points[3 * slots + p];
    height_terms(f, points[p], points[slots + p]);
#pragma unroll
    for (int r = 0; r < TERMS; ++r) {
      const float wf = w * f[r];
      b[r] += wf * z;
#pragma unroll
      for (int s = 0; s <= r; ++s) A[AT(r, s)] += wf * f[s];
    }
  }
  const float total = A[0];
  const int plane = end - begin < least;
#pragma unroll
  for (int r = 1; r < TERMS; ++r) {
    A[AT(r, r)] += total * (r < 3 ? ridge.x : ridge.y);
    if (r < 3 || !plane) continue;
#pragma unroll
    for (int s = 0; s < r; ++s) A[AT(r, s)] = 0.0f;
    A[AT(r, r)] = 1.0f;
    b[r] = 0.0f;
  }
#pragma unroll
  for (int j = 0; j < TERMS; ++j) {
    float d = A[AT(j, j)];
#pragma unroll
    for (int k = 0; k < j; ++k) d -= A[AT(j, k)] * A[AT(j, k)];
    const float inverse = 1.0f / sqrt(fmax(d, 1e-30f));
    A[AT(j, j)] = inverse;
#pragma unroll
    for (int i = j + 1; i < TERMS; ++i) {
      float s = A[AT(i, j)];
#pragma unroll
      for (int k = 0; k < j; ++k) s -= A[AT(i, k)] * A[AT(j, k)];
      A[AT(i, j)] = s * inverse;
    }
  }
#pragma unroll
  for (int i = 0; i < TERMS; ++i) {
#pragma unroll
    for (int k = 0; k < i; ++k) b[i] -= A[AT(i, k)] * b[k];
    b[i] *= A[AT(i, i)];
  }
#pragma unroll
  for (int i = TERMS - 1; i >= 0; --i) {
#pragma unroll
    for (int k = i + 1; k < TERMS; ++k) b[i] -= A[AT(k, i)] * b[k];
    b[i] *= A[AT(i, i)];
    height[i * groups + g] = b[i];
  }
  float sum = 0.0f;
  for (int p = begin; p < end; ++p) {
    height_terms(f, points[p], points[slots + p]);
    float error = -points[2 * slots + p];
#pragma unroll
    for (int r = 0; r < TERMS; ++r) error += b[r] * f[r];
    sum += points[3 * slots + p] * error * error;
  }
  height[TERMS * groups + g] = sqrt(sum / total);
}

// Barycentric coordinates of a sample in a triangle on the screen.
typedef struct {
  float l0, l1, l2;
} Barycentric;

inline Barycentric barycentric_in(global const float* corners, const int stride, const int k,
                                  const float u, const float v) {
  const float u0 = corners[k], v0 = corners[stride + k];
  const float u1 = corners[3 * stride + k] - u0, v1 = corners[4 * stride + k] - v0;
  const float u2 = corners[6 * stride + k] - u0, v2 = corners[7 * stride + k] - v0;
  const float inverse = 1.0f / (u1 * v2 - u2 * v1);  // +-infinity: no sample is inside
  Barycentric at;
  at.l1 = ((u - u0) * v2 - u2 * (v - v0)) * inverse;
  at.l2 = (u1 * (v - v0) - (u - u0) * v1) * inverse;
  at.l0 = 1.0f - at.l1 - at.l2;
  return at;
}

// The triangle under every sample (2.4.1). Triangles of a Delaunay triangulation do not overlap;
// on a shared edge the lower index wins. One work-item per triangle.
kernel void own_samples(global const float* corners,  // [9][stride] u, v, t of three corners
                        global int* owner,            // [samples] INT_MAX before
                        const int n, const int stride, const int2 samples, const float first,
                        const float step) {
  const int k = get_global_id(0);
  if (k >= n) return;
  const float u0 = corners[k], u1 = corners[3 * stride + k], u2 = corners[6 * stride + k];
  const float v0 = corners[stride + k], v1 = corners[4 * stride + k], v2 = corners[7 * stride + k];
  const float left = (fmin(u0, fmin(u1, u2)) - first) / step;
  const float right = (fmax(u0, fmax(u1, u2)) - first) / step;
  const float top = (fmin(v0, fmin(v1, v2)) - first) / step;
  const float bottom = (fmax(v0, fmax(v1, v2)) - first) / step;
  const int i0 = max(0, (int)ceil(clamp(left, -1.0f, 1e6f)));
  const int i1 = min(samples.x - 1, (int)floor(clamp(right, -1.0f, 1e6f)));
  const int j0 = max(0, (int)ceil(clamp(top, -1.0f, 1e6f)));
  const int j1 = min(samples.y - 1, (int)floor(clamp(bottom, -1.0f, 1e6f)));
  for (int j = j0; j <= j1; ++j)
    for (int i = i0; i <= i1; ++i) {
      const Barycentric at =
          barycentric_in(corners, stride, k, first + step * (float)i, first + step * (float)j);
      // A sample on an edge belongs to both sides in spite of rounding.
      if (at.l0 >= -1e-5f && at.l1 >= -1e-5f && at.l2 >= -1e-5f)
        atomic_min(owner + j * samples.x + i, k);
    }
}

// The group of the triangle that owns a sample and the triangle's depth there: the region and its
// reference. One work-item per sample.
kernel void draw_region(global const float* corners,          // [9][stride] see own_samples
                        global const int* group_of_triangle,  // [n]
                        global const int* owner,              // [samples]
                        REGION(, group, depth),               // -1, +infinity outside
                        const int stride, const Lattice samples,
                        const int perspective) {  // interpolate 1/t instead of t
  const int i = get_global_id(0), j = get_global_id(1);
  if (i >= samples.nx || j >= samples.ny) return;
  const int s = j * samples.nx + i;
  const int k = owner[s];
  if (k == INT_MAX) {
    group[s] = -1;
    depth[s] = INFINITY;
    return;
  }
  const Barycentric at = barycentric_in(corners, stride, k, samples.first + samples.step * (float)i,
                                        samples.first + samples.step * (float)j);
  const float t0 = corners[2 * stride + k], t1 = corners[5 * stride + k];
  const float t2 = corners[8 * stride + k];
  group[s] = group_of_triangle[k];
  depth[s] = perspective ? 1.0f / (at.l0 / t0 + at.l1 / t1 + at.l2 / t2)
                         : at.l0 * t0 + at.l1 * t1 + at.l2 * t2;
}

// Smooths the region's contour by the bilateral filter of Eqs. 3 to 5. A sample that enters takes
// group and depth from the nearest sample of the region. One work-item per sample.
kernel void smooth_contour(REGION(const, group, depth),
                           global const float* normal,           // [3][groups] unit
                           global const float* distance_weight,  // [2 reach^2 + 1] w_s (Eq. 4) by
                                                                 // squared distance
                           REGION(, smoothed_group, smoothed_depth), const int groups,
                           const int2 samples, const int reach,
                           const float normal_falloff) {  // 1 / (2 sigma_n^2)
  const int i = get_global_id(0), j = get_global_id(1);
  if (i >= samples.x || j >= samples.y) return;
  const int s = j * samples.x + i;
  const int here = group[s];
  const int i0 = max(0, i - reach), i1 = min(samples.x - 1, i + reach);
  const int j0 = max(0, j - reach), j1 = min(samples.y - 1, j + reach);
  smoothed_group[s] = here;
  smoothed_depth[s] = depth[s];
  int mixed = 0;
  for (int y = j0; y <= j1 && !mixed; ++y)
    for (int x = i0; x <= i1; ++x) mixed |= (group[y * samples.x + x] < 0) != (here < 0);
  if (!mixed) return;

  float sum = 0.0f, weight = 0.0f;
  int nearest = -1, least = INT_MAX;
  for (int y = j0; y <= j1; ++y)
    for (int x = i0; x <= i1; ++x) {
      const int other = group[y * samples.x + x];
      const int squared = (x - i) * (x - i) + (y - j) * (y - j);
      float w = distance_weight[squared];
      if (here >= 0 && other >= 0) {
        const float dx = normal[here] - normal[other];
        const float dy = normal[groups + here] - normal[groups + other];
        const float dz = normal[2 * groups + here] - normal[2 * groups + other];
        w *= exp_negative(-(dx * dx + dy * dy + dz * dz) * normal_falloff);
      }
      weight += w;
      if (other < 0) continue;
      sum += w;
      if (squared < least) {
        least = squared;
        nearest = y * samples.x + x;
      }
    }
  if (!(sum > 0.5f * weight)) {
    smoothed_group[s] = -1;
    smoothed_depth[s] = INFINITY;
  } else if (here < 0) {
    smoothed_group[s] = group[nearest];
    smoothed_depth[s] = depth[nearest];
  }
}

// A group's record is 20 floats: 0-2 centre, 3-5 normal, 6-15 quadric (see fit.cl), 16-17 centre
// on the screen in pixels, 18 radius R, 19 billboard radius.
#define GROUP_RECORD 20

// Eqs. 6 and 7 at every sample of the region: all groups whose billboard covers the sample and
// whose intersection with its ray lies within d_max of the triangle's depth. Where there is none,
// the triangle's depth stays. Work-groups are the tiles of 16 x 16 samples that groups are listed
// by, or parts of one; one work-item per sample.
kernel void blend_printed(REGION(const, region, reference),  // owning group, -1: outside; depth of
                                                             // the triangle
                          global const float* groups,        // [groups][GROUP_RECORD]
                          global const int* tile_start,      // [tiles + 1]
                          global const int* tile_group,      // group ids, ascending in each tile
                          global float* depth,               // [samples] out
                          global int* group,                 // [samples] out: the heaviest
                          const Screen screen,
                          const PrintedBlend how) {
  const int i = get_global_id(0), j = get_global_id(1);
  const int tile = tile_under_group(screen.nx);
  if (i >= screen.nx || j >= screen.ny) return;
  const int s = j * screen.nx + i;
  const int own = region[s];
  if (own < 0) return;
  const float u = screen.first + screen.step * (float)i, v = screen.first + screen.step * (float)j;
  const float ox = screen.rays.ox + screen.rays.ox_u * u + screen.rays.ox_v * v;
  const float oy = screen.rays.oy + screen.rays.oy_u * u + screen.rays.oy_v * v;
  const float dx = screen.rays.dx + screen.rays.dx_u * u + screen.rays.dx_v * v;
  const float dy = screen.rays.dy + screen.rays.dy_u * u + screen.rays.dy_v * v;
  const float t = reference[s];
  global const float* owner = groups + own * GROUP_RECORD;
  float sum = 0.0f, weight = 0.0f, best = 0.0f;
  int heaviest = own;
  for (int k = tile_start[tile]; k < tile_start[tile + 1]; ++k) {
    const int id = tile_group[k];
    global const float* g = groups + id * GROUP_RECORD;
    // d_k, in particle radii at the group's centre.
    const float w = how.w_row[0] * g[0] + how.w_row[1] * g[1] + how.w_row[2] * g[2] + how.w_row[3];
    const float du = (u - g[16]) * w / how.u_scale, dv = (v - g[17]) * w / how.v_scale;
    const float squared = du * du + dv * dv;
    if (squared > g[19] * g[19]) continue;
    // f along the ray: C + B tau + A tau^2, tau = depth beyond the reference; the root nearest to
    // the reference in its stable form.
    const float x = ox + t * dx - g[0], y = oy + t * dy - g[1], z = -t - g[2];
    const float gx = g[7] + 2.0f * g[10] * x + g[13] * y + g[15] * z;
    const float gy = g[8] + 2.0f * g[11] * y + g[13] * x + g[14] * z;
    const float gz = g[9] + 2.0f * g[12] * z + g[14] * y + g[15] * x;
    const float C = g[6] + 0.5f * ((gx + g[7]) * x + (gy + g[8]) * y + (gz + g[9]) * z);
    const float B = gx * dx + gy * dy - gz;
    const float A = (g[10] * dx + g[13] * dy - g[15]) * dx + (g[11] * dy - g[14]) * dy + g[12];
    const float D = B * B - 4.0f * A * C;
    if (D < 0.0f) continue;
    const float tau = C == 0.0f ? 0.0f : -2.0f * C / (B + (B < 0.0f ? -sqrt(D) : sqrt(D)));
    if (!(fabs(tau) <= how.d_max) || !(t + tau > 0.0f)) continue;
    const float like = fmax(g[3] * owner[3] + g[4] * owner[4] + g[5] * owner[5], 0.0f);
    const float b = g[18] * (how.b_least + how.b_gain * like * like * like * like);
    const float beta = 0.398942280f / (b * b) * exp_negative(-squared / (2.0f * b * b));  // Eq. 7
    sum += beta * tau;
    weight += beta;
    if (beta > best) {
      best = beta;
      heaviest = id;
    }
  }
  depth[s] = weight > 0.0f ? t + sum / weight : t;  // Eq. 6
  group[s] = heaviest;
}

// Draws the splash directly (3): the nearest sphere of a particle at every sample where it lies in
// front of the surface. One work-item per sample.
kernel void draw_spheres(global const float* sphere_depth,  // [samples] +infinity: no sphere
                         global const int* sphere,          // [samples] its particle
                         global const float* eye,           // [3][stride] particles, eye space
                         SHOWN(, ),  // in and out; group -1 and kind 2 where a sphere is drawn
                         const int stride, const Screen screen) {
  const int i = get_global_id(0), j = get_global_id(1);
  if (i >= screen.nx || j >= screen.ny) return;
  const int s = j * screen.nx + i, n = screen.nx * screen.ny;
  const float t = sphere_depth[s];
  if (!(t < depth[s])) return;
  const int p = sphere[s];
  const float u = screen.first + screen.step * (float)i, v = screen.first + screen.step * (float)j;
  const float x = screen.rays.ox + screen.rays.ox_u * u + screen.rays.ox_v * v +
                  t * (screen.rays.dx + screen.rays.dx_u * u + screen.rays.dx_v * v);
  const float y = screen.rays.oy + screen.rays.oy_u * u + screen.rays.oy_v * v +
                  t * (screen.rays.dy + screen.rays.dy_u * u + screen.rays.dy_v * v);
  const float nx = x - eye[p], ny = y - eye[stride + p], nz = -t - eye[2 * stride + p];
  const float size = sqrt(nx * nx + ny * ny + nz * nz);
  depth[s] = t;
  normal[s] = nx / size;
  normal[n + s] = ny / size;
  normal[2 * n + s] = nz / size;
  group[s] = -1;
  kind[s] = 2;
}
