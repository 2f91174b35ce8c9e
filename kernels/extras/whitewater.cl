// whitewater.cl: foam, spray and bubbles as discs that face the camera, drawn one by one into sums.
//
// A disc adds to every pixel the share of the pixel that it covers. The share is the area in which a
// square and an ellipse overlap, worked out and not sampled: the shares of a disc add up to its area
// wherever it lies and however small it is, so that nothing flickers or goes missing. (In single
// precision this holds up to WIDE. Wider discs get a border that is a pixel wide.)
//
// A sum is a whole number of 64 bits in two words, which atomics raise: the order in which particles
// come leaves no trace, nor do chunks, threads and devices.
//
// One work-item per particle.

#define WIDE 64.0f                // half axis, pixels
#define LEAST 2.3283064365e-10f  // 2^-32: what sums are counted in, and the least share that is drawn

// What a particle adds wherever it is seen.
typedef struct {
  float depth;                // particle radii
  float u, v, half_u, half_v;  // middle and half axes, pixels
  float vx, vy, vz;           // in steps of `speed`
} Disc;

// Adds a value to the sum whose words lie at low[s] and high[s], in steps of 2^-32: the whole part to
// one word, the rest to the other. Who makes that one run over carries.
inline void add_to(global uint* low, global uint* high, const float value) {
  const float size = fabs(value), whole = floor(size);
  uint rest = (uint)((size - whole) * 4294967296.0f), carried = (uint)whole;
  if (value < 0.0f) {  // two's complement
    carried = ~carried + (rest == 0 ? 1u : 0u);
    rest = ~rest + 1u;
  }
  if (rest != 0) {
    const uint before = atomic_add(low, rest);
    if (before + rest < before) ++carried;
  }
  if (carried != 0) atomic_add(high, carried);
}

// arcsin x for 0 <= x <= 1 within 2e-7 (Abramowitz and Stegun 4.4.46).
inline float arc_sine(const float x) {
  float p = -0.0012624911f;
  p = p * x + 0.0066700901f;
  p = p * x - 0.0170881256f;
  p = p * x + 0.0308918810f;
  p = p * x - 0.0501743046f;
  p = p * x + 0.0889789874f;
  p = p * x - 0.2145988016f;
  p = p * x + 1.5707963050f;
  return 1.5707963268f - sqrt(1.0f - x) * p;
}

// The integral of sqrt(1 - t^2) from 0 to y, 0 <= y <= 1.
inline float under_arc(const float y) { return 0.5f * (y * sqrt(1.0f - y * y) + arc_sine(y)); }

// The integral of min(x, sqrt(1 - t^2)) from 0 to y, where 0 <= x <= 1 and |y| <= 1.
inline float under_capped_arc(const float x, const float y) {
  const float height = fabs(y), cut = sqrt(1.0f - x * x);
  const float area =
      height <= cut ? x * height : x * cut + (under_arc(height) - under_arc(cut));
  return y < 0.0f ? -area : area;
}

// The area of the unit disc between the heights y0 and y1 and between the middle and x, negative to
// the left.
inline float area_up_to(const float x, const float y0, const float y1) {
  const float far = fmin(fabs(x), 1.0f);
  const float area = under_capped_arc(far, y1) - under_capped_arc(far, y0);
  return x < 0.0f ? -area : area;
}

// The share of pixel (i, j) that a wide disc covers: in full, or within half a pixel of its border by
// how far the middle lies from there.
inline float share_of_wide(const Disc disc, const int i, const int j) {
  const float x = ((float)i + 0.5f - disc.u) / disc.half_u;
  const float y = ((float)j + 0.5f - disc.v) / disc.half_v;
  const float inside = (1.0f - sqrt(x * x + y * y)) * fmin(disc.half_u, disc.half_v);
  return clamp(inside + 0.5f, 0.0f, 1.0f);
}

// -log2(1 - share) for 0 < share <= 1; 32 where nothing is left.
inline float doublings(const float share) {
  if (share >= 1.0f) return 32.0f;
  const float rest = 1.0f - share;
  const uint bits = as_uint(rest);
  float exponent = (float)((int)(bits >> 23) - 127);
  float part = as_float((bits & 0x7fffffu) | 0x3f800000u);  // [1, 2)
  if (part > 1.41421356f) {
    part *= 0.5f;
    exponent += 1.0f;
  }
  // ln part = 2 artanh t, |t| <= .172. Near 1, from the share itself, which 1 - share has rounded.
  const float t = exponent == 0.0f ? -share / (2.0f - share) : (part - 1.0f) / (part + 1.0f);
  const float t2 = t * t;
  const float series =
      t * (1.0f + t2 * (0.333333333f + t2 * (0.2f + t2 * (0.142857143f + t2 * 0.111111111f))));
  return fmin(-(exponent + 2.88539008f * series), 32.0f);
}

