// spheres.cl: the particles' spheres, cast exactly: where the ray of each sample first meets one.
// (visible.cl draws each sphere as a shifted ellipse, which moves fronts by up to the radius times
// 1 - cos(angle from the camera's axis); what a filter smooths, and what `spheres` shows, should
// not carry that.) Where two spheres are equally near, the lower index wins.

// A ray (o + t d, -t) enters the sphere of radius R around (x, y, -t_c) at
//   t = t_c - (b + sqrt(b^2 - a c)) / a,  a = D.D, b = q.d, c = q.q - R^2, D = (dx, dy, -1),
// q = o + t_c d - (x, y): its offset from the centre at the centre's depth.

// What the spheres may cover and what they hide (bins.cl). One work-item per WIDTH particles of
// `stride`.
//
// Rounding: with e = 2^-24, O and D the largest sums of the terms of |ox| + |oy| and |dx| + |dy|
// on the screen, and A = 1 + D^2, a ray's q is off by at most
//   off = 6 e (O + (t + R) D + |x| + |y| + 4 R).
// Where a ray meets the sphere, |q| <= R sqrt(A), hence b is off by at most 2 sqrt(A) off, the
// discriminant by E = 7 R A^2 off, and the depth by slack = 3 A off + sqrt(E).
// The rays that enter a sphere at a depth of at most T are those through a convex body, the part of
// the ball up to T: over a rectangle of the screen the entry is deepest at a corner. Where the
// corners' discriminants exceed 3 E, every ray of the rectangle hits, in floats as well.
kernel void outline_spheres(global const float* particles,  // [8][stride] eye x, y, depth, radius,
                                                            // particle radii; pixels u, v and half
                                                            // extents on the screen
                            global float* sphere,           // [stride][8] x, y, t, R^2, nearest
                            OUTLINES(, box, key), COVERS(, cover, deepest), const int stride,
                            const Screen screen,
                            const float2 largest,  // O, particle radii; D
                            const int shift) {     // a cell's side is 1 << shift samples
  const int p = get_global_id(0) * WIDTH;
  if (p >= stride) return;  // the range is rounded up to whole work-groups
  global const float* here = particles + p;
  const floatv x = LOADF(here), y = LOADF(here + stride), t = LOADF(here + 2 * stride);
  const floatv radius = LOADF(here + 3 * stride);
  const floatv u = LOADF(here + 4 * stride) - screen.first, v = LOADF(here + 5 * stride) - screen.first;
  const floatv hu = LOADF(here + 6 * stride), hv = LOADF(here + 7 * stride);
  const float inverse = 1.0f / screen.step;
  STOREI(first_within((u - hu) * inverse), box + p);
  STOREI(last_within((u + hu) * inverse, screen.nx), box + stride + p);
  STOREI(first_within((v - hv) * inverse), box + 2 * stride + p);
  STOREI(last_within((v + hv) * inverse, screen.ny), box + 3 * stride + p);

  const float steepest = 1.0f + largest.y * largest.y;
  const floatv off =
      3.6e-7f * (largest.x + (t + radius) * largest.y + fabs(x) + fabs(y) + 4.0f * radius);
  const floatv doubt = 7.0f * radius * steepest * steepest * off;
  const floatv slack = 3.0f * steepest * off + sqrt(doubt);
  const floatv nearest = t - radius - slack;
  STOREF(fmax(nearest, (floatv)(1e-6f)), key + p);
  const floatv none = (floatv)(0.0f);
  const floatv record[8] = {x, y, t, radius * radius, nearest, none, none, none};
  store_records(record, sphere + 8 * p);

  const intv i0 = first_cell((u - 0.69f * hu) * inverse, shift);
  const intv i1 = last_cell((u + 0.69f * hu) * inverse, screen.nx, shift);
  const intv j0 = first_cell((v - 0.69f * hv) * inverse, shift);
  const intv j1 = last_cell((v + 0.69f * hv) * inverse, screen.ny, shift);
  intv covers = nearest > 0.0f;
  floatv corner = (floatv)(0.0f);
  for (int k = 0; k < 4; ++k) {
    const intv i = k & 1 ? last_of(i1, screen.nx, shift) : first_of(i0, shift);
    const intv j = k & 2 ? last_of(j1, screen.ny, shift) : first_of(j0, shift);
    const Rays r = rays_at(screen.rays, screen.first + screen.step * TO_FLOATV(i),
                           screen.first + screen.step * TO_FLOATV(j));
    const floatv qx = r.ox + t * r.dx - x, qy = r.oy + t * r.dy - y;
    const floatv b = qx * r.dx + qy * r.dy;
    const floatv discriminant = b * b - r.a * (qx * qx + qy * qy - radius * radius);
    covers = covers & (discriminant > 3.0f * doubt);
    corner = fmax(corner, t - (b + sqrt(fmax(discriminant, (floatv)(0.0f)))) / r.a);
  }
  STOREI(i0, cover + p);
  STOREI(SELECT(i0 - 1, i1, covers), cover + stride + p);
  STOREI(j0, cover + 2 * stride + p);
  STOREI(j1, cover + 3 * stride + p);
  STOREF(fmax(corner + 2.0f * slack, (floatv)(1e-6f)), deepest + p);
}

// Records that are loaded at once: they lie far apart, and a CPU waits for each that it needs at once
// (at 160,000 particles half of the kernel's time). A GPU has other work-items for that.
#if WIDTH == 1
#define AHEAD 1
#else
#define AHEAD 8
#endif

