// filter.cl: the screen-space filters that smooth the depth map of the particles' spheres:
// bilateral (as in Green 2010), narrow-range (Truong and Yuksel 2018) and curvature flow (van der
// Laan, Green and Sainz 2009).
// Maps are padded here: sample (i, j) is stored at (j + pad) * stride + i + pad, with NaN around,
// so that a window needs no tests for the image's ends, and what lies beyond them is not taken for
// background; stride >= nx + 2 pad + WIDTH.
// One work-item per WIDTH neighbours of a row. A lane's window is its own: what its neighbours
// need beside it has no weight in it, which gives every WIDTH the same bits.
// Departures: windows follow the perspective on both axes, any half width down to none; they are
// discs of 2.5 sigma.

typedef struct {
  int nx, ny, pad, stride;
} Layout;

inline int place(const Layout m, const int i, const int j) {
  return (j + m.pad) * m.stride + i + m.pad;
}

// Into a padded map that holds NaN. One work-item per sample.
kernel void pad_depth(global const float* depth, global float* padded, const int4 layout) {
  const Layout m = {layout.x, layout.y, layout.z, layout.w};
  const int i = get_global_id(0), j = get_global_id(1);
  if (i >= m.nx || j >= m.ny) return;  // the range is rounded up to whole work-groups
  padded[place(m, i, j)] = depth[j * m.nx + i];
}

kernel void crop_depth(global const float* padded, global float* depth, const int4 layout) {
  const Layout m = {layout.x, layout.y, layout.z, layout.w};
  const int i = get_global_id(0), j = get_global_id(1);
  if (i >= m.nx || j >= m.ny) return;  // the range is rounded up to whole work-groups
  depth[j * m.nx + i] = padded[place(m, i, j)];
}

#define CUT 3.125f  // the exponent at 2.5 sigma

// A Gaussian on the screen, sigma in samples inverse to clip w.
typedef struct {
  floatv u, v;       // 1 / (2 sigma^2) along each axis
  int reach_u, reach_v;  // samples, at least what each lane needs
} Window;

inline int widest(const floatv falloff, const intv open, const int pad) {
  float reach[WIDTH];
  STOREF(SELECT((floatv)(0.0f), sqrt(CUT / falloff), open), reach);
  float most = reach[0];
  for (int lane = 1; lane < WIDTH; ++lane) most = fmax(most, reach[lane]);
  return (int)fmin(most, (float)pad);
}

// spread: (sigma in samples * w)^2 along u and v, then w = z + w t. axes: 1 for those that the
// window extends along, so that one kernel is the two-dimensional filter and both passes of the
// separable one.
inline Window window_at(const floatv t, const intv open, const float4 spread, const int2 axes,
                        const int pad) {
  Window window;
  const floatv w = spread.z + spread.w * t;
  window.u = w * w * (0.5f / spread.x);
  window.v = w * w * (0.5f / spread.y);
  window.reach_u = axes.x ? widest(window.u, open, pad) : 0;
  window.reach_v = axes.y ? widest(window.v, open, pad) : 0;
  return window;
}

// sum_j w_j t_j / sum_j w_j, w_j = G(|x_j - x_i|; sigma) G(t_j - t_i; range).
kernel void filter_bilateral(global const float* depth,  // padded; +inf: no surface
                             global float* smoothed,     // padded
                             const int4 layout, const int2 axes, const float4 spread,
                             const float range_falloff) {  // 1 / (2 range^2), 1 / radii^2
  const Layout m = {layout.x, layout.y, layout.z, layout.w};
  const int i = get_global_id(0) * WIDTH, j = get_global_id(1);
  if (i >= m.nx || j >= m.ny) return;  // the range is rounded up to whole work-groups
  const int here = place(m, i, j);
  const floatv centre = LOADF(depth + here);
  const intv open = fabs(centre) < INFINITY;
  if (!ANY(open)) return;  // the result holds infinity already
  const floatv t = SELECT((floatv)(1.0f), centre, open);
  const Window window = window_at(t, open, spread, axes, m.pad);
  floatv sum = (floatv)(0.0f), total = (floatv)(0.0f);
  for (int dj = -window.reach_v; dj <= window.reach_v; ++dj)
    for (int di = -window.reach_u; di <= window.reach_u; ++di) {
      const floatv there = LOADF(depth + here + dj * m.stride + di);
      const floatv apart = (float)(di * di) * window.u + (float)(dj * dj) * window.v;
      const intv counts = open & (apart <= CUT) & (fabs(there) < INFINITY);
      const floatv step = SELECT((floatv)(0.0f), there - t, counts);
      const floatv weight = SELECT((floatv)(0.0f),
                                   exp_negative(-(apart + step * step * range_falloff)), counts);
      sum += weight * step;
      total += weight;
    }
  STOREF(SELECT(centre, centre + sum / larger(total, (floatv)(1e-30f)), open), smoothed + here);
}

// The depths that a sample on one side of the centre may have.
typedef struct {
  floatv low, high;
} Span;

