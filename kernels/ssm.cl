// ssm.cl: the depth map of Screen Space Meshes (Mueller, Schirm, Duthaler 2007, 3.3), smoothed,
// and its normals.
// Departures: the filter's half width n may be any number, not only a whole one, so that it can
// follow the perspective (n = 2 sigma^2, sigma in samples), and taps below 1/1024 of the centre's
// weight are left out.

// One pass of the separable binomial filter, down the columns. The result is transposed, so that
// the same pass filters the rows next and turns the map back.
// The weights are the row 2n of Pascal's triangle, w(0) = 1, w(k + 1) = w(k) (n - k) / (n + k + 1).
// The window grows by a sample on both sides while both lie within z_max of the centre; a window
// that is symmetric keeps planes.
// One work-item per WIDTH neighbours of a row.
kernel void smooth_columns(global const float* depth,  // [ny*nx] particle radii; +inf: no surface
                           global float* smoothed,     // [nx*ny] the result, transposed
                           const int nx, const int ny,
                           const float z_max,      // particle radii
                           const float4 spread) {  // n = x / (y + z t)^2
  const int i = get_global_id(0) * WIDTH;
  const int j = get_global_id(1);
  if (i >= nx || j >= ny) return;  // the range is rounded up to whole work-groups
  global const float* here = depth + j * nx + i;
  const floatv centre = LOADF(here);
  const floatv scale = spread.y + spread.z * centre;
  const floatv n = spread.x / (scale * scale);
  const int reach = min(j, ny - 1 - j);
  floatv weight = (floatv)(1.0f), total = (floatv)(1.0f), sum = (floatv)(0.0f);
  intv open = fabs(centre) < INFINITY;
  for (int k = 0; k < reach; ++k) {
    weight = weight * ((n - (float)k) / (n + (float)(k + 1)));
    open = open & (weight >= 1.0f / 1024.0f);
    if (!ANY(open)) break;
    const floatv above = LOADF(here - (k + 1) * nx) - centre;
    const floatv below = LOADF(here + (k + 1) * nx) - centre;
    open = open & (fabs(above) <= z_max) & (fabs(below) <= z_max);
    sum += SELECT((floatv)(0.0f), weight * (above + below), open);
    total += SELECT((floatv)(0.0f), 2.0f * weight, open);
  }
  float result[WIDTH];
  STOREF(centre + sum / total, result);
  for (int lane = 0; lane < WIDTH; ++lane)
    if (i + lane < nx) smoothed[(i + lane) * ny + j] = result[lane];
}

// The eye point at depth t on the ray of pixel (u, v), see view.hpp.
inline float3 point_on_ray(const float16 ray, const float u, const float v, const float t) {
  const float2 from = ray.s03 + ray.s14 * u + ray.s25 * v;
  const float2 along = ray.s69 + ray.s7a * u + ray.s8b * v;
  return (float3)(from + t * along, -t);
}

// Normals of a depth map: the cross product of the differences between the neighbours along u and
// along v. A neighbour farther than z_max in depth is another layer: then the sample itself takes
// its place; with neither neighbour the surface is taken to be parallel to the screen.
// One work-item per sample.
kernel void depth_normals(global const float* depth,  // [ny*nx] particle radii; +inf: no surface
                          global float* normal,  // [3][ny*nx] unit, towards the camera, eye axes;
                                                 // zero where there is no surface
                          const int nx, const int ny,
                          const float2 grid,  // first sample and step, pixels
                          const float z_max,  // particle radii
                          const float16 ray) {
  const int i = get_global_id(0);
  const int j = get_global_id(1);
  if (i >= nx || j >= ny) return;  // the range is rounded up to whole work-groups
  const int here = j * nx + i;
  const float t = depth[here];
  const float u = grid.x + grid.y * (float)i, v = grid.x + grid.y * (float)j;
  float3 n = (float3)(0.0f);
  if (t < INFINITY) {
    const float left = i > 0 ? depth[here - 1] : INFINITY;
    const float right = i + 1 < nx ? depth[here + 1] : INFINITY;
    const float above = j > 0 ? depth[here - nx] : INFINITY;
    const float below = j + 1 < ny ? depth[here + nx] : INFINITY;
    const int use_left = fabs(left - t) <= z_max, use_right = fabs(right - t) <= z_max;
    const int use_above = fabs(above - t) <= z_max, use_below = fabs(below - t) <= z_max;
    const int flat_u = !use_left && !use_right, flat_v = !use_above && !use_below;
    const float3 along_u =
        point_on_ray(ray, use_right || flat_u ? u + grid.y : u, v, use_right ? right : t) -
        point_on_ray(ray, use_left ? u - grid.y : u, v, use_left ? left : t);
    const float3 along_v =
        point_on_ray(ray, u, use_below || flat_v ? v + grid.y : v, use_below ? below : t) -
        point_on_ray(ray, u, use_above ? v - grid.y : v, use_above ? above : t);
    n.x = along_v.y * along_u.z - along_v.z * along_u.y;
    n.y = along_v.z * along_u.x - along_v.x * along_u.z;
    n.z = along_v.x * along_u.y - along_v.y * along_u.x;
    const float2 direction = ray.s69 + ray.s7a * u + ray.s8b * v;
    const float away = n.x * direction.x + n.y * direction.y - n.z;
    const float length = sqrt(n.x * n.x + n.y * n.y + n.z * n.z);
    n = n * ((away > 0.0f ? -1.0f : 1.0f) / length);
  }
  const int size = nx * ny;
  normal[here] = n.x;
  normal[size + here] = n.y;
  normal[2 * size + here] = n.z;
}
