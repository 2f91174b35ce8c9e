// creases.cl: the sheets of what a ray meets, which are averaged, and the creases in which they meet (paper
// 2.4.2, Eqs. 6 and 7). Functions only, for blend.cl and hidden.cl.
//
// uses: hits.cl

inline void add_hit(Sums* sum, global const float* foot, const Sample s, const Hit hit,
                    const floatv share) {
  const floatv pull = share * hit.pull;
  const floatv px = fma(hit.tau, s.dx, s.sx - foot[0]), py = fma(hit.tau, s.dy, s.sy - foot[1]),
               pz = -s.t - foot[2] - hit.tau;
  add_to_sheet(sum, share * hit.weight, hit.tau, foot[0], foot[1], foot[2], hit.gx, hit.gy, hit.gz, pull,
               px, py, pz);
}

// A sheet's gradient, or a sum of gradients.
typedef struct {
  floatv x, y, z;
} Axis;

inline void add_gradient(Axis* sum, const Hit* hit, const floatv weight) {
  sum->x = fma(weight, hit->gx, sum->x);
  sum->y = fma(weight, hit->gy, sum->y);
  sum->z = fma(weight, hit->gz, sum->z);
}

inline void take_gradient(Axis* axis, const Hit* hit, const intv where) {
  axis->x = SELECT(axis->x, hit->gx, where);
  axis->y = SELECT(axis->y, hit->gy, where);
  axis->z = SELECT(axis->z, hit->gz, where);
}

// How far a hit's gradient agrees with a sheet's.
inline floatv alike(const Fits fits, const int fit, const Hit* hit, const Axis* axis) {
  return leeway_of(fits.record + FIT * fit) +
         dot_of(hit->gx, hit->gy, hit->gz, axis->x, axis->y, axis->z);
}

// What of a hit belongs to a sheet, by its gradient.
inline floatv of_sheet(const Fits fits, const int fit, const Hit* hit, const Axis* axis,
                       const Blending by) {
  return smooth_step(by.same_low, by.same_high, alike(fits, fit, hit, axis));
}

// How far a sheet of so much of the weights counts.
inline floatv counts_by(const floatv share) { return smooth_step(0.003f, 0.02f, share); }

// A sheet: its depth behind the reference, the middle of its feet, and the direction of its gradients.
typedef struct {
  floatv z, cx, cy, cz, nx, ny, nz;
} Sheet;

inline Sheet sheet_of(const Sums* s) {
  const floatv tiny = (floatv)(1e-30f), v = 1.0f / larger(s->w, tiny);
  const floatv size = 1.0f / sqrt(larger(square_of(s->nx, s->ny, s->nz), tiny));
  const Sheet sheet = {s->value * v,  s->cx * v,     s->cy * v,    s->cz * v,
                       s->nx * size, s->ny * size, s->nz * size};
  return sheet;
}

// Sheet a where `first` is set, else b.
inline Sheet either_sheet(const Sheet* a, const Sheet* b, const intv first) {
  const Sheet sheet = {SELECT(b->z, a->z, first),   SELECT(b->cx, a->cx, first),
                       SELECT(b->cy, a->cy, first), SELECT(b->cz, a->cz, first),
                       SELECT(b->nx, a->nx, first), SELECT(b->ny, a->ny, first),
                       SELECT(b->nz, a->nz, first)};
  return sheet;
}

// Whether two sheets meet in a convex edge: the mean of each one's middle over the other's plane.
inline intv convex_between(const Sheet* a, const Sheet* b) {
  return dot_of(b->cx - a->cx, b->cy - a->cy, b->cz - a->cz, a->nx - b->nx, a->ny - b->ny,
                a->nz - b->nz) < 0.0f;
}

// Whether depths of two sheets are near enough to meet.
inline intv near_each(const floatv a, const floatv b, const float crease) {
  return fabs(a - b) <= crease;
}

// How far a sheet's depth b takes the place of a, if up to `share`: on a convex edge the deeper one
// counts, on a concave edge the nearer.
inline floatv takes_over(const floatv a, const floatv b, const intv convex, const floatv share,
                         const float crease) {
  const floatv meeting = SELECT(fmin(a, b), fmax(a, b), convex);
  return SELECT((floatv)(0.0f), share, (meeting == b) & near_each(a, b, crease));
}