// A pair of samples that lie opposite each other. One nearer than its span is another surface in
// front, one outside the image is unknown: then neither counts, which keeps the window symmetric.
// One beyond its span counts as mu behind the centre. One within it moves the span's ends to at
// least delta around it.
inline void add_pair(const floatv a, const floatv b, const floatv weight, const intv open,
                     const floatv t, const float delta, const float mu, Span* sa, Span* sb,
                     floatv* sum, floatv* total) {
  const intv near_a = a < sa->low, near_b = b < sb->low;
  const intv far_a = a > sa->high, far_b = b > sb->high;
  const intv counts = open & (near_a == 0) & (near_b == 0) & (a == a) & (b == b);
  const floatv steps =
      SELECT(a - t, (floatv)(mu), far_a) + SELECT(b - t, (floatv)(mu), far_b);
  *sum += SELECT((floatv)(0.0f), weight * steps, counts);
  *total += SELECT((floatv)(0.0f), 2.0f * weight, counts);
  const intv within_a = (near_a == 0) & (far_a == 0), within_b = (near_b == 0) & (far_b == 0);
  sa->low = SELECT(sa->low, smaller(sa->low, a - delta), within_a);
  sa->high = SELECT(sa->high, larger(sa->high, a + delta), within_a);
  sb->low = SELECT(sb->low, smaller(sb->low, b - delta), within_b);
  sb->high = SELECT(sb->high, larger(sb->high, b + delta), within_b);
}

// The narrow-range filter: a Gaussian over the samples within delta of the centre, or of samples on
// the way to them (the paper's dynamic range). In two dimensions the way leads along the column
// first and then along the row.
kernel void filter_narrow_range(global const float* depth,  // padded; +inf: no surface
                                global float* smoothed,     // padded
                                const int4 layout, const int2 axes, const float4 spread,
                                const float2 limits) {  // delta, mu, particle radii
  const Layout m = {layout.x, layout.y, layout.z, layout.w};
  const int i = get_global_id(0) * WIDTH, j = get_global_id(1);
  if (i >= m.nx || j >= m.ny) return;  // the range is rounded up to whole work-groups
  const int here = place(m, i, j);
  const floatv centre = LOADF(depth + here);
  const intv open = fabs(centre) < INFINITY;
  if (!ANY(open)) return;  // the result holds infinity already
  const floatv t = SELECT((floatv)(1.0f), centre, open);
  const Window window = window_at(t, open, spread, axes, m.pad);
  const float delta = limits.x, mu = limits.y;
  floatv sum = (floatv)(0.0f), total = (floatv)(1.0f);
  Span up = {t - delta, t + delta}, down = up;
  for (int dj = 0; dj <= window.reach_v; ++dj) {
    global const float* below = depth + here + dj * m.stride;
    global const float* above = depth + here - dj * m.stride;
    const floatv apart = (float)(dj * dj) * window.v;
    if (dj > 0)
      add_pair(LOADF(below), LOADF(above), exp_negative(-apart), open & (apart <= CUT), t, delta,
               mu, &down, &up, &sum, &total);
    Span down_right = down, down_left = down, up_right = up, up_left = up;
    for (int di = 1; di <= window.reach_u; ++di) {
      const floatv squared = (float)(di * di) * window.u + apart;
      const intv counts = open & (squared <= CUT);
      if (!ANY(counts)) break;
      const floatv weight = exp_negative(-squared);
      add_pair(LOADF(below + di), LOADF(above - di), weight, counts, t, delta, mu, &down_right,
               &up_left, &sum, &total);
      if (dj > 0)
        add_pair(LOADF(below - di), LOADF(above + di), weight, counts, t, delta, mu, &down_left,
                 &up_right, &sum, &total);
    }
  }
  STOREF(SELECT(centre, centre + sum / total, open), smoothed + here);
}

