// prelude.cl: goes before every kernel file. WIDTH is how many pixels or groups a work-item of a
// loop-heavy kernel takes: 8 on CPUs, some kernels 16 where the processor's own vectors are as long,
// 1 on GPUs. Each lane does the same arithmetic in the same order, so that every width gives the same
// bits.
#pragma OPENCL FP_CONTRACT OFF

#ifndef WIDTH
#define WIDTH 1
#endif

// Samples are taken in tiles (samples.cl). TILE_ITEMS work-items go through a tile's list, in one
// work-group or, where a device allows no such groups, in several.
#define TILE_SAMPLES 256
#if WIDTH == 1
#define TILE_ITEMS TILE_SAMPLES
#else
#define TILE_ITEMS 1
#endif

// A step of a longer function. Vectors of a structure go by address: a call would copy them byte by
// byte; and it is inlined, so that they stay in registers. It returns none: Oclgrind takes no structure
// that an inlined function returns.
#define INLINED __attribute__((always_inline)) inline

#define JOIN_(a, b) a##b
#define JOIN(a, b) JOIN_(a, b)

#if WIDTH == 1
typedef float floatv;
typedef int intv;
#define LOADF(p) (*(p))
#define STOREF(v, p) (*(p) = (v))
#define LOADI(p) (*(p))
#define STOREI(v, p) (*(p) = (v))
#define LOAD_BYTES(p) ((int)*(p))
#define STORE_BYTES(v, p) (*(p) = (uchar)(v))
#define LANES ((floatv)(0.0f))
#define SELECT(no, yes, test) ((test) ? (yes) : (no))
#define ANY(test) (test)
#define ALL(test) (test)
#define BITS(test) ((test) ? 1 : 0)
#define TO_FLOATV(x) ((float)(x))
#define AS_INTV(x) as_int(x)
#define AS_FLOATV(x) as_float(x)
#define TO_INTV(x) ((int)(x))
#else
typedef JOIN(float, WIDTH) floatv;
typedef JOIN(int, WIDTH) intv;
#define LOADF(p) JOIN(vload, WIDTH)(0, (p))
#define STOREF(v, p) JOIN(vstore, WIDTH)((v), 0, (p))
#define LOADI(p) JOIN(vload, WIDTH)(0, (p))
#define STOREI(v, p) JOIN(vstore, WIDTH)((v), 0, (p))
#define LOAD_BYTES(p) JOIN(convert_int, WIDTH)(JOIN(vload, WIDTH)(0, (p)))
#define STORE_BYTES(v, p) JOIN(vstore, WIDTH)(JOIN(convert_uchar, WIDTH)(v), 0, (p))
#define SELECT(no, yes, test) select((no), (yes), (test))
#define ANY(test) any_lane(test)
#define ALL(test) all_lanes(test)
#define BITS(test) bits_of_lanes(test)  // lane k as bit k
#define TO_FLOATV(x) JOIN(convert_float, WIDTH)(x)
#define AS_INTV(x) JOIN(as_int, WIDTH)(x)
#define AS_FLOATV(x) JOIN(as_float, WIDTH)(x)
#define TO_INTV(x) JOIN(convert_int, WIDTH)(x)

// A vector's lanes by halves, until four are left.
#if WIDTH == 16
#define FOUR(test, op) (((test).lo op (test).hi).lo op ((test).lo op (test).hi).hi)
#define LANES                                                                                  \
  ((floatv)(0.0f, 1.0f, 2.0f, 3.0f, 4.0f, 5.0f, 6.0f, 7.0f, 8.0f, 9.0f, 10.0f, 11.0f, 12.0f, \
            13.0f, 14.0f, 15.0f))
#elif WIDTH == 8
#define FOUR(test, op) ((test).lo op (test).hi)
#define LANES ((floatv)(0.0f, 1.0f, 2.0f, 3.0f, 4.0f, 5.0f, 6.0f, 7.0f))
#else
#define FOUR(test, op) (test)  // WIDTH is 4
#define LANES ((floatv)(0.0f, 1.0f, 2.0f, 3.0f))
#endif

