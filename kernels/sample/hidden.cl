// hidden.cl: faces that a ray does not meet, or far away: where the fluid turns away from the eye they end
// the surface, hold it, or vouch for it (docs/method.md, blend). Functions only, for blend.cl.
//
// uses: tile_lists.cl creases.cl

// Hidden faces hold a point that lies within them by no more than this.
#define WITHIN -0.05f  // particle radii

// Those around a bend end nothing that lies outside of them by less than this, times how round they are
// (FIT_ROUND): their values differ by as much from fit to fit.
#define ROUND_LEEWAY 0.2f  // particle radii

// Hidden fits that a point lies outside of end the surface if their mean weight is at least so much of
// the mean of all hidden fits' near it.
#define CREDIBLE 0.05f

// Faces that a point lies within vouch for it when they weigh more than this; more than the second is
// enough where the blend is fully trusted. Where three faces meet most fits are bevels, which weigh
// little: without the second dam 015 lacked the tip of its corner.
#define VOUCHING 1e-3f
#define VOUCHING_SURE 3e-4f

// Third faces hold the nearer of two sheets from the first of these on, and fully from the second: their
// weight over that of all that the ray meets. Sheets nearer to each other than MEETING are as good as met.
#define HOLDING 0.0003f
#define HOLDING_SURE 0.002f
#define MEETING 0.1f  // particle radii

// A fit at a point: its value, a distance there, and unit gradient; its weight where the fluid ends, less
// the farther the point lies off its surface.
typedef struct {
  floatv f, gx, gy, gz, weight, per_slope;
} FaceValue;

// Returns whether any of the points (x, y, z) is within the fit's reach.
inline int face_at(const Fits fits, const int fit, const floatv x, const floatv y, const floatv z,
                   FaceValue* face) {
  global const float* g = fits.record + FIT * fit;
  global const float* foot = fits.foot + 4 * fit;
  const floatv px = x - foot[0], py = y - foot[1], pz = z - foot[2], none = (floatv)(0.0f);
  const floatv squared = square_of(px, py, pz) * g[FIT_NARROWNESS];
  if (!ANY(squared < 1.0f)) return 0;
  floatv gx, gy, gz;
  gradient_at(g, px, py, pz, &gx, &gy, &gz);
  const floatv slope = 1.0f / sqrt(larger(square_of(gx, gy, gz), (floatv)(1e-20f)));
  const floatv f = value_at(g, px, py, pz, gx, gy, gz) * slope;
  const floatv q = larger(1.0f - squared, none);
  face->f = f;
  face->gx = gx * slope;
  face->gy = gy * slope;
  face->gz = gz * slope;
  face->per_slope = slope;
  face->weight = g[FIT_END_WEIGHT] * q * q * q * larger(1.0f - 0.25f * f * f, none);
  return 1;
}

// The product of a unit normal and a ray's direction from which on a face is steep, or turns away.
inline floatv steep_for(const Sample s) {
  return -STEEP * sqrt(square_of(s.dx, s.dy, (floatv)(1.0f)));
}

// Sums over round fits of the sheet that is shown, as far as they are steep to the ray or turn away:
// weights, values at the blended point, and how these change along the ray. Where a drop or an arm turns
// away, the ray misses one of its fits after the other, and the last one that it meets would be drawn as
// a flag beside the outline.
typedef struct {
  floatv w, f, along, bend;
} Turning;

inline void add_turning(Turning* sum, global const float* g, const Sample s, const FaceValue* face,
                        const floatv along, const floatv weight) {
  sum->w += weight;
  sum->f = fma(weight, face->f, sum->f);
  sum->along = fma(weight, along, sum->along);
  sum->bend = fma(weight, bend_along(g, s) * face->per_slope, sum->bend);
}

// How high above the mean of these fits and of those that the ray meets, which it touches at that point,
// the ray passes; below 0 where it enters. `met` is what the latter weigh, `entering` how their values
// change along the ray.
inline floatv height_over(const Turning* sum, const floatv met, const floatv entering) {
  const floatv per = 1.0f / larger(sum->w + met, (floatv)(1e-30f));
  const floatv f = sum->f * per, along = (sum->along + entering) * per;
  return f - 0.25f * along * along / larger(sum->bend * per, (floatv)(LEAST_BEND));
}

