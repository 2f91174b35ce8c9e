// visible.cl: the depth map and the particles that own it (paper 2.1, steps 1 and 2).
// Each particle is a sphere of `footprint` times its radius; on the screen an ellipse of half axes
// footprint * ku and footprint * kv pixels. Its front at node (i, j) is
//   t = t_p - bulge * sqrt(1 - d^2),  d = distance from the centre in units of the half axes,
// with bulge = footprint * scale for the sphere itself. Depths are positive floats, whose bits
// order like integers: atomic_min on them gives the same map whatever the order of the particles.
// Where two particles are equally near, the lower index wins.
// One work-item per particle.

typedef struct {
  int i0, i1, j0, j1;  // nodes that the ellipse may cover, both ends included
} Box;

inline Box nodes_under(const float u, const float v, const float ru, const float rv, const int nx,
                       const int ny, const float first, const float inverse_step) {
  Box box;
  box.i0 = max(0, (int)ceil(clamp((u - ru - first) * inverse_step, -1.0f, 1e6f)));
  box.i1 = min(nx - 1, (int)floor(clamp((u + ru - first) * inverse_step, -1.0f, 1e6f)));
  box.j0 = max(0, (int)ceil(clamp((v - rv - first) * inverse_step, -1.0f, 1e6f)));
  box.j1 = min(ny - 1, (int)floor(clamp((v + rv - first) * inverse_step, -1.0f, 1e6f)));
  return box;
}

// A particle's ellipse on the screen.
typedef struct {
  float t, bulge;              // particle radii
  float u, v;                  // pixels
  float inverse_u, inverse_v;  // one over the half axes, 1 / pixels
  Box box;
} Splat;

inline Splat load_splat(global const float* particles, const int p, const int stride,
                        const int2 nodes, const float2 origin, const float2 sphere) {
  Splat s;
  s.t = particles[p];
  s.u = particles[stride + p];
  s.v = particles[2 * stride + p];
  const float ru = sphere.x * particles[3 * stride + p];
  const float rv = sphere.x * particles[4 * stride + p];
  s.bulge = sphere.x * sphere.y * particles[5 * stride + p];
  s.inverse_u = 1.0f / ru;
  s.inverse_v = 1.0f / rv;
  s.box = nodes_under(s.u, s.v, ru, rv, nodes.x, nodes.y, origin.x, origin.y);
  return s;
}

// Depth of the front at a node, or a negative number outside the ellipse.
inline float front_at(const float t, const float bulge, const float du, const float dv) {
  const float q = 1.0f - (du * du + dv * dv);
  return q < 0.0f ? -1.0f : fmax(t - bulge * sqrt(q), 1e-6f);
}

// The nearest front at every node that lies deeper than behind[node] + gap; behind may be the map
// of an earlier call (a second layer) or a map of zeros with gap 0 (the first layer).
kernel void splat_depth(global const float* particles,  // [6][stride] t, u, v, ku, kv, scale
                        global const float* behind,     // [ny*nx] depth, particle radii
                        global uint* depth,             // [ny*nx] bits of the depth; +inf before
                        const int n, const int stride,
                        const int2 nodes,      // nx, ny
                        const float2 origin,   // first node's coordinate, 1 / step; pixels
                        const float step,      // pixels
                        const float2 sphere,   // footprint; bulge over footprint
                        const float gap) {     // particle radii
  const int p = get_global_id(0);
  if (p >= n) return;
  const Splat s = load_splat(particles, p, stride, nodes, origin, sphere);
  for (int j = s.box.j0; j <= s.box.j1; ++j) {
    const float dv = (origin.x + step * (float)j - s.v) * s.inverse_v;
    for (int i = s.box.i0; i <= s.box.i1; ++i) {
      const float du = (origin.x + step * (float)i - s.u) * s.inverse_u;
      const float front = front_at(s.t, s.bulge, du, dv);
      const int node = j * nodes.x + i;
      if (front > 0.0f && front > behind[node] + gap) atomic_min(depth + node, as_uint(front));
    }
  }
}

// The lowest index among the particles whose front is the depth map's.
kernel void splat_index(global const float* particles, global const uint* depth,
                        global int* owner,  // [ny*nx] INT_MAX before
                        const int n, const int stride, const int2 nodes, const float2 origin,
                        const float step, const float2 sphere) {
  const int p = get_global_id(0);
  if (p >= n) return;
  const Splat s = load_splat(particles, p, stride, nodes, origin, sphere);
  for (int j = s.box.j0; j <= s.box.j1; ++j) {
    const float dv = (origin.x + step * (float)j - s.v) * s.inverse_v;
    for (int i = s.box.i0; i <= s.box.i1; ++i) {
      const float du = (origin.x + step * (float)i - s.u) * s.inverse_u;
      const float front = front_at(s.t, s.bulge, du, dv);
      const int node = j * nodes.x + i;
      if (front > 0.0f && as_uint(front) == depth[node]) atomic_min(owner + node, p);
    }
  }
}

// How many nodes each particle owns.
kernel void count_owned(global const float* particles, global const int* owner,
                        global int* owned,  // [n]
                        const int n, const int stride, const int2 nodes, const float2 origin,
                        const float2 sphere) {
  const int p = get_global_id(0);
  if (p >= n) return;
  const Splat s = load_splat(particles, p, stride, nodes, origin, sphere);
  int count = 0;
  for (int j = s.box.j0; j <= s.box.j1; ++j)
    for (int i = s.box.i0; i <= s.box.i1; ++i) count += owner[j * nodes.x + i] == p;
  owned[p] = count;
}

// The farthest back, t + bulge sqrt(1 - d^2), of the ellipses at every node; 0 where there is none.
kernel void splat_far(global const float* particles, global uint* depth,  // [ny*nx] 0 before
                      const int n, const int stride, const int2 nodes, const float2 origin,
                      const float step, const float2 sphere) {
  const int p = get_global_id(0);
  if (p >= n) return;
  const Splat s = load_splat(particles, p, stride, nodes, origin, sphere);
  for (int j = s.box.j0; j <= s.box.j1; ++j) {
    const float dv = (origin.x + step * (float)j - s.v) * s.inverse_v;
    for (int i = s.box.i0; i <= s.box.i1; ++i) {
      const float du = (origin.x + step * (float)i - s.u) * s.inverse_u;
      const float q = 1.0f - (du * du + dv * dv);
      if (q >= 0.0f) atomic_max(depth + j * nodes.x + i, as_uint(s.t + s.bulge * sqrt(q)));
    }
  }
}
