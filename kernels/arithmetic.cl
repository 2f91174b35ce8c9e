// arithmetic.cl: what the same bits on every device rest on, asked one thing at a time
// (src/verify/arithmetic.hpp). Each kernel is built by itself, with -D PROBE_..., so that what does
// not build costs no other its answer.

#if WIDTH == 1
typedef uint uintv;
#define AS_UINTV(x) as_uint(x)
#define TO_INTV_DOWN(x) convert_int_rtn(x)
#else
typedef JOIN(uint, WIDTH) uintv;
#define AS_UINTV(x) JOIN(as_uint, WIDTH)(x)
#define TO_INTV_DOWN(x) JOIN(JOIN(convert_int, WIDTH), _rtn)(x)
#endif
#define TRUTH(test) SELECT((intv)(0), (intv)(1), test)

#if defined(PROBE_EXPRESSIONS) || defined(PROBE_BUILT_IN)
// What the host asks for is numbered by it: -D PROBE_SUM=0 -D PROBE_DIFFERENCE=1 ...
#define FLOATS(name, expression)  \
  case JOIN(PROBE_, name):        \
    found = AS_INTV(expression);  \
    break;
#define INTEGERS(name, expression)  \
  case JOIN(PROBE_, name):          \
    found = expression;             \
    break;

// One expression of the floats a, b, c or, of the same bits, of the integers x, y, z. Bits come and
// go as integers, which nothing rounds or flushes. One work-item per WIDTH values.
kernel void compute_values(global const int* xs, global const int* ys, global const int* zs,
                           global int* result, const int probe) {
  const int i = get_global_id(0) * WIDTH;
  const intv x = LOADI(xs + i), y = LOADI(ys + i), z = LOADI(zs + i);
  const floatv a = AS_FLOATV(x), b = AS_FLOATV(y), c = AS_FLOATV(z);
  intv found = (intv)(0);
  switch (probe) {
#ifdef PROBE_EXPRESSIONS
    FLOATS(SUM, a + b)
    FLOATS(DIFFERENCE, a - b)
    FLOATS(PRODUCT, a * b)
    FLOATS(QUOTIENT, a / b)
    FLOATS(RECIPROCAL, 1.0f / a)
    FLOATS(SQUARE_ROOT, sqrt(fabs(a)))
    FLOATS(FUSED, fma(a, b, c))
    FLOATS(PRODUCT_AND_SUM, a * b + c)
    FLOATS(PRODUCT_AND_DIFFERENCE, c - a * b)
    FLOATS(SUM_OF_PRODUCTS, a * b + b * c + c * a)
    FLOATS(SUM_OF_THREE, a + (b + c))
    FLOATS(SUM_TAKEN_BACK, (a + b) - a)
    FLOATS(PRODUCT_TAKEN_BACK, a * b / b)
    FLOATS(COMMON_FACTOR, a * b + a * c)
    FLOATS(DENORMAL_SUM, a + b)
    FLOATS(DENORMAL_PRODUCT, a * b)
    INTEGERS(DENORMAL_COMPARISON, TRUTH(a < b) | TRUTH(a == b) << 1 | TRUTH(a > 0.0f) << 2)
    FLOATS(INFINITE_SUM, a + b)
    FLOATS(INFINITE_PRODUCT, a * b)
    FLOATS(INFINITE_QUOTIENT, a / b)
    INTEGERS(COMPARISON, TRUTH(a < b) | TRUTH(a <= b) << 1 | TRUTH(a > b) << 2 |
             TRUTH(a >= b) << 3 | TRUTH(a == b) << 4 | TRUTH(a != b) << 5 | TRUTH(a < INFINITY) << 6)
    INTEGERS(NEGATION, TRUTH(!(a < b)) | TRUTH((a < b) & !(b < c)) << 1)
    FLOATS(LEAST, fmin(a, b))
    FLOATS(GREATEST, fmax(a, b))
    FLOATS(CLAMPED, clamp(a, fmin(b, c), fmax(b, c)))
    FLOATS(SELECTED, SELECT(a, b, a < c))
    FLOATS(ABSOLUTE, fabs(a))
    FLOATS(NEGATED, -a)
    FLOATS(ROUNDED_DOWN, floor(a))
    FLOATS(ROUNDED_UP, ceil(a))
    FLOATS(EXP_NEGATIVE, exp_negative(a))
    FLOATS(SMOOTH_STEP, smooth_step(0.2f, 0.7f, a))
    INTEGERS(FLOAT_TO_INT, TO_INTV(a))
    INTEGERS(FLOOR_TO_INT, TO_INTV(floor(a)))
    FLOATS(INT_TO_FLOAT, TO_FLOATV(x))
    INTEGERS(UINT_WRAPS, AS_INTV(AS_UINTV(x) * AS_UINTV(y) + AS_UINTV(z)))
    INTEGERS(INT_QUOTIENT, x / ((y & 0xffff) + 1) ^ x % ((z & 0xff) + 1))
    INTEGERS(SHIFTS, (x << (y & 31)) ^ (x >> (z & 31)) ^ AS_INTV(AS_UINTV(x) >> AS_UINTV(y & 31)))
    INTEGERS(INT_BOUNDS, min(max(x, y), z))
    INTEGERS(BITWISE, (x & y) | (~z ^ x))
    FLOATS(SELECTED_BITS, SELECT(AS_FLOATV(x), AS_FLOATV(y), x < z))
#else
    INTEGERS(CONVERT_INT_RTN, TO_INTV_DOWN(a))
    INTEGERS(MUL24, mul24(x >> 8, y >> 8))
    INTEGERS(POPCOUNT, popcount(x))
    INTEGERS(CLZ, clz(x))
    FLOATS(MAD, mad(a, b, c))
    FLOATS(EXP, exp(a))
    FLOATS(EXP2, exp2(a))
    FLOATS(RSQRT, rsqrt(fabs(a)))
    FLOATS(NATIVE_EXP, native_exp(a))
    FLOATS(NATIVE_RSQRT, native_rsqrt(fabs(a)))
    FLOATS(NATIVE_RECIP, native_recip(a))
#endif
  }
  STOREI(found, result + i);
}
#endif