inline void draw_share_of_pixel(const Disc disc, const float share, const int s, const float behind,
                                global uint* sum, global uint* depth, const Whitewater how) {
  const int size = how.nx * how.ny;
  add_to(sum + s, sum + size + s, share);
  add_to(sum + 2 * size + s, sum + 3 * size + s, doublings(share));
  atomic_min(depth + s, as_uint(disc.depth));
  global uint* row = sum + 4 * size + s;
  if (how.moves) {
    add_to(row, row + size, share * disc.vx);
    add_to(row + 2 * size, row + 3 * size, share * disc.vy);
    add_to(row + 4 * size, row + 5 * size, share * disc.vz);
    row += 6 * size;
  }
  if (how.lies_behind) add_to(row, row + size, share * fmin(fmax(behind, 0.0f), WHITEWATER_MOST));
}

// Adds particles to the sums of their type at the pixels that show them: where their depth lies within
// `from` and `to`.
kernel void draw_whitewater(POINTS(x, y, z),              // [count] world units
                            global const float* radius,   // [count] world units; 0: not drawn
                            VELOCITIES(vx, vy, vz),       // [count] world units per second
                            EXTENT(const, from, to),      // [pixels] particle radii
                            global uint* sum,    // [rows][2][pixels] low and high words of: shares;
                                                 // -log2(1 - share); where it moves three of velocity;
                                                 // where it lies behind, depth behind the front
                            global uint* depth,  // [pixels] bits of the nearest, +infinity before
                            const Projection at, const Whitewater how) {
  const int p = get_global_id(0);
  if (p >= how.count) return;  // the range is rounded up to whole work-groups
  const float px = x[p] - at.origin[0], py = y[p] - at.origin[1], pz = z[p] - at.origin[2];
  const float ex = at.rotation[0] * px + at.rotation[1] * py + at.rotation[2] * pz + at.shift[0];
  const float ey = at.rotation[3] * px + at.rotation[4] * py + at.rotation[5] * pz + at.shift[1];
  const float ez = at.rotation[6] * px + at.rotation[7] * py + at.rotation[8] * pz + at.shift[2];
  const float w = at.w_row[0] * ex + at.w_row[1] * ey + at.w_row[2] * ez + at.w_row[3];
  Disc disc;
  disc.depth = -ez;
  disc.u = (at.u_row[0] * ex + at.u_row[1] * ey + at.u_row[2] * ez + at.u_row[3]) / w;
  disc.v = (at.v_row[0] * ex + at.v_row[1] * ey + at.v_row[2] * ez + at.v_row[3]) / w;
  disc.half_u = radius[p] * how.per_length * at.u_scale / w;
  disc.half_v = radius[p] * how.per_length * at.v_scale / w;
  const float area = disc.half_u * disc.half_v;  // that the unit disc's is multiplied by
  // What is not a number fails these comparisons.
  if (!(disc.depth > at.near_depth && area > 0.25f * LEAST)) return;
  if (!(disc.u + disc.half_u > 0.0f && disc.u - disc.half_u < at.width)) return;
  if (!(disc.v + disc.half_v > 0.0f && disc.v - disc.half_v < at.height)) return;
  const float most = WHITEWATER_MOST;
  disc.vx = clamp(vx[p] * how.speed, -most, most);
  disc.vy = clamp(vy[p] * how.speed, -most, most);
  disc.vz = clamp(vz[p] * how.speed, -most, most);
  const int i0 = (int)fmax(floor(disc.u - disc.half_u), 0.0f);
  const int j0 = (int)fmax(floor(disc.v - disc.half_v), 0.0f);
  const int i1 = (int)fmin(floor(disc.u + disc.half_u), (float)(how.nx - 1));
  const int j1 = (int)fmin(floor(disc.v + disc.half_v), (float)(how.ny - 1));
  const int wide = disc.half_u > WIDE || disc.half_v > WIDE;
  for (int j = j0; j <= j1; ++j) {
    const float y0 = clamp(((float)j - disc.v) / disc.half_v, -1.0f, 1.0f);
    const float y1 = clamp(((float)(j + 1) - disc.v) / disc.half_v, -1.0f, 1.0f);
    float left = area_up_to(((float)i0 - disc.u) / disc.half_u, y0, y1);
    for (int i = i0; i <= i1; ++i) {
      const float right = area_up_to(((float)(i + 1) - disc.u) / disc.half_u, y0, y1);
      const float share = wide ? share_of_wide(disc, i, j) : fmin((right - left) * area, 1.0f);
      left = right;
      const int s = j * how.nx + i;
      if (share >= LEAST && disc.depth >= from[s] && disc.depth <= to[s])
        draw_share_of_pixel(disc, share, s, disc.depth - (from[s] + how.slack), sum, depth, how);
    }
  }
}
