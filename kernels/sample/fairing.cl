// fairing.cl: evens out normals along a sheet (docs/method.md, fairing). The paper takes the blend's
// gradient as it is.
//
// A normal becomes the value of a parabola that is fitted to the normals beside it, first along rows,
// then along columns. A neighbour at distance l and at height h along the mean of both normals counts
// (1 - l^2 / (2.65 sigma)^2)^2 (1 - h^2 / 1.2^2)^2 smoothstep(.7, .9, n.n'), nothing beyond either:
// another sheet does not count. A parabola, because a mean flattens waves, and pulls normals at outlines
// towards the side where there is surface.
//
// uses: samples.cl

#define FAIR_REACH 2.65f         // sigmas: the window's variance is about that of a Gaussian
#define FAIR_HEIGHT 1.2f         // particle radii
#define FAIR_APART 1.4f          // sigmas between the neighbours that are looked at, at most
#define FAIR_TAPS 3              // of them on each side: FAIR_REACH / (FAIR_APART / 2), less the last
#define FAIR_COARSEST 10         // 2^10 samples from one of them to the next, at most
#define FAIR_SLOPE_RIDGE 0.2f    // sigma^2: neighbours on one side alone hardly give a slope
#define FAIR_CURVE_RIDGE 0.6f    // sigma^4: without it no noise goes; infinite, waves are flattened

// A sample, and how its ray's point moves from a sample to the next along the line.
typedef struct {
  floatv t, nx, ny, nz;  // depth, particle radii; unit normal
  Rays ray;
  float dx, dy;          // of the ray's direction
  floatv ax, ay;         // of its point at depth t
  int step;              // samples from one neighbour that is looked at to the next
} Faired;

// Sums over the neighbours of weights times powers of their place k (in steps), and of weights times
// the difference of their normals from the own one times powers of k.
typedef struct {
  floatv w, k, k2, k3, k4;
  floatv x, y, z, kx, ky, kz, k2x, k2y, k2z;
} Line;

// A neighbour: its weight, 0 where there is none, and how its normal differs from the own one.
typedef struct {
  floatv w, x, y, z;
} Beside;

// The neighbour k steps away, which is sample `at`, where wanted; those nearer than
// 1 / sqrt(within) count. (Oclgrind takes no structure that is returned here.)
INLINED void find_neighbour(Beside* found, const Faired* own, const int k, global const float* depth,
                            global const float* normal, const int n, const int at, const float within,
                            const intv wanted) {
  const floatv none = (floatv)(0.0f), halves = (floatv)(0.5f), one = (floatv)(1.0f);
  Beside b = {none, none, none, none};
  *found = b;
  if (!ANY(wanted)) return;
  const floatv t = load_from(depth, at);
  const intv there = wanted & (t < INFINITY);
  if (!ANY(there)) return;
  b.x = SELECT(none, load_from(normal, at) - own->nx, there);
  b.y = SELECT(none, load_from(normal, n + at) - own->ny, there);
  b.z = SELECT(none, load_from(normal, 2 * n + at) - own->nz, there);
  const float away = (float)(k * own->step);
  const floatv deeper = SELECT(none, t - own->t, there);
  const floatv px = fma(deeper, own->ray.dx + own->dx * away, own->ax * away);
  const floatv py = fma(deeper, own->ray.dy + own->dy * away, own->ay * away);
  const floatv h = fma(px, fma(b.x, halves, own->nx),
                       fma(py, fma(b.y, halves, own->ny), -deeper * fma(b.z, halves, own->nz)));
  const floatv l = fma(px, px, fma(py, py, deeper * deeper));
  const floatv near = larger(fma(l, (floatv)(-within), one), none);
  const floatv beside =
      larger(fma(h * h, (floatv)(-1.0f / (FAIR_HEIGHT * FAIR_HEIGHT)), one), none);
  const floatv turned = fma(b.x, b.x, fma(b.y, b.y, b.z * b.z));  // 2 - 2 n.n'
  const floatv same = smooth_step(0.7f, 0.9f, fma(turned, -halves, one));
  const floatv both = near * beside;
  b.w = SELECT(none, both * both * same, there);
  *found = b;
}