#ifdef PROBE_SUM_IN_ORDER
// Sums of `count` values one after another. One work-item per WIDTH sums.
kernel void sum_in_order(global const float* values,  // [count][sums]
                         global float* sum, const int count, const int sums) {
  const int i = get_global_id(0) * WIDTH;
  floatv total = (floatv)(0.0f);
  for (int k = 0; k < count; ++k) total += LOADF(values + k * sums + i);
  STOREF(total, sum + i);
}
#endif

#ifdef PROBE_VECTOR_LOADS
// Copies 14 values as vectors of 2, 4 and 8, from and to any multiple of four bytes. (No kernel of
// ours loads 16: docs/portability.md.)
kernel void copy_vectors(global const float* from, global float* to, const int offset) {
  const int i = get_global_id(0) * 14 + offset;
  vstore2(vload2(0, from + i), 0, to + i);
  vstore4(vload4(0, from + i + 2), 0, to + i + 2);
  vstore8(vload8(0, from + i + 6), 0, to + i + 6);
}
#endif

#ifdef PROBE_LANES
// Halves, lanes and tests of eight lanes: 16 integers an item.
kernel void take_lanes(global const int* from, global int* to) {
  const int i = get_global_id(0);
  const int8 v = vload8(i, from);
  global int* out = to + 16 * i;
  vstore4(v.lo - v.hi, 0, out);
  vstore2((int2)(v.s3, v.s7), 0, out + 4);
  const int8 negative = v < 0;
  out[6] = negative.s0 + 2 * negative.s5;  // -1 where true
  out[7] = any(negative);
  out[8] = all(negative);
  out[9] = ANY(negative);
  out[10] = ALL(negative);
  const long2 pair = as_long2(v.lo);
  out[11] = (int)(pair.x >> 32) ^ (int)pair.y;
  const int8 chosen = select(v, (int8)(i), negative);
  out[12] = chosen.s1;
  out[13] = chosen.s6;
  const int8 whole = convert_int8(convert_float8(v & 0xffff) * 0.5f);
  out[14] = whole.s2;
  out[15] = whole.s4;
}
#endif

#ifdef PROBE_PRIVATE_MEMORY
typedef struct {
  floatv sum, difference;
  int from;
} Pair;

inline Pair pair_of(const floatv value, const float other, const int from) {
  Pair pair;
  pair.sum = value + other;
  pair.difference = value - other;
  pair.from = from;
  return pair;
}

// Structures returned by value and kept in an array that is indexed at run time.
kernel void keep_pairs(global const float* from,  // [items][4][WIDTH]
                       global float* to,          // [items][4][WIDTH]
                       global int* order,         // [items][4]
                       const int turn) {
  const int i = get_global_id(0);
  Pair kept[4];
  for (int k = 0; k < 4; ++k)
    kept[(k + i) & 3] = pair_of(LOADF(from + (4 * i + k) * WIDTH), (float)(k + turn), k);
  for (int k = 0; k < 4; ++k) {
    const Pair pair = kept[(k * turn) & 3];
    STOREF(k % 2 == 0 ? pair.sum : pair.difference, to + (4 * i + k) * WIDTH);
    order[4 * i + k] = pair.from;
  }
}
#endif

#ifdef PROBE_ARGUMENTS
// Every kind of scalar that our kernels take, in an order that needs padding between them.
kernel void read_arguments(global float* result, const int a, const int2 b, const float c,
                           const float16 d, const uint e, const float2 f, const float4 g) {
  if (get_global_id(0) > 0) return;
  result[0] = (float)a;
  result[1] = (float)b.x;
  result[2] = (float)b.y;
  result[3] = c;
  const float part[16] = {d.s0, d.s1, d.s2, d.s3, d.s4, d.s5, d.s6, d.s7,
                          d.s8, d.s9, d.sa, d.sb, d.sc, d.sd, d.se, d.sf};
  for (int k = 0; k < 16; ++k) result[4 + k] = part[k];
  result[20] = (float)e;
  vstore2(f, 0, result + 21);
  vstore4(g, 0, result + 23);
}
#endif

