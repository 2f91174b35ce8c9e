// region.cl: where there is surface (paper 2.4.1).

// The kept triangles' depth at every sample: one work-item per triangle. Kept triangles of a
// Delaunay triangulation do not overlap; on a shared edge the nearer one counts.
kernel void draw_triangles(global const float* corners,  // [9][stride] u, v, t of three corners
                           global uint* depth,           // [ny*nx] bits of the depth; +inf before
                           const int n, const int stride, const int2 samples, const float first,
                           const float step,
                           const int perspective) {  // interpolate 1/t instead of t
  const int k = get_global_id(0);
  if (k >= n) return;
  float u[3], v[3], t[3];
#pragma unroll
  for (int c = 0; c < 3; ++c) {
    u[c] = corners[(3 * c) * stride + k];
    v[c] = corners[(3 * c + 1) * stride + k];
    t[c] = corners[(3 * c + 2) * stride + k];
    if (perspective) t[c] = 1.0f / t[c];
  }
  const float doubled = (u[1] - u[0]) * (v[2] - v[0]) - (u[2] - u[0]) * (v[1] - v[0]);
  if (fabs(doubled) < 1e-9f) return;
  const float inverse = 1.0f / doubled;
  const float u0 = fmin(u[0], fmin(u[1], u[2])), u1 = fmax(u[0], fmax(u[1], u[2]));
  const float v0 = fmin(v[0], fmin(v[1], v[2])), v1 = fmax(v[0], fmax(v[1], v[2]));
  const int i0 = max(0, (int)ceil(clamp((u0 - first) / step, -1.0f, 1e6f)));
  const int i1 = min(samples.x - 1, (int)floor(clamp((u1 - first) / step, -1.0f, 1e6f)));
  const int j0 = max(0, (int)ceil(clamp((v0 - first) / step, -1.0f, 1e6f)));
  const int j1 = min(samples.y - 1, (int)floor(clamp((v1 - first) / step, -1.0f, 1e6f)));
  for (int j = j0; j <= j1; ++j)
    for (int i = i0; i <= i1; ++i) {
      const float x = first + step * (float)i, y = first + step * (float)j;
      const float l1 = ((x - u[0]) * (v[2] - v[0]) - (u[2] - u[0]) * (y - v[0])) * inverse;
      const float l2 = ((u[1] - u[0]) * (y - v[0]) - (x - u[0]) * (v[1] - v[0])) * inverse;
      const float l0 = 1.0f - l1 - l2;
      if (l0 < -1e-5f || l1 < -1e-5f || l2 < -1e-5f) continue;
      float d = l0 * t[0] + l1 * t[1] + l2 * t[2];
      if (perspective) d = 1.0f / d;
      if (d > 0.0f) atomic_min(depth + j * samples.x + i, as_uint(d));
    }
}
