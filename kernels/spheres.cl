// spheres.cl: the particles' spheres, cast exactly: where the ray of each sample first meets one.
// (visible.cl draws each sphere as a shifted ellipse, which moves fronts by up to the radius times
// 1 - cos(angle from the camera's axis); what a filter smooths, and what `spheres` shows, should
// not carry that.) Depths are positive floats, whose bits order like integers: atomic_min gives the
// same map whatever the order of the particles. Where two are equally near, the lower index wins.

// A sphere: eye centre (x, y, -t) and radius, particle radii, and the samples it may cover, both
// ends included. particles: [8][stride] x, y, t, radius; pixels u, v and half extents on the
// screen.
typedef struct {
  float x, y, t, radius;
  int i0, i1, j0, j1;
} Sphere;

inline Sphere load_sphere(global const float* particles, const int p, const int stride,
                          const int2 samples, const float2 grid) {
  Sphere s;
  s.x = particles[p];
  s.y = particles[stride + p];
  s.t = particles[2 * stride + p];
  s.radius = particles[3 * stride + p];
  const float u = particles[4 * stride + p], v = particles[5 * stride + p];
  const float hu = particles[6 * stride + p], hv = particles[7 * stride + p];
  s.i0 = max(0, (int)ceil(clamp((u - hu - grid.x) / grid.y, -1.0f, 1e6f)));
  s.i1 = min(samples.x - 1, (int)floor(clamp((u + hu - grid.x) / grid.y, -1.0f, 1e6f)));
  s.j0 = max(0, (int)ceil(clamp((v - hv - grid.x) / grid.y, -1.0f, 1e6f)));
  s.j1 = min(samples.y - 1, (int)floor(clamp((v + hv - grid.x) / grid.y, -1.0f, 1e6f)));
  return s;
}

// Depth at which a ray enters the sphere, or -1: with t' = t - centre's depth, X - c = q + t' D,
// D = (dx, dy, -1), and q the ray's offset from the centre at the centre's depth.
inline float entry(const Sphere s, const Ray r) {
  const float qx = r.ox + s.t * r.dx - s.x, qy = r.oy + s.t * r.dy - s.y;
  const float a = r.dx * r.dx + r.dy * r.dy + 1.0f;
  const float b = qx * r.dx + qy * r.dy;
  const float c = qx * qx + qy * qy - s.radius * s.radius;
  const float discriminant = b * b - a * c;
  return discriminant < 0.0f ? -1.0f : fmax(s.t - (b + sqrt(discriminant)) / a, 1e-6f);
}

// The nearest entry at every sample. One work-item per particle.
kernel void cast_spheres(global const float* particles,  // [8][stride]
                         global uint* depth,             // [ny*nx] bits of the depth; +inf before
                         const int n, const int stride, const int2 samples,
                         const float2 grid,  // first sample and step, pixels
                         const float16 rays) {
  const int p = get_global_id(0);
  if (p >= n) return;
  const Sphere s = load_sphere(particles, p, stride, samples, grid);
  for (int j = s.j0; j <= s.j1; ++j)
    for (int i = s.i0; i <= s.i1; ++i) {
      const float t =
          entry(s, ray_at(rays, grid.x + grid.y * (float)i, grid.x + grid.y * (float)j));
      if (t > 0.0f) atomic_min(depth + j * samples.x + i, as_uint(t));
    }
}

// The lowest index among the spheres that are met at the map's depth.
kernel void find_sphere(global const float* particles, global const uint* depth,
                        global int* owner,  // [ny*nx] INT_MAX before
                        const int n, const int stride, const int2 samples, const float2 grid,
                        const float16 rays) {
  const int p = get_global_id(0);
  if (p >= n) return;
  const Sphere s = load_sphere(particles, p, stride, samples, grid);
  for (int j = s.j0; j <= s.j1; ++j)
    for (int i = s.i0; i <= s.i1; ++i) {
      const float t =
          entry(s, ray_at(rays, grid.x + grid.y * (float)i, grid.x + grid.y * (float)j));
      const int here = j * samples.x + i;
      if (t > 0.0f && as_uint(t) == depth[here]) atomic_min(owner + here, p);
    }
}

// (X - c) / radius at every sample that meets a sphere. One work-item per sample.
kernel void sphere_normals(global const float* particles, global const float* depth,
                           global const int* owner,
                           global float* normal,  // [3][ny*nx] unit, eye axes; zero: no surface
                           const int stride, const int2 samples, const float2 grid,
                           const float16 rays) {
  const int i = get_global_id(0), j = get_global_id(1);
  if (i >= samples.x || j >= samples.y) return;  // the range is rounded up to whole work-groups
  const int here = j * samples.x + i, size = samples.x * samples.y;
  const float t = depth[here];
  float x = 0.0f, y = 0.0f, z = 0.0f;
  if (t < INFINITY) {
    const int p = owner[here];
    const Ray r = ray_at(rays, grid.x + grid.y * (float)i, grid.x + grid.y * (float)j);
    x = r.ox + t * r.dx - particles[p];
    y = r.oy + t * r.dy - particles[stride + p];
    z = particles[2 * stride + p] - t;
    const float length = sqrt(x * x + y * y + z * z);
    x /= length;
    y /= length;
    z /= length;
  }
  normal[here] = x;
  normal[size + here] = y;
  normal[2 * size + here] = z;
}
