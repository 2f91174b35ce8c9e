// outlines.cl: what particles and triangles may cover of the screen (paper 2.1), for those who list them by
// bin and for those who draw them one by one.

// WIDTH particles.
typedef struct {
  floatv t, u, v, ru, rv, bulge;  // half axes and bulge of their spheres
} Spheres;

// From [6][stride] t, u, v, ku, kv, scale; sphere: footprint, bulge over footprint.
inline Spheres spheres_of(global const float* here, const int stride, const float2 sphere) {
  const Spheres s = {LOADF(here),
                     LOADF(here + stride),
                     LOADF(here + 2 * stride),
                     sphere.x * LOADF(here + 3 * stride),
                     sphere.x * LOADF(here + 4 * stride),
                     sphere.x * sphere.y * LOADF(here + 5 * stride)};
  return s;
}

// What spheres may cover: the first and last sample along i and along j; the key, in no bin whose bound
// is less: FRONT: the nearest depth; BEHIND: the least negative depth; EVERY: none is left out.
typedef struct {
  intv i0, i1, j0, j1;
  floatv key;
  floatv disc[8];  // t, u, v, 1 / half axes, bulge, nearest depth; not used
} Outline;

// On nodes whose first lies at origin.x with 1 / step = origin.y.
inline Outline outline_of(const Spheres s, const int2 nodes, const float2 origin, const int drawn) {
  const floatv nearest = larger(smaller(s.t - s.bulge, s.t), (floatv)(1e-6f));
  floatv key = (floatv)(-INFINITY);
  if (drawn == FRONT) key = nearest;
  if (drawn == BEHIND) key = -larger(larger(s.t - s.bulge, s.t), (floatv)(1e-6f));
  const Outline o = {first_within((s.u - s.ru - origin.x) * origin.y),
                     last_within((s.u + s.ru - origin.x) * origin.y, nodes.x),
                     first_within((s.v - s.rv - origin.x) * origin.y),
                     last_within((s.v + s.rv - origin.x) * origin.y, nodes.y),
                     key,
                     {s.t, s.u, s.v, 1.0f / s.ru, 1.0f / s.rv, s.bulge, nearest, (floatv)(0.0f)}};
  return o;
}

// The same of a triangle, which is left out of no bin.
typedef struct {
  int i0, i1, j0, j1;
  float16 record;  // u, v; v and u of the sides from there to the others; 1 / doubled area; t
} TriangleOutline;

inline TriangleOutline outline_of_triangle(global const float* corners,  // [9][stride] u, v, t of three
                                           const int k, const int stride, const Lattice samples,
                                           const int perspective) {  // interpolate 1/t instead of t
  float u[3], v[3], t[3];
#pragma unroll
  for (int c = 0; c < 3; ++c) {
    u[c] = corners[(3 * c) * stride + k];
    v[c] = corners[(3 * c + 1) * stride + k];
    t[c] = corners[(3 * c + 2) * stride + k];
    if (perspective) t[c] = 1.0f / t[c];
  }
  const float u1 = u[1] - u[0], v1 = v[1] - v[0], u2 = u[2] - u[0], v2 = v[2] - v[0];
  const float doubled = u1 * v2 - u2 * v1;
  const float low_u = fmin(u[0], fmin(u[1], u[2])), high_u = fmax(u[0], fmax(u[1], u[2]));
  const float low_v = fmin(v[0], fmin(v[1], v[2])), high_v = fmax(v[0], fmax(v[1], v[2]));
  TriangleOutline o;
  o.i0 = (int)ceil(clamp((low_u - samples.first) / samples.step, 0.0f, 1e6f));
  o.i1 = fabs(doubled) < 1e-9f
             ? -1
             : min(samples.nx - 1,
                   (int)floor(clamp((high_u - samples.first) / samples.step, -1.0f, 1e6f)));
  o.j0 = (int)ceil(clamp((low_v - samples.first) / samples.step, 0.0f, 1e6f));
  o.j1 = min(samples.ny - 1,
             (int)floor(clamp((high_v - samples.first) / samples.step, -1.0f, 1e6f)));
  o.record = (float16)(u[0], v[0], u1, v1, u2, v2, 1.0f / doubled, t[0], t[1], t[2], 0.0f, 0.0f, 0.0f,
                       0.0f, 0.0f, 0.0f);
  return o;
}