// Of a comparison's result, whose lanes are 0 or -1. (PoCL's any() and all() test lane by lane.)
inline int any_lane(const intv test) {
  // One or two instructions where lanes have bits of their own.
#if WIDTH == 8
  return as_ulong(convert_char8(test)) != 0;
#elif WIDTH == 16
  const ulong2 pair = as_ulong2(convert_char16(test));
  return (pair.x | pair.y) != 0;
#else
  const long2 pair = as_long2(FOUR(test, |));
  return (pair.x | pair.y) != 0;
#endif
}
inline int all_lanes(const intv test) {
  const long2 pair = as_long2(FOUR(test, &));
  return (pair.x & pair.y) == -1;
}
inline int bits_of_lanes(const intv test) {
#if WIDTH == 16
  const intv bits = test & (intv)(1, 2, 4, 8, 16, 32, 64, 128, 256, 512, 1024, 2048, 4096, 8192,
                                  16384, 32768);
#elif WIDTH == 8
  const intv bits = test & (intv)(1, 2, 4, 8, 16, 32, 64, 128);
#else
  const intv bits = test & (intv)(1, 2, 4, 8);
#endif
  const long2 pair = as_long2(FOUR(bits, |));
  const long both = pair.x | pair.y;
  return (int)(both | both >> 32);
}
#endif

// The tile of samples under a group of items that take WIDTH samples of a row each, from what is the
// same for all of them: loop bounds depend on it. The group's sides divide the tile's.
inline int tile_under_group(const int samples_x) {
  const int i = (int)(get_group_id(0) * get_local_size(0)) * WIDTH;
  const int j = (int)(get_group_id(1) * get_local_size(1));
  return j / TILE * ((samples_x + TILE - 1) / TILE) + i / TILE;
}

// The block of 8 x 8 samples that a sample lies in; blocks come row by row, two for each tile.
inline int block_of(const int i, const int j, const int samples_x) {
  return j / 8 * ((samples_x + TILE - 1) / TILE * 2) + i / 8;
}

// Values at WIDTH places of an array, and back.
inline floatv gather_float(global const float* values, const int* at) {
  float lane[WIDTH];
#pragma unroll
  for (int k = 0; k < WIDTH; ++k) lane[k] = values[at[k]];
  return LOADF(lane);
}

inline void scatter_float(const floatv v, global float* values, const int* at, const intv wanted) {
  float lane[WIDTH];
  int want[WIDTH];
  STOREF(v, lane);
  STOREI(wanted, want);
#pragma unroll
  for (int k = 0; k < WIDTH; ++k)
    if (want[k]) values[at[k]] = lane[k];
}

// None of the lanes may be NaN. By halves: a chain of fmin() over all lanes is long.
inline float least_lane(const floatv v) {
#if WIDTH == 1
  return v;
#else
#if WIDTH == 16
  const float8 eight = SELECT(v.lo, v.hi, v.hi < v.lo);
  const float4 four = SELECT(eight.lo, eight.hi, eight.hi < eight.lo);
#elif WIDTH == 8
  const float4 four = SELECT(v.lo, v.hi, v.hi < v.lo);
#else
  const float4 four = v;
#endif
  const float2 two = SELECT(four.lo, four.hi, four.hi < four.lo);
  return two.y < two.x ? two.y : two.x;
#endif
}

// fmax() and fmin() where only `a` may be NaN: an instruction instead of three.
inline floatv larger(const floatv a, const floatv b) { return SELECT(b, a, a > b); }
inline floatv smaller(const floatv a, const floatv b) { return SELECT(b, a, a < b); }

// The box around points, where wanted.
typedef struct {
  float x0, x1, y0, y1, z0, z1;
} Box;

inline Box box_of(const floatv x, const floatv y, const floatv z, const intv wanted) {
  const floatv nowhere = (floatv)(INFINITY);
  const Box box = {least_lane(SELECT(nowhere, x, wanted)), -least_lane(SELECT(nowhere, -x, wanted)),
                   least_lane(SELECT(nowhere, y, wanted)), -least_lane(SELECT(nowhere, -y, wanted)),
                   least_lane(SELECT(nowhere, z, wanted)), -least_lane(SELECT(nowhere, -z, wanted))};
  return box;
}

// 0 for -0, by its bits: some runtimes take x + 0 for x.
inline floatv plain_zero(const floatv x) {
  const intv bits = AS_INTV(x);
  return AS_FLOATV(SELECT(bits, (intv)(0), bits == (intv)(INT_MIN)));
}