// Adds the neighbours k steps before and behind: even powers have their sum, odd ones their difference.
INLINED void add_pair(Line* line, const int k, const Beside before, const Beside behind) {
  const float k1 = (float)k, k2 = k1 * k1;
  const floatv w = behind.w + before.w, odd = behind.w - before.w;
  line->w += w;
  line->k = fma(odd, (floatv)(k1), line->k);
  line->k2 = fma(w, (floatv)(k2), line->k2);
  line->k3 = fma(odd, (floatv)(k2 * k1), line->k3);
  line->k4 = fma(w, (floatv)(k2 * k2), line->k4);
  const floatv x = before.w * before.x, y = before.w * before.y, z = before.w * before.z;
  const floatv ex = fma(behind.w, behind.x, x), ey = fma(behind.w, behind.y, y),
               ez = fma(behind.w, behind.z, z);
  line->x += ex;
  line->y += ey;
  line->z += ez;
  line->kx = fma(fma(behind.w, behind.x, -x), (floatv)(k1), line->kx);
  line->ky = fma(fma(behind.w, behind.y, -y), (floatv)(k1), line->ky);
  line->kz = fma(fma(behind.w, behind.z, -z), (floatv)(k1), line->kz);
  line->k2x = fma(ex, (floatv)(k2), line->k2x);
  line->k2y = fma(ey, (floatv)(k2), line->k2y);
  line->k2z = fma(ez, (floatv)(k2), line->k2z);
}

// The parabola's value at the sample itself, by least squares, as a unit normal; the own one where it is
// short. `apart2` is the square of the distance between samples, sigmas^2.
INLINED void smooth_normal(const Line* line, const Faired* own, const intv step, const floatv apart2,
                           floatv* x, floatv* y, floatv* z) {
  // Powers of k in sigmas: the ridges are in them. All values are times the determinant.
  const floatv steps1 = TO_FLOATV(step), scale2 = steps1 * steps1 * apart2, scale4 = scale2 * scale2;
  const floatv k2 = fma(line->k2, scale2, FAIR_SLOPE_RIDGE * line->w);
  const floatv k4 = fma(line->k4, scale4, FAIR_CURVE_RIDGE * line->w);
  const floatv a = k2 * k4 - scale2 * scale4 * (line->k3 * line->k3),
               b = scale2 * (scale4 * (line->k2 * line->k3) - line->k * k4),
               c = scale4 * (scale2 * (line->k * line->k3) - line->k2 * k2);
  const floatv determinant = line->w * a + line->k * b + line->k2 * c;
  const floatv sum_x = fma(determinant, own->nx, a * line->x + b * line->kx + c * line->k2x);
  const floatv sum_y = fma(determinant, own->ny, a * line->y + b * line->ky + c * line->k2y);
  const floatv sum_z = fma(determinant, own->nz, a * line->z + b * line->kz + c * line->k2z);
  const floatv size = sqrt(sum_x * sum_x + sum_y * sum_y + sum_z * sum_z), unit = 1.0f / size;
  const intv clear = size > 0.5f * determinant;
  *x = SELECT(own->nx, sum_x * unit, clear);
  *y = SELECT(own->ny, sum_y * unit, clear);
  *z = SELECT(own->nz, sum_z * unit, clear);
}