// How much of what a ray meets is of sheets B and C, in the corner of A, B and C. Of three edges two
// are of one kind: the sheets of the other edge meet first, then the third (as in implicit.cl). B and C
// count as far as `some_b` and `some_c` say; B alone where A has no weight.
typedef struct {
  floatv b, c;
} Shares;

inline Shares shares_in_corner(const Sheet* a, const Sheet* b, const Sheet* c, const floatv some_b,
                               const floatv some_c, const intv only_b, const float crease) {
  const floatv one = (floatv)(1.0f);
  const intv ab = convex_between(a, b), ac = convex_between(a, c), bc = convex_between(b, c);
  // A with B, then C
  const floatv b1 = SELECT(takes_over(a->z, b->z, ab, some_b, crease), one, only_b);
  const floatv c1 = takes_over(a->z + (b->z - a->z) * b1, c->z, ac, some_c, crease);
  // A with C, then B
  const floatv c2 = takes_over(a->z, c->z, ac, some_c, crease);
  const floatv b2 = SELECT(takes_over(a->z + (c->z - a->z) * c2, b->z, ab, some_b, crease), one, only_b);
  // B with C, then A
  const floatv c3 = takes_over(b->z, c->z, bc, some_c, crease);
  const floatv b3 = SELECT(takes_over(a->z, b->z + (c->z - b->z) * c3, ab, some_b, crease), one, only_b);
  const intv odd_ac = (ab == bc) & (ab != ac), odd_bc = (ab == ac) & (ab != bc);
  const Shares shares = {SELECT(SELECT(b1 * (one - c1), b2, odd_ac), b3 * (one - c3), odd_bc),
                         SELECT(SELECT(c1, c2 * (one - b2), odd_ac), b3 * c3, odd_bc)};
  return shares;
}

// The direction of a sum, where it has one.
inline void turn_to(const Axis* sum, Axis* axis) {
  const floatv size = square_of(sum->x, sum->y, sum->z);
  const floatv scale = 1.0f / sqrt(larger(size, (floatv)(1e-30f)));
  axis->x = SELECT(axis->x, sum->x * scale, size > 1e-30f);
  axis->y = SELECT(axis->y, sum->y * scale, size > 1e-30f);
  axis->z = SELECT(axis->z, sum->z * scale, size > 1e-30f);
}

// How far what is not of sheet A is of two faces, by how long the mean of its gradients is; as far as
// it is some of what a ray meets.
inline floatv third_of(const Sums* a, const Sums* b) {
  const floatv tiny = (floatv)(1e-30f);
  const floatv length = sqrt(square_of(b->nx, b->ny, b->nz)) / larger(b->w, tiny);
  return (1.0f - smooth_step(0.95f, 0.98f, length)) *
         counts_by(b->w / larger(a->w + b->w, tiny));
}

// Adds a sheet's share to a normal: of the gradient of sum(w f) / sum(w) at the blended point, sum(w
// grad f + f grad w), with f = (depth - t_k) (grad f . d) to first order. The whole second term carries
// the fits' noise into the normal, without it waves look too flat: hits bring the share of it that PULL
// says.
inline void add_normal(const Sums* s, const floatv z, const floatv share, floatv* nx, floatv* ny,
                       floatv* nz) {
  const floatv gx = s->nx + (z * s->vx - s->ux), gy = s->ny + (z * s->vy - s->uy),
               gz = s->nz + (z * s->vz - s->uz);
  const floatv scale = share / sqrt(larger(square_of(gx, gy, gz), (floatv)(1e-30f)));
  *nx = fma(gx, scale, *nx);
  *ny = fma(gy, scale, *ny);
  *nz = fma(gz, scale, *nz);
}

// What a sample shows.
typedef struct {
  floatv depth;       // particle radii; +infinity where no fit is met
  floatv nx, ny, nz;  // unit, eye axes
  floatv trust;       // of the fits met, 0 .. 1, plus ON_EDGE, ENDED or PASSED
  intv group;         // the heaviest
} Blended;