// exp(x) for x <= 0, the same bits on every device: 2^(x/ln 2) split into an integer part, set as
// the exponent's bits, and a polynomial on [-1/2, 1/2]; relative error 2e-7. Below -87: zero.
inline floatv exp_negative(const floatv x) {
  const floatv y = larger(x, (floatv)(-87.0f)) * 1.44269504f;
  const intv whole = TO_INTV(y - 0.5f);  // y <= 0: truncation rounds y to the nearest integer
  const floatv f = (y - TO_FLOATV(whole)) * 0.693147181f;
  floatv p = (floatv)(1.0f / 5040.0f);
  p = fma(p, f, (floatv)(1.0f / 720.0f));
  p = fma(p, f, (floatv)(1.0f / 120.0f));
  p = fma(p, f, (floatv)(1.0f / 24.0f));
  p = fma(p, f, (floatv)(1.0f / 6.0f));
  p = fma(p, f, (floatv)(0.5f));
  p = fma(p, f, (floatv)(1.0f));
  p = fma(p, f, (floatv)(1.0f));
  const floatv scaled = p * AS_FLOATV((whole + 127) << 23);
  return SELECT(scaled, (floatv)(0.0f), x < -87.0f);
}

// ln x of a normal x > 0, the same bits on every device: the exponent, and 2 artanh t of the rest, which
// lies in [sqrt(1/2), sqrt(2)); within 1e-7 and two units in the last place.
inline floatv logarithm(const floatv x) {
  const intv whole = (AS_INTV(x) - 0x3f3504f3) >> 23;
  const floatv part = AS_FLOATV(AS_INTV(x) - (whole << 23));
  const floatv t = (part - 1.0f) / (part + 1.0f), t2 = t * t;
  floatv p = (floatv)(1.0f / 9.0f);
  p = fma(p, t2, (floatv)(1.0f / 7.0f));
  p = fma(p, t2, (floatv)(1.0f / 5.0f));
  p = fma(p, t2, (floatv)(1.0f / 3.0f));
  return fma(TO_FLOATV(whole), (floatv)(0.693147181f), 2.0f * fma(t * t2, p, t));
}

// smoothstep with the division written out; low < high.
inline floatv smooth_step(const float low, const float high, const floatv x) {
  const floatv t =
      smaller(larger((x - low) * (1.0f / (high - low)), (floatv)(0.0f)), (floatv)(1.0f));
  return t * t * (3.0f - 2.0f * t);
}

// Values from sample `first` on, which may lie before the map where its lanes are not used.
inline floatv load_from(global const float* map, const int first) {
#if WIDTH > 1
  if (first < 0) {
    float lane[WIDTH];
    for (int k = 0; k < WIDTH; ++k) lane[k] = map[max(first + k, 0)];
    return LOADF(lane);
  }
#endif
  return LOADF(map + max(first, 0));
}

// The ray of pixel (u, v): eye point (o + t d, -t) at depth t, affine in the pixel coordinates.
typedef struct {
  float ox, oy, dx, dy;
} Ray;

inline Ray ray_at(const RayMap ray, const float u, const float v) {
  Ray r;
  r.ox = ray.ox + ray.ox_u * u + ray.ox_v * v;
  r.oy = ray.oy + ray.oy_u * u + ray.oy_v * v;
  r.dx = ray.dx + ray.dx_u * u + ray.dx_v * v;
  r.dy = ray.dy + ray.dy_u * u + ray.dy_v * v;
  return r;
}

// The rays of samples, u and v in pixels: ray_at with vectors. a = D.D.
typedef struct {
  floatv ox, oy, dx, dy, a;
} Rays;

inline Rays rays_at(const RayMap ray, const floatv u, const floatv v) {
  Rays r;
  r.ox = ray.ox + ray.ox_u * u + ray.ox_v * v;
  r.oy = ray.oy + ray.oy_u * u + ray.oy_v * v;
  r.dx = ray.dx + ray.dx_u * u + ray.dx_v * v;
  r.dy = ray.dy + ray.dy_u * u + ray.dy_v * v;
  r.a = r.dx * r.dx + r.dy * r.dy + 1.0f;
  return r;
}

// Particles are drawn bin by bin (bins.cl): a bin is BIN x BIN samples, and a work-item draws ROWS
// rows of WIDTH of them: all of a bin, or one sample of it. So WIDTH is 1 here, or BIN or more.
#if WIDTH == 1
#define ROWS 1
#else
#define ROWS BIN
#endif

// The part of a bin that a work-item draws.
typedef struct {
  int bin;
  int begin, end;   // of the bin's entries
  int i, j;         // first sample
  int column, row;  // the same within the bin
} Part;

// end: see fill_bins. Beyond the bins that are listed, a part without entries.
inline Part part_of(global const int* end, const ListedBins bins) {
  const int items = max(BIN * BIN / (WIDTH * ROWS), 1);
  const int id = get_global_id(0), item = id % items;
  Part part;
  part.bin = bins.begin + id / items;
  part.begin = part.end = 0;
  if (part.bin < bins.end) {
    part.begin = part.bin > bins.begin ? end[part.bin - 1] : 0;
    part.end = end[part.bin];
  }
  part.column = items == 1 ? 0 : item % BIN;
  part.row = items == 1 ? 0 : item / BIN;
  part.i = part.bin % bins.across * BIN + part.column;
  part.j = part.bin / bins.across * BIN + part.row;
  return part;
}

