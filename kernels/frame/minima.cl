// minima.cl: discs, spheres and triangles drawn one by one, by atomic minima (paper 2.1): the other way
// than bin by bin (visible.cl, behind.cl, spheres.cl, region.cl). It needs no lists, so that the device
// waits for nobody; where many lie over each other, many minima are for nothing.
//
// Depths are positive floats, whose bits order like integers, so a map of minima is the same in whatever
// order they come. Who owns a sample is found in a second pass: of those whose depth is the map's, the
// lowest index. What is drawn, and at which samples, is worked out by the same operations as bin by bin:
// both ways give the same bits.
//
// uses: outlines.cl

// Work-items that share a disc: its rows in turns. Elsewhere vectors are busy with one.
#if WIDTH == 1
#define SHARES DISC_SHARES
#else
#define SHARES 1
#endif

// A depth before an atomic minimum of it, which may be an old one: it is only ever too deep, and then
// the minimum is for nothing. Discs lie over each other, so that most minima are saved.
// (ATOMICS_ALONE: not looked at, for a checker that takes it for a race.)
#ifdef ATOMICS_ALONE
#define DEPTHS_AT(map, s) ((floatv)(INFINITY))
#define OWNERS_AT(map, s) ((intv)(INT_MAX))
#define FAR_AT(map, s) ((floatv)(0.0f))
#else
#define DEPTHS_AT(map, s) LOADF((global const float*)(map) + (s))
#define OWNERS_AT(map, s) LOADI((map) + (s))
#define FAR_AT(map, s) LOADF((global const float*)(map) + (s))
#endif

// What is to be drawn of a disc: rows j0, j0 + step, ... up to j1 of columns i0 to i1, without the bins
// whose bound is below its key.
typedef struct {
  int p;  // the disc; -1: none
  int i0, i1, j0, j1;
  float key;
} Share;

// Of the work-item's disc, of `count` that `before` others have their items before: nothing so far.
inline Share share_among(const int before, const int count) {
  const int p = (int)get_global_id(0) / SHARES - before;
  const Share share = {p >= 0 && p < count ? p : -1,  // the range is rounded up to whole work-groups
                       0, -1, 0, -1, 0.0f};
  return share;
}

// Its rows of a box, in turns.
inline void take_rows(Share* share, const int i0, const int i1, const int j0, const int j1,
                      const float key) {
  const Share taken = {share->p, i0, i1, j0 + (int)get_global_id(0) % SHARES, j1, key};
  *share = taken;
}

// The share of an outline's box.
inline Share share_of_box(global const int* box, global const float* key, const Outlined all) {
  Share share = share_among(0, all.count);
  const int p = share.p, stride = all.stride;
  if (p >= 0)
    take_rows(&share, box[p], box[stride + p], box[2 * stride + p], box[3 * stride + p], key[p]);
  return share;
}

// The box that a particle may cover, as outline_discs finds it, and its disc.
#if WIDTH == 1
#define FIRST_LANE(v) (v)
#else
#define FIRST_LANE(v) (v).s0
#endif
inline Share share_of_particle(global const float* particles,  // [6][stride] as of outline_discs
                               const int before, const DrawnSpheres all, const Lattice samples,
                               float8* disc) {
  Share share = share_among(before, all.count);
  if (share.p < 0) return share;
  const Spheres s =
      spheres_of(particles + share.p, all.stride, (float2)(all.footprint, all.bulge));
  const Outline o = outline_of(s, (int2)(samples.nx, samples.ny),
                               (float2)(samples.first, all.inverse_step), all.drawn);
  take_rows(&share, FIRST_LANE(o.i0), FIRST_LANE(o.i1), FIRST_LANE(o.j0), FIRST_LANE(o.j1),
            FIRST_LANE(o.key));
  *disc = (float8)(FIRST_LANE(o.disc[0]), FIRST_LANE(o.disc[1]), FIRST_LANE(o.disc[2]),
                   FIRST_LANE(o.disc[3]), FIRST_LANE(o.disc[4]), FIRST_LANE(o.disc[5]),
                   FIRST_LANE(o.disc[6]), FIRST_LANE(o.disc[7]));
  return share;
}

// Goes through WIDTH samples of a share at a time: sample s = (i, j) and those to its right that are
// `inside`. In a row, vectors keep to bins.
#define EACH_SAMPLE(share, bound, bins_x)                                                        \
  for (int j = (share).j0; j <= (share).j1; j += SHARES)                                         \
    for (int left = (share).i0 / BIN * BIN; left <= (share).i1; left += BIN)                     \
      if ((share).key <= (bound)[j / BIN * (bins_x) + left / BIN])                               \
        for (int i = WIDTH == 1 ? max((share).i0, left) : left; i <= min((share).i1, left + BIN - 1); \
             i += WIDTH)