// How far the nearer of two sheets that meet in a convex edge stays, because a third face holds it: one
// that rays meet far away or not at all, in a convex edge with the nearer sheet and a concave one with
// the deeper. At the end of a step's inner edge the step's riser holds the wall beside it.
inline floatv held_by(const Sample s, const List rim, const Fits fits, const Blending by,
                      const Sheet* near, const Sheet* deep, const floatv all, const intv wanted) {
  const floatv none = (floatv)(0.0f);
  const floatv x = s.sx + near->z * s.dx, y = s.sy + near->z * s.dy, z = -(s.t + near->z);
  const floatv steep = steep_for(s);
  const Box box = box_of(x, y, z, wanted);
  floatv within = none, beyond = none;
  int place[BLOCK + WIDTH];
  for (int from = 0; from < rim.count; from += BLOCK) {
    const int found = list_reaching(rim, from, box, place);
    for (int n = 0; n < found; ++n) {
      const int fit = rim.fit[place[n]];
      FaceValue face;
      if (!face_at(fits, fit, x, y, z, &face)) continue;
      const floatv with_near = dot_of(face.gx, face.gy, face.gz, near->nx, near->ny, near->nz),
                   with_deep = dot_of(face.gx, face.gy, face.gz, deep->nx, deep->ny, deep->nz);
      const floatv same = smooth_step(by.same_low, by.same_high, larger(with_near, with_deep));
      global const float* foot = fits.foot + 4 * fit;
      const floatv nx = foot[0] - near->cx, ny = foot[1] - near->cy, nz = foot[2] - near->cz;
      const floatv dx = foot[0] - deep->cx, dy = foot[1] - deep->cy, dz = foot[2] - deep->cz;
      const intv convex = (dot_of(nx, ny, nz, near->nx, near->ny, near->nz) < 0.0f) &
                          (dot_of(nx, ny, nz, face.gx, face.gy, face.gz) > 0.0f);
      const intv concave = (dot_of(dx, dy, dz, deep->nx, deep->ny, deep->nz) > 0.0f) &
                           (dot_of(dx, dy, dz, face.gx, face.gy, face.gz) < 0.0f);
      const floatv along = fma(face.gx, s.dx, fma(face.gy, s.dy, -face.gz));
      const floatv holds =
          SELECT(none, face.weight * (1.0f - same), convex & concave & (along > steep));
      within += SELECT(holds, none, face.f > 0.0f);
      beyond += SELECT(none, holds, face.f > 0.0f);
    }
  }
  return SELECT(none, smooth_step(HOLDING, HOLDING_SURE, within / larger(all, (floatv)(1e-30f))),
                wanted & (within > beyond));
}

// Sums over the faces at the point that is shown. Where the fluid turns away from the eye no ray enters
// it, and hidden fits tell of sheet R. A convex edge between the surface and R ends the surface where it
// leaves R's fluid. Within it R vouches for the surface, as sheet B does, and so do faces so steep that
// the ray meets them far away.
typedef struct {
  // Of R: weights, values, feet and gradients; what those weigh that the point lies outside of; and both
  // times their own weight in the blend.
  floatv w, f, cx, cy, cz, nx, ny, nz, outside, strong, strong_outside;
  floatv within, beyond;  // what faces weigh that the point lies in, and outside of
  Turning turning;
} Hidden;