// Draws the spheres of a bin into a private map, with `owned` its owners as well.
inline void draw_spheres(const Part part, global const float* sphere, global const int2* entry,
                         Rays* rays, floatv* map, intv* owner, const Screen screen,
                         const int owned) {
  const intv column = TO_INTV(LANES) + part.column;
  const floatv u = screen.first + screen.step * TO_FLOATV(part.i - part.column + column);
  for (int row = 0; row < ROWS; ++row) {
    rays[row] = rays_at(screen.rays, u, (floatv)(screen.first + screen.step * (float)(part.j + row)));
    map[row] = (floatv)(INFINITY);
    if (owned) owner[row] = (intv)(INT_MAX);
  }
  float deepest = INFINITY;
  float8 ahead[AHEAD];
  for (int e = part.begin; e < part.end; ++e) {
    const int p = entry[e].x, packed = entry[e].y, place = (e - part.begin) % AHEAD;
    if (place == 0)
#pragma unroll
      for (int k = 0; k < AHEAD; ++k) ahead[k] = vload8(entry[min(e + k, part.end - 1)].x, sphere);
    const int j0 = max(packed >> 8 & 15, part.row),
              j1 = min(packed >> 12 & 15, part.row + ROWS - 1);
    const float8 s = ahead[place];
    // Long lists are mostly of what lies behind the rest.
    if ((e - part.begin) % 8 == 7) deepest = deepest_of(map);
    if (fmax(s.s4, 1e-6f) > deepest) continue;
    const intv inside = (column >= (packed & 15)) & (column <= (packed >> 4 & 15));
    for (int j = j0; j <= j1; ++j) {
      const int row = j - part.row;
      const Rays r = rays[row];
      const floatv qx = r.ox + s.s2 * r.dx - s.s0, qy = r.oy + s.s2 * r.dy - s.s1;
      const floatv b = qx * r.dx + qy * r.dy;
      const floatv c = qx * qx + qy * qy - s.s3;
      const floatv discriminant = b * b - r.a * c;
      if (!ANY(discriminant >= 0.0f)) continue;
      // NaN beside the sphere, where no comparison holds.
      floatv depth = s.s2 - (b + sqrt(discriminant)) / r.a;
      depth = SELECT(depth, (floatv)(1e-6f), depth < 1e-6f);
      intv better = depth < map[row];
      if (owned) better = better | ((depth == map[row]) & (p < owner[row]));
      better = better & inside;
      map[row] = SELECT(map[row], depth, better);
      if (owned) owner[row] = SELECT(owner[row], (intv)(p), better);
    }
  }
}

// The nearest entry at every sample of the listed bins; INFINITY where there is none.
// The range of this kernel and the next: BIN * BIN / (WIDTH * ROWS) work-items a bin.
kernel void cast_spheres(global const float* sphere,  // [stride][8] see outline_spheres
                         ENTRIES(end, entry),
                         global float* depth,  // [ny*nx] particle radii
                         const ListedBins bins, const Screen screen) {
  const Part part = part_of(end, bins);
  if (part.bin >= bins.end) return;  // the range is rounded up to whole work-groups
  Rays rays[ROWS];
  floatv map[ROWS];
  draw_spheres(part, sphere, entry, rays, map, 0, screen, 0);
  store_rows(part, map, depth, screen.nx, screen.ny);
}

// (X - c) / radius at every sample that meets a sphere.
kernel void sphere_normals(global const float* sphere, ENTRIES(end, entry),
                           global float* normal,  // [3][ny*nx] unit, eye axes; zero: no surface
                           const ListedBins bins, const Screen screen) {
  const Part part = part_of(end, bins);
  if (part.bin >= bins.end) return;
  Rays rays[ROWS];
  floatv map[ROWS];
  intv owner[ROWS];
  draw_spheres(part, sphere, entry, rays, map, owner, screen, 1);
  floatv nx[ROWS], ny[ROWS], nz[ROWS];
  for (int row = 0; row < ROWS; ++row) {
    int own[WIDTH];
    float cx[WIDTH], cy[WIDTH], ct[WIDTH];
    STOREI(owner[row], own);
    for (int lane = 0; lane < WIDTH; ++lane) {
      const int p = own[lane] == INT_MAX ? 0 : own[lane];
      cx[lane] = sphere[8 * p];
      cy[lane] = sphere[8 * p + 1];
      ct[lane] = sphere[8 * p + 2];
    }
    const intv none = owner[row] == INT_MAX;
    const floatv t = SELECT(map[row], (floatv)(1.0f), none);
    const floatv x = rays[row].ox + t * rays[row].dx - LOADF(cx);
    const floatv y = rays[row].oy + t * rays[row].dy - LOADF(cy);
    const floatv z = LOADF(ct) - t;
    const floatv length = sqrt(x * x + y * y + z * z);
    nx[row] = SELECT(x / length, (floatv)(0.0f), none);
    ny[row] = SELECT(y / length, (floatv)(0.0f), none);
    nz[row] = SELECT(z / length, (floatv)(0.0f), none);
  }
  const int size = screen.nx * screen.ny;
  store_rows(part, nx, normal, screen.nx, screen.ny);
  store_rows(part, ny, normal + size, screen.nx, screen.ny);
  store_rows(part, nz, normal + 2 * size, screen.nx, screen.ny);
}