// Where a part's rows lie, row r in lane r. What a row takes of a particle is worked out for all rows at
// once, and stored.
inline floatv rows_of(const Part part, const float first, const float step) {
  return first + step * ((float)part.j + LANES);
}

// The deepest value of a part's map.
inline float deepest_of(const floatv* map) {
  floatv deepest = map[0];
  for (int row = 1; row < ROWS; ++row) deepest = SELECT(deepest, map[row], map[row] > deepest);
  return -least_lane(-deepest);
}

// Stores the first `count` lanes, all of them if there are fewer.
inline void store_lanes(const floatv value, global float* to, const int count) {
  if (count >= WIDTH) {
    STOREF(value, to);
    return;
  }
  float lanes[WIDTH];
  STOREF(value, lanes);
  for (int lane = 0; lane < count; ++lane) to[lane] = lanes[lane];
}

// Stores the rows of a map that lie within the samples.
inline void store_rows(const Part part, const floatv* map, global float* depth,
                       const int nx, const int ny) {
  for (int row = 0; row < ROWS && part.j + row < ny; ++row)
    store_lanes(map[row], depth + (part.j + row) * nx + part.i, nx - part.i);
}

// First and last of the samples, and of the cells of 1 << shift samples each, that lie wholly in
// [low, high] of `count` samples in a row; cells at the far edge may have fewer samples. None where
// last < first.
inline intv first_within(const floatv low) {
  return TO_INTV(ceil(clamp(low, (floatv)(0.0f), (floatv)(1e6f))));
}
inline intv last_within(const floatv high, const int count) {
  const floatv limit = (floatv)(min(count - 1, 1000000));
  return TO_INTV(floor(clamp(high, (floatv)(-1.0f), limit)));
}
inline intv first_cell(const floatv low, const int shift) {
  return (first_within(low) + ((1 << shift) - 1)) >> shift;
}
inline intv last_cell(const floatv high, const int count, const int shift) {
  const intv last = last_within(high, count);
  return (SELECT(last + 1, last + (1 << shift), last == count - 1) >> shift) - 1;
}
// The first and the last sample of a cell.
inline intv first_of(const intv cell, const int shift) { return cell << shift; }
inline intv last_of(const intv cell, const int count, const int shift) {
  return min(((cell + 1) << shift) - 1, (intv)(count - 1));
}

// Stores the records of eight values of WIDTH particles: a value's lanes are theirs.
inline void store_records(const floatv* value, global float* records) {
#if WIDTH == 8
  float8 pair[8], four[8];
#pragma unroll
  for (int k = 0; k < 8; k += 2) {  // lanes 0, 1, 4, 5 of two values; the others
    const float8 a = value[k], b = value[k + 1];
    pair[k] = (float8)(a.s0, b.s0, a.s1, b.s1, a.s4, b.s4, a.s5, b.s5);
    pair[k + 1] = (float8)(a.s2, b.s2, a.s3, b.s3, a.s6, b.s6, a.s7, b.s7);
  }
#pragma unroll
  for (int k = 0; k < 8; k += 4) {  // four values of lanes 0 and 4, 1 and 5, 2 and 6, 3 and 7
    four[k] = (float8)(pair[k].s01, pair[k + 2].s01, pair[k].s45, pair[k + 2].s45);
    four[k + 1] = (float8)(pair[k].s23, pair[k + 2].s23, pair[k].s67, pair[k + 2].s67);
    four[k + 2] = (float8)(pair[k + 1].s01, pair[k + 3].s01, pair[k + 1].s45, pair[k + 3].s45);
    four[k + 3] = (float8)(pair[k + 1].s23, pair[k + 3].s23, pair[k + 1].s67, pair[k + 3].s67);
  }
#pragma unroll
  for (int lane = 0; lane < 4; ++lane) {
    vstore8((float8)(four[lane].lo, four[lane + 4].lo), lane, records);
    vstore8((float8)(four[lane].hi, four[lane + 4].hi), lane + 4, records);
  }
#else
#pragma unroll
  for (int k = 0; k < 8; ++k) {
    float lanes[WIDTH];
    STOREF(value[k], lanes);
    for (int lane = 0; lane < WIDTH; ++lane) records[8 * lane + k] = lanes[lane];
  }
#endif
}