// The normals of WIDTH samples from column i of row j on. Inlined: calls would copy the screen.
INLINED void fair_from(const int i, const int j, global const float* depth, global const float* normal,
                       global float* faired, const Screen screen, const float sigma, const int down) {
  const int n = screen.nx * screen.ny, s = j * screen.nx + i;
  const intv column = i + TO_INTV(LANES);
  const floatv none = (floatv)(0.0f), depths = LOADF(depth + s);
  const intv open = (column < screen.nx) & (depths < INFINITY);
  if (!ANY(open)) return;
  const RayMap map = screen.rays;
  Faired own;
  own.t = SELECT(none, depths, open);
  own.nx = SELECT(none, LOADF(normal + s), open);
  own.ny = SELECT(none, LOADF(normal + n + s), open);
  own.nz = SELECT((floatv)(1.0f), LOADF(normal + 2 * n + s), open);
  own.ray = rays_at(map, screen.first + screen.step * ((float)i + LANES),
                    (floatv)(screen.first + screen.step * (float)j));
  own.dx = screen.step * (down ? map.dx_v : map.dx_u);
  own.dy = screen.step * (down ? map.dy_v : map.dy_u);
  own.ax = screen.step * (down ? map.ox_v : map.ox_u) + own.t * own.dx;
  own.ay = screen.step * (down ? map.oy_v : map.oy_u) + own.t * own.dy;

  // Steps are powers of two: the longest of at most FAIR_APART sigmas, by its square.
  const float per_sigma = 1.0f / sigma;
  const floatv apart2 = smaller((own.ax * own.ax + own.ay * own.ay) * (per_sigma * per_sigma),
                                (floatv)(100.0f));  // sigmas^2; more than any neighbour may have
  const intv exponent = 127 - (AS_INTV(apart2 * (1.0f / (FAIR_APART * FAIR_APART))) >> 23);
  const intv step = (intv)(1) << min(max((exponent - 1) >> 1, (intv)(0)), (intv)(FAIR_COARSEST));
  int steps[WIDTH];
  STOREI(step, steps);
  const float within = 1.0f / (FAIR_REACH * sigma * (FAIR_REACH * sigma));
  Line line = {(floatv)(1.0f), none, none, none, none, none, none,
               none,           none, none, none, none, none, none};
  intv left = open;
  for (int lane = 0; lane < WIDTH; ++lane) {  // mostly all lanes have the same step
    own.step = steps[lane];
    const intv in_step = left & (step == own.step);
    if (!ANY(in_step)) continue;
    left = left & (step != own.step);
    for (int k = 1; k <= FAIR_TAPS; ++k) {
      const int off = k * own.step, shift = down ? off * screen.nx : off;
      const intv reached =
          in_step & ((float)off * (float)off * apart2 < FAIR_REACH * FAIR_REACH);
      if (!ANY(reached)) break;
      // Of columns all lanes have a neighbour, or none.
      const intv before = reached & (down ? (intv)(j < off ? 0 : -1) : column >= off);
      const intv behind = reached & (down ? (intv)(j + off < screen.ny ? -1 : 0) : column < screen.nx - off);
      Beside first, second;
      find_neighbour(&first, &own, -k, depth, normal, n, s - shift, within, before);
      find_neighbour(&second, &own, k, depth, normal, n, s + shift, within, behind);
      add_pair(&line, k, first, second);
    }
    if (!ANY(left)) break;
  }
  floatv x, y, z;
  smooth_normal(&line, &own, step, apart2, &x, &y, &z);
  if (down) face_eye(own.ray.dx, own.ray.dy, &x, &y, &z);
  if (ALL(open)) {
    STOREF(x, faired + s);
    STOREF(y, faired + n + s);
    STOREF(z, faired + 2 * n + s);
    return;
  }
  int at[WIDTH];
  STOREI(s + TO_INTV(LANES), at);
  scatter_float(x, faired, at, open);
  scatter_float(y, faired + n, at, open);
  scatter_float(z, faired + 2 * n, at, open);
}

// The items of a row share its samples. A CPU has one for each row: a group of many computes them for all
// its items at once, step by step, and stores what the next step needs.
kernel void fair_normals(global const float* depth,   // [ny*nx]
                         global const float* normal,  // [3][ny*nx] unit, where there is a depth
                         global float* faired,        // [3][ny*nx] out, where there is a depth
                         const Screen screen, const float sigma,  // particle radii
                         const int down) {                        // 0: along rows; 1: along columns
  const int j = get_global_id(1), items = get_global_size(0);
  if (j >= screen.ny) return;
  for (int i = get_global_id(0) * WIDTH; i < screen.nx; i += items * WIDTH)
    fair_from(i, j, depth, normal, faired, screen, sigma, down);
}
