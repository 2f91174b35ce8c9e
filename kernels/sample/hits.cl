// hits.cl: where a ray meets a fit, and with what weight (paper 2.4.2, Eq. 6).
//
// A fit's record: records.h.

// What of a weight's own gradient goes into the normal (blend_at) where fits are flat, and where they are
// as round as can be (ROUNDEST). Bends lose height in the blend, and with it slope; less than nothing
// gives them back. What noise that brings along, fairing.cl takes away.
#define PULL 0.75f
#define ROUND_PULL -0.2f

// That part of the weight's gradient, but for near^2 and the place.
inline float pull_of(global const float* fit) {
  return 6.0f * fit[FIT_NARROWNESS] * (fit[FIT_ROUND] * ((PULL - ROUND_PULL) / ROUNDEST) - PULL);
}

// By so much more than the product of gradients a fit that is met agrees with a sheet: a round fit has
// no crease near, and goes on around the bend.
inline float leeway_of(global const float* fit) { return fit[FIT_ROUND]; }

// The sum of firm fits' weights at a sample, 3.5 within a flat face (the integral of (1 - D^2)^3 over
// 4 square radii a fit): up to the first the blend is not trusted, from the second on it is.
#define ALONE 0.002f
#define COMPANY 0.015f

// From the first such sum on, fits of one sheet that follow their particles badly are trusted the more for
// being among many firm ones, from the second on fully: beside a gap between particles the density field,
// which would decide there, has a pit.
#define SOME_FIRM 0.8f
#define MANY_FIRM 1.4f

// A ray that passes by a fit's fluid, but less than GRAZE above it, meets it where it comes nearest:
// weights fade (fade_hit) instead of breaking off where a sheet turns away from the eye. From OVER on,
// in the mean of the fits that it meets, it has passed by the surface, if they are trusted by more than
// SURELY_OVER; and so it has in the mean of all round fits near the point (Turning), whose bend along the
// ray counts as LEAST_BEND at least.
#define GRAZE 0.3f  // particle radii
#define OVER 0.06f
#define SURELY_OVER 0.8f
#define LEAST_BEND 0.02f  // of f over the square of the depth, one over particle radii

typedef struct {
  floatv sx, sy, t;  // point of the ray at the reference depth: eye (sx, sy, -t)
  floatv dx, dy;     // direction (dx, dy, -1)
} Sample;

inline Sample sample_at(const Rays r, const floatv t) {
  const Sample s = {r.ox + t * r.dx, r.oy + t * r.dy, t, r.dx, r.dy};
  return s;
}

typedef struct {
  floatv tau;         // depth behind the reference depth, particle radii
  floatv weight;      // of the fit there; 0: no hit
  floatv gx, gy, gz;  // unit gradient there
  floatv pull;        // how fast the weight changes across the ray, see add_hit
} Hit;

typedef struct {
  global const float* record;  // [fits][FIT]
  global const float* foot;    // [fits][4] eye space; reach
} Fits;

// The gradient of a fit's quadric at X from its foot. (A sum of fused products that is zero has
// whatever sign the device gives it.)
inline void gradient_at(global const float* g, const floatv x, const floatv y, const floatv z,
                        floatv* gx, floatv* gy, floatv* gz) {
  *gx = fma((floatv)(g[4]), x + x, fma((floatv)(g[7]), y, fma((floatv)(g[9]), z, (floatv)(g[1]))));
  *gy = fma((floatv)(g[5]), y + y, fma((floatv)(g[7]), x, fma((floatv)(g[8]), z, (floatv)(g[2]))));
  *gz = fma((floatv)(g[6]), z + z, fma((floatv)(g[8]), y, fma((floatv)(g[9]), x, (floatv)(g[3]))));
}

// Its value there.
inline floatv value_at(global const float* g, const floatv x, const floatv y, const floatv z,
                       const floatv gx, const floatv gy, const floatv gz) {
  const floatv doubled = fma(gx + g[1], x, fma(gy + g[2], y, (gz + g[3]) * z));
  return fma((floatv)(0.5f), doubled, (floatv)(g[0]));
}

// How it bends along a ray: the factor of the square of the depth.
inline floatv bend_along(global const float* g, const Sample s) {
  const floatv x = fma((floatv)(g[4]), s.dx, fma((floatv)(g[7]), s.dy, (floatv)(-g[9]))),
               y = fma((floatv)(g[5]), s.dy, (floatv)(-g[8]));
  return fma(x, s.dx, fma(y, s.dy, (floatv)(g[6])));
}

inline floatv dot_of(const floatv ax, const floatv ay, const floatv az, const floatv bx,
                     const floatv by, const floatv bz) {
  return fma(ax, bx, fma(ay, by, az * bz));
}
inline floatv square_of(const floatv x, const floatv y, const floatv z) {
  return dot_of(x, y, z, x, y, z);
}

// Sums over the values of the fits of one sheet: weight; value, a depth along rays (blend.cl) or a level at
// points (implicit.cl); foot; gradient; and a share of the weight's own gradient (PULL), v, as it is
// and times the value, u. The mean value goes into the mean normal by them.
typedef struct {
  floatv w, value, cx, cy, cz, nx, ny, nz, vx, vy, vz, ux, uy, uz;
} Sums;

inline void clear_sums(Sums* s) {
  const floatv none = (floatv)(0.0f);
  s->w = s->value = s->cx = s->cy = s->cz = s->nx = s->ny = s->nz = none;
  s->vx = s->vy = s->vz = s->ux = s->uy = s->uz = none;
}