inline intv inside_share(const Share share, const int i) {
  const intv column = i + TO_INTV(LANES);
  return (column >= share.i0) & (column <= share.i1);
}

// Lowers the map, or raises it, at the samples from s on that `better` names. Returns at how many of
// them it is the first to lower it from infinity.
#define LOWER 0
#define RAISE 1
inline int move_to(const int direction, global uint* map, const int s, const floatv depth,
                   const intv better) {
#if WIDTH == 1
  if (!better) return 0;
  uint before;
  if (direction == LOWER)
    before = atomic_min(map + s, as_uint(depth));
  else
    before = atomic_max(map + s, as_uint(depth));
  return before == as_uint(INFINITY);
#else
  if (!ANY(better)) return 0;
  uint bits[WIDTH];
  int moved[WIDTH], first = 0;
  STOREI(better, moved);
  STOREF(depth, (float*)bits);
  for (int lane = 0; lane < WIDTH; ++lane) {
    if (!moved[lane]) continue;
    if (direction == LOWER)
      first += atomic_min(map + s + lane, bits[lane]) == as_uint(INFINITY);
    else
      atomic_max(map + s + lane, bits[lane]);
  }
  return first;
#endif
}

inline int lower(global uint* map, const int s, const floatv depth, const intv better) {
  return move_to(LOWER, map, s, depth, better & (depth < DEPTHS_AT(map, s)));
}

// Whether disc p becomes the owner of sample s: the lowest index wins. Who owned it before has one less
// in `owned`, unless that is 0.
inline int take(global int* owner, const int s, const int p, global int* owned) {
  const int before = atomic_min(owner + s, p);
  if (before < p) return 0;
  if (owned && before != INT_MAX) atomic_dec(owned + before);
  return 1;
}

// The same of the samples from s on where `nearest`. Returns how many p takes.
inline int own(global int* owner, const int s, const int p, const intv nearest, global int* owned) {
  const intv better = nearest & (p < OWNERS_AT(owner, s));
#if WIDTH == 1
  return better ? take(owner, s, p, owned) : 0;
#else
  if (!ANY(better)) return 0;
  int wanted[WIDTH], taken = 0;
  STOREI(better, wanted);
  for (int lane = 0; lane < WIDTH; ++lane)
    if (wanted[lane]) taken += take(owner, s + lane, p, owned);
  return taken;
#endif
}

// bulge sqrt(1 - d^2) of a disc at WIDTH samples; NaN beside it, where no comparison holds. As
// draw_discs works it out.
inline floatv half_depth_at(const float8 d, const int i, const int j, const Lattice samples) {
  const floatv du = (samples.first + samples.step * TO_FLOATV(i + TO_INTV(LANES)) - d.s1) * d.s3;
  const float dv = (samples.first + samples.step * (float)j - d.s2) * d.s4;
  return d.s5 * sqrt(1.0f - (du * du + dv * dv));
}
inline floatv in_front(const floatv depth) {
  return SELECT(depth, (floatv)(1e-6f), depth < 1e-6f);
}

// A work-item's share of a disc. Maps that are 0 are left alone; where `behind` is 0, all fronts count.
inline void draw_share(const Share share, const float8 d,  // of outline_discs
                       global const float* bound,          // [bins] none with a larger key is drawn
                       const int across, const Lattice samples,
                       global const float* behind,  // [samples] only fronts deeper than this + gap
                       const float gap,             // particle radii
                       global uint* from,          // [samples] lowered by fronts
                       global int* occupied,       // [blocks] at how many of them there is one
                       global uint* to,            // [samples] raised by backs
                       global const float* depth,  // [samples] whose front is this owns the sample:
                       global int* owner,          // [samples] the lowest of several
                       global int* owned) {        // [discs] how many samples each owns
  int taken = 0;
  EACH_SAMPLE(share, bound, across) {
    const int s = j * samples.nx + i;
    const floatv half_depth = half_depth_at(d, i, j, samples), back = d.s0 + half_depth;
    const floatv front = in_front(d.s0 - half_depth);
    intv inside = inside_share(share, i);
    if (behind) inside &= front > LOADF(behind + s) + gap;
    if (from) {
      const int first = lower(from, s, front, inside);
      if (occupied && first > 0) atomic_add(occupied + block_of(i, j, samples.nx), first);
    }
    if (to) move_to(RAISE, to, s, back, inside & (back > FAR_AT(to, s)));
    if (owner) taken += own(owner, s, share.p, inside & (front == LOADF(depth + s)), owned);
  }
  if (taken > 0 && owned) atomic_add(owned + share.p, taken);
}