// One explicit step of mean curvature flow: the surface moves by dtau times its mean curvature
// H = (E N - 2 F M + G L) / (2 (E G - F^2)) along its normal, and so a ray meets it
// dtau H / (n.D) deeper, D the ray's direction. The fundamental forms are those of the eye points
// X(u, v) themselves, perspective or not. (Van der Laan et al. move the depth itself, and leave out
// how the ray's direction changes across the screen.)
// A neighbour more than z_max away in depth is beyond a silhouette: no second difference reaches
// there, and the first ones are one-sided.
kernel void flow_step(global const float* depth,  // padded; +inf: no surface
                      global float* flowed,       // padded
                      const int4 layout,
                      const float step,      // pixels from sample to sample
                      const float first,     // pixels
                      const float2 limits,  // z_max, radii; dtau, radii^2
                      const RayMap rays) {
  const Layout m = {layout.x, layout.y, layout.z, layout.w};
  const int i = get_global_id(0) * WIDTH, j = get_global_id(1);
  if (i >= m.nx || j >= m.ny) return;  // the range is rounded up to whole work-groups
  const int here = place(m, i, j);
  const floatv centre = LOADF(depth + here);
  const intv open = fabs(centre) < INFINITY;
  if (!ANY(open)) return;  // the result holds infinity already
  const floatv t = SELECT((floatv)(1.0f), centre, open);
  const float z_max = limits.x;

  // Differences in depth to the eight neighbours, zero across a silhouette.
  floatv d[3][3];
  intv has[3][3];
#pragma unroll
  for (int b = 0; b < 3; ++b)
#pragma unroll
    for (int a = 0; a < 3; ++a) {
      const floatv change = LOADF(depth + here + (b - 1) * m.stride + a - 1) - t;
      has[b][a] = fabs(change) <= z_max;
      d[b][a] = SELECT((floatv)(0.0f), change, has[b][a]);
    }

  // The eye point of a neighbour (a, b) samples away, relative to the centre's, is
  // a U + b V + d (D + a DU + b DV), in z: -d.
  const floatv u = first + step * ((float)i + LANES);
  const float v = first + step * (float)j;
  const floatv dx = rays.dx + rays.dx_u * u + rays.dx_v * v,
               dy = rays.dy + rays.dy_u * u + rays.dy_v * v;
  const float dux = step * rays.dx_u, duy = step * rays.dy_u;
  const float dvx = step * rays.dx_v, dvy = step * rays.dy_v;
  const floatv ux = step * rays.ox_u + t * dux, uy = step * rays.oy_u + t * duy;
  const floatv vx = step * rays.ox_v + t * dvx, vy = step * rays.oy_v + t * dvy;

  const intv both_u = has[1][0] & has[1][2], both_v = has[0][1] & has[2][1];
  const floatv half_u = SELECT((floatv)(1.0f), (floatv)(0.5f), both_u);
  const floatv half_v = SELECT((floatv)(1.0f), (floatv)(0.5f), both_v);
  // First differences; the parts with a U and b V are whole whether one- or two-sided.
  const floatv right = d[1][2], left = d[1][0], below = d[2][1], above = d[0][1];
  const floatv xu_x = ux + half_u * (right * (dx + dux) - left * (dx - dux));
  const floatv xu_y = uy + half_u * (right * (dy + duy) - left * (dy - duy));
  const floatv xu_z = half_u * (left - right);
  const floatv xv_x = vx + half_v * (below * (dx + dvx) - above * (dx - dvx));
  const floatv xv_y = vy + half_v * (below * (dy + dvy) - above * (dy - dvy));
  const floatv xv_z = half_v * (above - below);
  // Second differences.
  const floatv keep_u = SELECT((floatv)(0.0f), (floatv)(1.0f), both_u);
  const floatv keep_v = SELECT((floatv)(0.0f), (floatv)(1.0f), both_v);
  const floatv uu_x = keep_u * (right * (dx + dux) + left * (dx - dux));
  const floatv uu_y = keep_u * (right * (dy + duy) + left * (dy - duy));
  const floatv uu_z = -keep_u * (right + left);
  const floatv vv_x = keep_v * (below * (dx + dvx) + above * (dx - dvx));
  const floatv vv_y = keep_v * (below * (dy + dvy) + above * (dy - dvy));
  const floatv vv_z = -keep_v * (below + above);
  const intv corners = has[0][0] & has[0][2] & has[2][0] & has[2][2] & both_u & both_v;
  const floatv keep_uv = SELECT((floatv)(0.0f), (floatv)(0.25f), corners);
  const floatv pp = d[2][2], pm = d[0][2], mp = d[2][0], mm = d[0][0];  // u first, then v
  const floatv uv_x = keep_uv * (pp * (dx + dux + dvx) - pm * (dx + dux - dvx) -
                                 mp * (dx - dux + dvx) + mm * (dx - dux - dvx));
  const floatv uv_y = keep_uv * (pp * (dy + duy + dvy) - pm * (dy + duy - dvy) -
                                 mp * (dy - duy + dvy) + mm * (dy - duy - dvy));
  const floatv uv_z = keep_uv * (pm + mp - pp - mm);

  const floatv nx = xu_y * xv_z - xu_z * xv_y;
  const floatv ny = xu_z * xv_x - xu_x * xv_z;
  const floatv nz = xu_x * xv_y - xu_y * xv_x;
  const floatv e = xu_x * xu_x + xu_y * xu_y + xu_z * xu_z;
  const floatv f = xu_x * xv_x + xu_y * xv_y + xu_z * xv_z;
  const floatv g = xv_x * xv_x + xv_y * xv_y + xv_z * xv_z;
  const floatv l = uu_x * nx + uu_y * ny + uu_z * nz;
  const floatv mixed = uv_x * nx + uv_y * ny + uv_z * nz;
  const floatv n = vv_x * nx + vv_y * ny + vv_z * nz;
  const floatv squared = nx * nx + ny * ny + nz * nz;  // E G - F^2
  const floatv along = nx * dx + ny * dy - nz;         // |n| n.D
  const floatv speed = (e * n - 2.0f * f * mixed + g * l) / (2.0f * squared * along);
  // A tenth of a radius at most: what a ray that grazes would see.
  const floatv move = fmin(fmax(limits.y * speed, (floatv)(-0.1f)), (floatv)(0.1f));
  STOREF(SELECT(centre, centre + move, open), flowed + here);
}