// Adds a fit with foot f and unit gradient g, evaluated at p from its foot, where its weight changes by
// `pull` times p.
inline void add_to_sheet(Sums* s, const floatv weight, const floatv value, const float fx,
                         const float fy, const float fz, const floatv gx, const floatv gy,
                         const floatv gz, const floatv pull, const floatv px, const floatv py,
                         const floatv pz) {
  const floatv u = pull * value;
  s->w += weight;
  s->value = fma(weight, value, s->value);
  s->cx = fma(weight, (floatv)(fx), s->cx);
  s->cy = fma(weight, (floatv)(fy), s->cy);
  s->cz = fma(weight, (floatv)(fz), s->cz);
  s->nx = fma(weight, gx, s->nx);
  s->ny = fma(weight, gy, s->ny);
  s->nz = fma(weight, gz, s->nz);
  s->vx = fma(pull, px, s->vx);
  s->vy = fma(pull, py, s->vy);
  s->vz = fma(pull, pz, s->vz);
  s->ux = fma(u, px, s->ux);
  s->uy = fma(u, py, s->uy);
  s->uz = fma(u, pz, s->uz);
}

// Where rays enter a fit's fluid or graze it, and how far from its foot, in reaches: infinite where
// they do neither. And how high above it they pass, within GRAZE; below 0 where they enter.
typedef struct {
  floatv tau, squared, height;
} Entry;

inline int counts(const Entry e) { return ANY(e.squared < 1.0f); }

inline Entry meet_fit(const Fits fits, const int fit, const Sample s, const float d_max) {
  global const float* g = fits.record + FIT * fit;
  global const float* foot = fits.foot + 4 * fit;
  const floatv none = (floatv)(0.0f);
  const floatv x = s.sx - foot[0], y = s.sy - foot[1], z = -s.t - foot[2];
  floatv gx, gy, gz;
  gradient_at(g, x, y, z, &gx, &gy, &gz);
  // f along the ray: C + B tau + A tau^2
  const floatv C = value_at(g, x, y, z, gx, gy, gz);
  const floatv B = fma(gx, s.dx, fma(gy, s.dy, -gz));
  const floatv A = bend_along(g, s);
  const floatv D = fma(B, B, -4.0f * A * C);
  // The entering root in its stable form: f falls there. Without one it is no number.
  const intv falls = B < 0.0f;
  const floatv sum = fabs(B) + sqrt(D);
  const floatv root_tau = SELECT(-sum, 2.0f * C, falls) / SELECT(2.0f * A, sum, falls);
  const floatv least = -0.25f * D / A;  // of f, where it has a least value along the ray
  const intv bent = A > 0.0f, grazed = bent & (least > 0.0f) & (least < GRAZE);
  const floatv at = SELECT(root_tau, -0.5f * B / A, grazed);
  const intv met = fabs(at) <= SELECT((floatv)(4.0f), (floatv)(1.0f), grazed) * d_max;
  const floatv tau = SELECT(none, at, met);
  const floatv px = fma(tau, s.dx, x), py = fma(tau, s.dy, y), pz = z - tau;
  const floatv squared = square_of(px, py, pz) * g[FIT_NARROWNESS];
  const Entry e = {tau, SELECT((floatv)(INFINITY), squared, met),
                   SELECT((floatv)(-GRAZE), larger(least, (floatv)(-GRAZE)), bent)};
  return e;
}

// A hit at an entry. Returns whether it has any weight.
inline int weigh_fit(const Fits fits, const int fit, const Sample s, const float d_max,
                     const Entry e, Hit* hit) {
  global const float* g = fits.record + FIT * fit;
  global const float* foot = fits.foot + 4 * fit;
  const floatv none = (floatv)(0.0f), one = (floatv)(1.0f), tau = e.tau, squared = e.squared;
  const floatv x = s.sx - foot[0], y = s.sy - foot[1], z = -s.t - foot[2];
  const floatv px = fma(tau, s.dx, x), py = fma(tau, s.dy, y), pz = z - tau;
  floatv gx, gy, gz;
  const floatv near = larger(one - squared, none);
  gradient_at(g, px, py, pz, &gx, &gy, &gz);
  const floatv slope = 1.0f / sqrt(larger(square_of(gx, gy, gz), (floatv)(1e-20f)));
  hit->tau = tau;
  // A grazing ray enters far before the reference, which lies inside: there depths count less.
  const floatv facing = fma(gx, s.dx, fma(gy, s.dy, -gz)) * slope;
  const intv met = fabs(tau) * smaller(2.0f * fabs(facing), one) <= d_max;
  const floatv steep = SELECT(none, near * near * g[FIT_WEIGHT], met);
  hit->weight = steep * near;
  hit->gx = gx * slope;
  hit->gy = gy * slope;
  hit->gz = gz * slope;
  hit->pull = pull_of(g) * steep * facing;
  return ANY(hit->weight > 0.0f);
}

inline void fade_hit(const Entry e, Hit* hit) {
  const floatv rest = 1.0f - larger(e.height, (floatv)(0.0f)) * (1.0f / GRAZE);
  hit->weight *= rest * rest;
  hit->pull *= rest * rest;
}

// Returns whether any ray enters a fit's fluid, or grazes it, within its reach.
inline int hit_fit(const Fits fits, const int fit, const Sample s, const float d_max, Hit* hit) {
  const Entry e = meet_fit(fits, fit, s, d_max);
  if (!counts(e) || !weigh_fit(fits, fit, s, d_max, e, hit)) return 0;
  fade_hit(e, hit);
  return 1;
}