// The nearest front at every sample. SHARES work-items a disc, of this kernel and the next ones.
kernel void lower_discs(global const float* disc, OUTLINES(const, box, key),
                        global const float* bound,
                        global uint* depth,  // [samples] bits of the depth, particle radii; +infinity
                                             // before
                        const Outlined all, const Lattice samples) {
  const Share share = share_of_box(box, key, all);
  if (share.p < 0) return;
  draw_share(share, vload8(share.p, disc), bound, all.across, samples, 0, 0, depth, 0, 0, 0, 0, 0);
}

// The nearest front of some particles and, of others, the farthest back as well; at how many samples of
// each block there is one. Few are splash, and those are large: a launch of their own would leave most of a
// GPU idle.
kernel void lower_fronts_and_extents(global const float* seen,    // [6][stride] t, u, v, ku, kv, scale
                                     global const float* splash,  // the same
                                     global const float* bound, LOWERED(depth, occupied),
                                     LOWERED_AND_RAISED(from, to, of_splash),
                                     const DrawnSpheres fronts, const DrawnSpheres extents,
                                     const Lattice samples) {
  float8 disc;
  const Share front = share_of_particle(seen, 0, fronts, samples, &disc);
  if (front.p >= 0)
    draw_share(front, disc, bound, fronts.across, samples, 0, 0, depth, occupied, 0, 0, 0, 0);
  const Share extent = share_of_particle(splash, fronts.count, extents, samples, &disc);
  if (extent.p >= 0)
    draw_share(extent, disc, bound, extents.across, samples, 0, 0, from, of_splash, to, 0, 0, 0);
}

// The disc whose front is the map's, the lowest index of several.
kernel void own_discs(global const float* disc, OUTLINES(const, box, key),
                      global const float* bound,
                      global const float* depth,  // [samples] of lower_discs
                      global int* owner,          // [samples] INT_MAX before
                      const Outlined all, const Lattice samples) {
  const Share share = share_of_box(box, key, all);
  if (share.p < 0) return;
  draw_share(share, vload8(share.p, disc), bound, all.across, samples, 0, 0, 0, 0, 0, depth, owner,
             0);
}

// The same, and how many samples each disc owns.
kernel void count_discs(global const float* disc, OUTLINES(const, box, key),
                        global const float* bound, global const float* depth, global int* owner,
                        global int* owned,  // [discs] 0 before
                        const Outlined all, const Lattice samples) {
  const Share share = share_of_box(box, key, all);
  if (share.p < 0) return;
  draw_share(share, vload8(share.p, disc), bound, all.across, samples, 0, 0, 0, 0, 0, depth, owner,
             owned);
}

// The nearest front of particles deeper than `behind` + gap.
kernel void lower_discs_behind(global const float* particles, global const float* bound,
                               global const float* behind,  // [samples] +infinity: nothing is asked
                               global uint* depth,          // [samples] +infinity before
                               const DrawnSpheres all, const Lattice samples,
                               const float gap) {  // particle radii
  float8 disc;
  const Share share = share_of_particle(particles, 0, all, samples, &disc);
  if (share.p < 0) return;
  draw_share(share, disc, bound, all.across, samples, behind, gap, depth, 0, 0, 0, 0, 0);
}

// Where rays enter a sphere; NaN beside it. As draw_spheres of spheres.cl works it out.
inline floatv entry_of(const float8 sphere, const Rays r) {
  const floatv qx = r.ox + sphere.s2 * r.dx - sphere.s0, qy = r.oy + sphere.s2 * r.dy - sphere.s1;
  const floatv b = qx * r.dx + qy * r.dy;
  const floatv c = qx * qx + qy * qy - sphere.s3;
  return in_front(sphere.s2 - (b + sqrt(b * b - r.a * c)) / r.a);
}

inline Rays rays_from(const Screen screen, const int i, const int j) {
  return rays_at(screen.rays, screen.first + screen.step * TO_FLOATV(i + TO_INTV(LANES)),
                 (floatv)(screen.first + screen.step * (float)j));
}

