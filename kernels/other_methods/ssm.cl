// ssm.cl: the depth map of Screen Space Meshes (Mueller, Schirm, Duthaler 2007, 3.3), smoothed,
// and its normals.
// Departures: the filter's half width n may be any number, not only a whole one, so that it can
// follow the perspective (n = 2 sigma^2, sigma in samples), and taps below 1/1024 of the centre's
// weight are left out.

// One pass of the separable binomial filter along a line of samples `stride` apart.
// The weights are the row 2n of Pascal's triangle, w(0) = 1, w(k + 1) = w(k) (n - k) / (n + k + 1).
// The window grows by a sample on both sides while both lie within z_max of the centre; a window
// that is symmetric keeps planes.
// reach: how many samples the line has on both sides, in each lane; `sure` in all, `most` in some.
inline floatv smooth(global const float* here, const int stride, const intv reach, const int sure,
                     const int most, const float z_max, const float4 spread) {
  const floatv centre = LOADF(here);
  const floatv scale = spread.y + spread.z * centre;
  const floatv n = spread.x / (scale * scale);
  floatv weight = (floatv)(1.0f), weights = (floatv)(0.0f), sum = (floatv)(0.0f);
  floatv tap = (floatv)(0.0f);  // k, as a float
  intv open = (fabs(centre) < INFINITY) & (reach >= 0);
  for (int k = 0; k < most && ANY(open); ++k) {
    weight = weight * ((n - tap) / (n + (tap + 1.0f)));
    tap += 1.0f;
    const floatv before = LOADF(here - (k + 1) * stride) - centre;
    const floatv after = LOADF(here + (k + 1) * stride) - centre;
    const floatv jump = SELECT(fabs(before), fabs(after), fabs(after) > fabs(before));
    open &= (weight >= 1.0f / 1024.0f) & (jump <= z_max);
    if (k >= sure) open &= k < reach;
    weights += SELECT((floatv)(0.0f), weight, open);
    sum += SELECT((floatv)(0.0f), weight * (before + after), open);
  }
  return centre + sum / (1.0f + 2.0f * weights);
}

// Moves the rows of a map apart. One work-item per WIDTH neighbours of a row.
kernel void space_rows(global const float* depth,  // [ny*nx]
                       global float* spaced,       // [ny*stride]
                       const int nx, const int ny, const int stride) {
  const int i = get_global_id(0) * WIDTH;
  const int j = get_global_id(1);
  if (i >= nx || j >= ny) return;  // the range is rounded up to whole work-groups
  store_lanes(LOADF(depth + j * nx + i), spaced + j * stride + i, nx - i);
}

// Down the columns. One work-item per WIDTH neighbours of a row.
kernel void smooth_columns(global const float* depth,  // [ny*stride] particle radii; +inf: none
                           global float* smoothed,     // [WIDTH + ny*nx] the first WIDTH unused
                           const int nx, const int ny, const int stride,
                           const float z_max,      // particle radii
                           const float4 spread) {  // n = x / (y + z t)^2
  const int i = get_global_id(0) * WIDTH;
  const int j = get_global_id(1);
  if (i >= nx || j >= ny) return;  // the range is rounded up to whole work-groups
  const int reach = min(j, ny - 1 - j);
  store_lanes(smooth(depth + j * stride + i, stride, (intv)(reach), reach, reach, z_max, spread),
              smoothed + WIDTH + j * nx + i, nx - i);
}

// Along the rows; some lanes reach beyond the row's ends, where others' depths are read for
// nothing.
kernel void smooth_rows(global const float* depth,  // [WIDTH + ny*nx]
                        global float* smoothed,     // [ny*nx]
                        const int nx, const int ny, const float z_max, const float4 spread) {
  const int i = get_global_id(0) * WIDTH;
  const int j = get_global_id(1);
  if (i >= nx || j >= ny) return;
  const intv place = i + TO_INTV(LANES);
  const int sure = min(i, nx - i - WIDTH);
  store_lanes(smooth(depth + WIDTH + j * nx + i, 1, min(place, nx - 1 - place), sure,
                     min(i + WIDTH, nx - i) - 1, z_max, spread),
              smoothed + j * nx + i, nx - i);
}