// `middle` is that of the sheet that is shown, `steep` what steep_for says.
INLINED void add_face(Hidden* sum, const Fits fits, const int fit, const Sample s,
                      const FaceValue* face, const Axis* middle, const Blended* shown,
                      const floatv steep, const Blending by) {
  global const float* foot = fits.foot + 4 * fit;
  global const float* g = fits.record + FIT * fit;
  const floatv none = (floatv)(0.0f);
  const floatv cosine = dot_of(face->gx, face->gy, face->gz, shown->nx, shown->ny, shown->nz);
  const floatv weight = face->weight * (1.0f - smooth_step(by.same_low, by.same_high, cosine));
  const floatv along = fma(face->gx, s.dx, fma(face->gy, s.dy, -face->gz));
  if (g[FIT_ROUND] > 0.5f * ROUNDEST) {
    const floatv same = smooth_step(by.same_low, by.same_high, leeway_of(g) + cosine) *
                        smooth_step(0.5f * ROUNDEST, ROUNDEST, (floatv)(g[FIT_ROUND]));
    const floatv turned = SELECT(none, face->weight * same, along > steep);
    add_turning(&sum->turning, g, s, face, along, turned);
  }
  const floatv tx = foot[0] - middle->x, ty = foot[1] - middle->y, tz = foot[2] - middle->z;
  const intv convex = (dot_of(tx, ty, tz, shown->nx, shown->ny, shown->nz) < 0.0f) &
                      (dot_of(tx, ty, tz, face->gx, face->gy, face->gz) > 0.0f);
  const floatv hidden = SELECT(none, weight, convex & (along > steep));
  sum->within += SELECT(hidden, none, face->f > 0.0f);
  sum->beyond += SELECT(none, hidden, face->f > 0.0f);
  const floatv w = SELECT(none, weight, along > 0.0f);
  const floatv own = (floatv)(g[FIT_END_WEIGHT]);
  const floatv outside = SELECT(w, none, face->f < 0.0f);
  sum->w += w;
  sum->outside += outside;
  sum->strong = fma(w, own, sum->strong);
  sum->strong_outside = fma(outside, own, sum->strong_outside);
  // Of several faces one that the point lies outside of ends the surface, however far within the
  // others it lies. The next ones are no numbers where the depth is infinite; w is 0 there.
  sum->f = fma(w, larger(face->f, (floatv)(WITHIN)) - ROUND_LEEWAY * g[FIT_ROUND], sum->f);
  sum->cx = fma(w, (floatv)(foot[0]), sum->cx);
  sum->cy = fma(w, (floatv)(foot[1]), sum->cy);
  sum->cz = fma(w, (floatv)(foot[2]), sum->cz);
  sum->nx = fma(w, face->gx, sum->nx);
  sum->ny = fma(w, face->gy, sum->ny);
  sum->nz = fma(w, face->gz, sum->nz);
}

INLINED void look_at_hidden(const List rim, const Fits fits, const Sample s, const Axis* middle,
                            const Blended* shown, const Blending by, Hidden* sum) {
  const floatv none = (floatv)(0.0f);
  const Hidden nothing = {none, none, none, none, none, none, none, none,
                          none, none, none, none, none, {none, none, none, none}};
  *sum = nothing;
  const floatv end = shown->depth - s.t, ex = s.sx + end * s.dx, ey = s.sy + end * s.dy;
  const floatv steep = steep_for(s);
  const Box box = box_of(ex, ey, -shown->depth, shown->depth < INFINITY);
  int place[BLOCK + WIDTH];
  for (int from = 0; from < rim.count; from += BLOCK) {
    const int found = list_reaching(rim, from, box, place);
    for (int n = 0; n < found; ++n) {
      const int fit = rim.fit[place[n]];
      FaceValue face;
      if (face_at(fits, fit, ex, ey, -shown->depth, &face))
        add_face(sum, fits, fit, s, &face, middle, shown, steep, by);
    }
  }
}

// Whether hidden faces end the surface.
INLINED intv ended_by(const Hidden* r, const Axis* middle, const Blended* shown) {
  const floatv per = 1.0f / larger(r->w, (floatv)(1e-30f));
  const floatv x = r->cx * per - middle->x, y = r->cy * per - middle->y, z = r->cz * per - middle->z;
  // Bevels between hidden faces end nothing that these hold.
  const intv credible = r->strong_outside * r->w > CREDIBLE * (r->strong * r->outside);
  return (r->w > 1e-3f) & (r->f > 0.0f) & credible &
         (x * shown->nx + y * shown->ny + z * shown->nz < 0.0f) &
         (x * r->nx + y * r->ny + z * r->nz > 0.0f);
}