// A work-item's share of a sphere: as draw_share.
inline void draw_sphere_share(global const float* sphere,  // [stride][8] of outline_spheres
                              global const int* box, global const float* key,
                              global const float* bound, const Outlined all,
                              const Screen screen, global uint* from, global const float* depth,
                              global int* owner) {
  const Share share = share_of_box(box, key, all);
  if (share.p < 0) return;
  const float8 ball = vload8(share.p, sphere);
  EACH_SAMPLE(share, bound, all.across) {
    const int s = j * screen.nx + i;
    const floatv entry = entry_of(ball, rays_from(screen, i, j));
    const intv inside = inside_share(share, i);
    if (from) lower(from, s, entry, inside);
    if (owner) own(owner, s, share.p, inside & (entry == LOADF(depth + s)), 0);
  }
}

// The nearest entry at every sample.
kernel void lower_spheres(global const float* sphere, OUTLINES(const, box, key),
                          global const float* bound,
                          global uint* depth,  // [samples] +infinity before
                          const Outlined all, const Screen screen) {
  draw_sphere_share(sphere, box, key, bound, all, screen, depth, 0, 0);
}

// The sphere whose entry is the map's, the lowest index of several.
kernel void own_spheres(global const float* sphere, OUTLINES(const, box, key),
                        global const float* bound, global const float* depth,
                        global int* owner,  // [samples] INT_MAX before
                        const Outlined all, const Screen screen) {
  draw_sphere_share(sphere, box, key, bound, all, screen, 0, depth, owner);
}

// (X - c) / radius where a sample has an owner, as sphere_normals works it out. One work-item per WIDTH
// samples of a row.
kernel void normals_of_owners(global const float* sphere, global const float* depth,
                              global const int* owner,
                              global float* normal,  // [3][samples] unit, eye axes; zero: none
                              const Screen screen) {
  const int i = get_global_id(0) * WIDTH, j = get_global_id(1);
  if (i >= screen.nx || j >= screen.ny) return;
  const int s = j * screen.nx + i, size = screen.nx * screen.ny, here = screen.nx - i;
  int sphere_of[WIDTH];
  float cx[WIDTH], cy[WIDTH], ct[WIDTH];
  const intv owners = LOADI(owner + s);
  const intv none = (owners == INT_MAX) | (TO_INTV(LANES) >= here);
  STOREI(SELECT(owners, (intv)(0), none), sphere_of);
  for (int lane = 0; lane < WIDTH; ++lane) {
    cx[lane] = sphere[8 * sphere_of[lane]];
    cy[lane] = sphere[8 * sphere_of[lane] + 1];
    ct[lane] = sphere[8 * sphere_of[lane] + 2];
  }
  const Rays r = rays_from(screen, i, j);
  const floatv t = SELECT(LOADF(depth + s), (floatv)(1.0f), none);
  const floatv x = r.ox + t * r.dx - LOADF(cx), y = r.oy + t * r.dy - LOADF(cy);
  const floatv z = LOADF(ct) - t;
  const floatv length = sqrt(x * x + y * y + z * z);
  const floatv zero = (floatv)(0.0f);
  store_lanes(SELECT(x / length, zero, none), normal + s, here);
  store_lanes(SELECT(y / length, zero, none), normal + size + s, here);
  store_lanes(SELECT(z / length, zero, none), normal + 2 * size + s, here);
}

// The kept triangles' depth in the blocks that are `needed`, as draw_triangles of region.cl works it
// out.
kernel void lower_triangles(global const float* corners,  // [9][stride] as of outline_triangles
                            global const float* bound,
                            global uint* depth,  // [samples] +infinity before
                            const Outlined all, const Lattice samples, const int perspective,
                            global const int* needed) {  // [blocks] 0: no sample of it is read
  Share share = share_among(0, all.count);
  if (share.p < 0) return;
  const TriangleOutline o =
      outline_of_triangle(corners, share.p, all.stride, samples, perspective);
  take_rows(&share, o.i0, o.i1, o.j0, o.j1, -INFINITY);
  const float16 r = o.record;
  EACH_SAMPLE(share, bound, all.across) {
    if (!needed[block_of(i, j, samples.nx)]) continue;
    const int s = j * samples.nx + i;
    const floatv du = samples.first + samples.step * TO_FLOATV(i + TO_INTV(LANES)) - r.s0;
    const float dv = samples.first + samples.step * (float)j - r.s1;
    const floatv l1 = (du * r.s5 - r.s4 * dv) * r.s6, l2 = (r.s2 * dv - du * r.s3) * r.s6;
    const floatv l0 = 1.0f - l1 - l2;
    const intv inside = inside_share(share, i) & (l0 >= -1e-5f) & (l1 >= -1e-5f) & (l2 >= -1e-5f);
    floatv d = l0 * r.s7 + l1 * r.s8 + l2 * r.s9;
    if (perspective) d = 1.0f / d;
    lower(depth, s, d, inside & (d > 0.0f));
  }
}