// Normals of a depth map: the cross product of the differences between the neighbours along u and
// along v. A neighbour farther than z_max in depth is another layer: then the sample itself takes
// its place; with neither neighbour the surface is taken to be parallel to the screen.
// One work-item per WIDTH neighbours of a row.
kernel void depth_normals(global const float* depth,  // [ny*nx] particle radii; +inf: no surface
                          global float* normal,  // [3][ny*nx] unit, towards the camera, eye axes;
                                                 // zero where there is no surface
                          const int nx, const int ny,
                          const float2 grid,  // first sample and step, pixels
                          const float z_max,  // particle radii
                          const RayMap ray) {
  const int i = get_global_id(0) * WIDTH;
  const int j = get_global_id(1);
  if (i >= nx || j >= ny) return;  // the range is rounded up to whole work-groups
  global const float* here = depth + j * nx + i;
  const int size = nx * ny;
  const floatv t = LOADF(here);
  const intv surface = t < INFINITY;
  floatv x = (floatv)(0.0f), y = (floatv)(0.0f), z = (floatv)(0.0f);
  if (ANY(surface)) {
    const floatv none = (floatv)(INFINITY);
    const intv place = i + TO_INTV(LANES);
    floatv left;
    if (i > 0) {
      left = LOADF(here - 1);
    } else {
      float lanes[WIDTH + 1];
      lanes[0] = INFINITY;
      STOREF(t, lanes + 1);
      left = LOADF(lanes);
    }
    const floatv right = SELECT(LOADF(here + 1), none, place == nx - 1);
    const floatv above = j > 0 ? LOADF(here - nx) : none;
    const floatv below = j + 1 < ny ? LOADF(here + nx) : none;
    const intv use_left = fabs(left - t) <= z_max, use_right = fabs(right - t) <= z_max;
    const intv use_above = fabs(above - t) <= z_max, use_below = fabs(below - t) <= z_max;

    const floatv u = grid.x + grid.y * TO_FLOATV(place);
    const floatv v = (floatv)(grid.x + grid.y * (float)j);
    // With neither neighbour along an axis the next ray is met at the same depth.
    const Rays at = rays_at(ray, u, v);
    const Rays to_right = rays_at(ray, SELECT(u + grid.y, u, use_left & !use_right), v);
    const Rays to_left = rays_at(ray, SELECT(u, u - grid.y, use_left), v);
    const Rays to_below = rays_at(ray, u, SELECT(v + grid.y, v, use_above & !use_below));
    const Rays to_above = rays_at(ray, u, SELECT(v, v - grid.y, use_above));
    const floatv t_right = SELECT(t, right, use_right), t_left = SELECT(t, left, use_left);
    const floatv t_below = SELECT(t, below, use_below), t_above = SELECT(t, above, use_above);
    const floatv ux = (to_right.ox + t_right * to_right.dx) - (to_left.ox + t_left * to_left.dx);
    const floatv uy = (to_right.oy + t_right * to_right.dy) - (to_left.oy + t_left * to_left.dy);
    const floatv uz = -t_right - -t_left;
    const floatv vx = (to_below.ox + t_below * to_below.dx) - (to_above.ox + t_above * to_above.dx);
    const floatv vy = (to_below.oy + t_below * to_below.dy) - (to_above.oy + t_above * to_above.dy);
    const floatv vz = -t_below - -t_above;
    x = vy * uz - vz * uy;
    y = vz * ux - vx * uz;
    z = vx * uy - vy * ux;
    const floatv away = x * at.dx + y * at.dy - z;
    const floatv length = sqrt(x * x + y * y + z * z);
    const floatv scale = SELECT((floatv)(1.0f), (floatv)(-1.0f), away > 0.0f) / length;
    x = SELECT((floatv)(0.0f), x * scale, surface);
    y = SELECT((floatv)(0.0f), y * scale, surface);
    z = SELECT((floatv)(0.0f), z * scale, surface);
  }
  global float* to = normal + j * nx + i;
  store_lanes(x, to, nx - i);
  store_lanes(y, to + size, nx - i);
  store_lanes(z, to + 2 * size, nx - i);
}