#ifdef PROBE_RECORDS
// Records of records.h, nested and with arrays, between numbers of other sizes: every word of them.
#define COPY_WORDS(record)                                        \
  for (int k = 0; k < (int)(sizeof(record) / sizeof(uint)); ++k) \
    words[at++] = ((const uint*)&(record))[k];
kernel void read_records(global uint* words, const Settling a, const float b, const Projection c,
                         const Chunked d, const float4 e, const FitPass f, const Closing g) {
  if (get_global_id(0) > 0) return;
  int at = 0;
  COPY_WORDS(a)
  COPY_WORDS(b)
  COPY_WORDS(c)
  COPY_WORDS(d)
  COPY_WORDS(e)
  COPY_WORDS(f)
  COPY_WORDS(g)
  // And by the members' names: the last of each.
  words[at++] = (uint)a.only_gaps;
  words[at++] = as_uint(a.screen.rays.dy_v);
  words[at++] = as_uint(c.height);
  words[at++] = as_uint(c.w_row[3]);
  words[at++] = (uint)d.own;
  words[at++] = as_uint(f.height_growth);
  words[at++] = as_uint(f.model.ridge_gain);
  words[at++] = as_uint(g.large_until);
  words[at++] = (uint)g.blocks.stride;
}
#endif

#ifdef PROBE_TICKETS
// Each item draws a number from its counter: all different, none left out.
kernel void take_tickets(global uint* counter, global uint* ticket, const uint mask) {
  const uint i = get_global_id(0);
  ticket[i] = atomic_inc(counter + (i & mask));
}
#endif

#ifdef PROBE_ATOMIC_BOUNDS
kernel void bound_values(global const uint* value, global uint* least, global int* least_signed,
                         global uint* sum, const uint mask) {
  const uint i = get_global_id(0), at = i & mask;
  atomic_min(least + at, value[i]);
  atomic_min(least_signed + at, as_int(value[i]));
  atomic_add(sum + at, value[i]);
}
#endif

#ifdef PROBE_LONG_ATOMICS
#pragma OPENCL EXTENSION cl_khr_int64_extended_atomics : enable
kernel void lower_longs(global const uint* value, global ulong* least, const uint mask) {
  const uint i = get_global_id(0);
  atom_min(least + (i & mask), (ulong)value[i] << 32 | i);
}
#endif

#ifdef PROBE_BARRIERS
// The sums of each group's values up to each item. Items beyond n take part, with nothing.
kernel void sum_up_to(global const int* value, global int* sum, const int n) {
  local int shared[GROUP];
  const int i = get_global_id(0), own = get_local_id(0);
  shared[own] = i < n ? value[i] : 0;
  barrier(CLK_LOCAL_MEM_FENCE);
  for (int step = 1; step < GROUP; step *= 2) {
    const int before = own >= step ? shared[own - step] : 0;
    barrier(CLK_LOCAL_MEM_FENCE);
    shared[own] += before;
    barrier(CLK_LOCAL_MEM_FENCE);
  }
  if (i < n) sum[i] = shared[own];
}
#endif

#ifdef PROBE_LOCAL_MEMORY
// Every group writes all of WORDS local words and reads them in another order.
kernel void turn_local(global uint* sum) {
  local uint word[WORDS];
  const uint own = get_local_id(0), items = get_local_size(0), group = get_group_id(0);
  for (uint k = own; k < WORDS; k += items) word[k] = k * 2654435761u + group;
  barrier(CLK_LOCAL_MEM_FENCE);
  uint total = 0;
  for (uint k = own; k < WORDS; k += items) total = total * 31 + word[WORDS - 1 - k];
  sum[get_global_id(0)] = total;
}
#endif

#ifdef PROBE_IDS
kernel void name_items(global int* names) {  // [items][6], the items row by row
  const int i = get_global_id(0), j = get_global_id(1);
  global int* name = names + 6 * (j * get_global_size(0) + i);
  name[0] = i;
  name[1] = j;
  name[2] = get_group_id(0) + get_num_groups(0) * get_group_id(1);
  name[3] = get_local_id(0) + get_local_size(0) * get_local_id(1);
  name[4] = get_num_groups(0) * get_num_groups(1);
  name[5] = get_local_size(0) * get_local_size(1);
}
#endif

#ifdef PROBE_ORDER
// Every value from its neighbours' values, which the launch before has written.
kernel void mix_neighbours(global const uint* from, global uint* to, const int n) {
  const int i = get_global_id(0);
  if (i >= n) return;
  to[i] = from[(i + n - 1) % n] * 3u + from[(i + 1) % n] + i;
}
#endif

#ifdef PROBE_MACROS
kernel void read_macros(global int* result) {
  if (get_global_id(0) > 0) return;
  result[0] = VALUE;
  result[1] = __LINE__;  // the line that the host looks for
}
#endif
