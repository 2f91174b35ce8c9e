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

// Closes pinholes and removes specks. A sample hangs together with those of its eight neighbours
// whose depths differ by at most `jump`. One without surface takes the mean of their farthest layer
// when at least six of them have surface, or 17 of the 24 around, as at the corner of a small hole.
// One of the surface that hangs together with fewer than three is no surface where most neighbours
// have none, else it takes the mean of their farthest layer; and so does one whose normal stands
// alone among neighbours that agree (where two sheets graze each other). Splash is left alone: a
// droplet may be one sample. One work-item per sample; the border is copied.
kernel void close_specks(global const float* depth,   // [ny*nx] particle radii
                         global const float* normal,  // [3][ny*nx]
                         global const int* group, global const uchar* kind,
                         global float* closed_depth, global float* closed_normal,
                         global int* closed_group, global uchar* closed_kind, const int2 samples,
                         const float jump) {  // particle radii
  const int i = get_global_id(0), j = get_global_id(1);
  if (i >= samples.x || j >= samples.y) return;
  const int s = j * samples.x + i, n = samples.x * samples.y;
  const float t = depth[s];
  float nx = normal[s], ny = normal[n + s], nz = normal[2 * n + s];
  float result = t;
  int id = group[s];
  uchar what = kind[s];
  const int inside = i > 0 && j > 0 && i < samples.x - 1 && j < samples.y - 1;
  const int empty = !(t < INFINITY);
  if (inside && (empty || what != 2)) {
    float far = 0.0f;
    int covered = 0, joined = 0;
    for (int k = 0; k < 9; ++k) {
      const float d = depth[s + (k / 3 - 1) * samples.x + k % 3 - 1];
      if (k == 4 || !(d < INFINITY)) continue;
      ++covered;
      far = fmax(far, d);
      joined += fabs(d - t) <= jump;
    }
    int around = 0;
    if (empty && i > 1 && j > 1 && i < samples.x - 2 && j < samples.y - 2)
      for (int k = 0; k < 25; ++k)
        around += depth[s + (k / 5 - 2) * samples.x + k % 5 - 2] < INFINITY;
    // The farthest layer, which for a sample of the surface is one that it does not belong to
    // unless all neighbours do.
    float sum = 0.0f, sx = 0.0f, sy = 0.0f, sz = 0.0f;
    int count = 0, first = s;
    for (int k = 0; k < 9; ++k) {
      const int p = s + (k / 3 - 1) * samples.x + k % 3 - 1;
      const float d = depth[p];
      if (k == 4 || !(d < INFINITY) || far - d > jump) continue;
      if (count == 0) first = p;
      ++count;
      sum += d;
      sx += normal[p];
      sy += normal[n + p];
      sz += normal[2 * n + p];
    }
    const float size = sqrt(sx * sx + sy * sy + sz * sz);
    const float along = nx * sx + ny * sy + nz * sz;
    const float agreement = size / (float)max(count, 1);  // 1: all neighbours' normals are the same
    const int alone = count >= 6 && count == covered && agreement > 0.93f &&
                      along < (agreement - 0.03f) * size;
    const int speck = !empty && joined < 3;
    if (speck && covered < 5) {
      result = INFINITY;
      nx = ny = nz = 0.0f;
      id = -1;
      what = 0;
    } else if ((empty ? covered >= 6 || around >= 17 : speck || alone) && count >= (empty ? 1 : 3) &&
               size > 0.0f) {
      result = sum / (float)count;
      nx = sx / size;
      ny = sy / size;
      nz = sz / size;
      id = group[first];
      what = kind[first];
    }
  }
  closed_depth[s] = result;
  closed_normal[s] = nx;
  closed_normal[n + s] = ny;
  closed_normal[2 * n + s] = nz;
  closed_group[s] = id;
  closed_kind[s] = what;
}
