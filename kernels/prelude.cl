// prelude.cl: goes before every kernel file. WIDTH is how many pixels or groups a work-item of a
// loop-heavy kernel takes: 8 on CPUs, 1 on GPUs. Each lane does the same arithmetic in the same
// order, so that every width gives the same bits.
#pragma OPENCL FP_CONTRACT OFF

#ifndef WIDTH
#define WIDTH 1
#endif

#define JOIN_(a, b) a##b
#define JOIN(a, b) JOIN_(a, b)

#if WIDTH == 1
typedef float floatv;
typedef int intv;
#define LOADF(p) (*(p))
#define STOREF(v, p) (*(p) = (v))
#define LOADI(p) (*(p))
#define STOREI(v, p) (*(p) = (v))
#define LANES ((floatv)(0.0f))
#define SELECT(no, yes, test) ((test) ? (yes) : (no))
#define ANY(test) (test)
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
#define LANES ((floatv)(0.0f, 1.0f, 2.0f, 3.0f, 4.0f, 5.0f, 6.0f, 7.0f))
#define SELECT(no, yes, test) select((no), (yes), (test))
#define ANY(test) any(test)
#define TO_FLOATV(x) JOIN(convert_float, WIDTH)(x)
#define AS_INTV(x) JOIN(as_int, WIDTH)(x)
#define AS_FLOATV(x) JOIN(as_float, WIDTH)(x)
#define TO_INTV(x) JOIN(convert_int, WIDTH)(x)
#endif

// exp(x) for x <= 0, the same bits on every device: 2^(x/ln 2) split into an integer part, set as
// the exponent's bits, and a polynomial on [-1/2, 1/2]; relative error 2e-7. Below -87: zero.
inline floatv exp_negative(const floatv x) {
  const floatv y = fmax(x, (floatv)(-87.0f)) * 1.44269504f;
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

// smoothstep with the division written out; low < high.
inline floatv smooth_step(const float low, const float high, const floatv x) {
  const floatv t = fmin(fmax((x - low) * (1.0f / (high - low)), (floatv)(0.0f)), (floatv)(1.0f));
  return t * t * (3.0f - 2.0f * t);
}

// The ray of pixel (u, v): eye point (o + t d, -t) at depth t, affine in the pixel coordinates.
typedef struct {
  float ox, oy, dx, dy;
} Ray;

inline Ray ray_at(const float16 ray, const float u, const float v) {
  Ray r;
  r.ox = ray.s0 + ray.s1 * u + ray.s2 * v;
  r.oy = ray.s3 + ray.s4 * u + ray.s5 * v;
  r.dx = ray.s6 + ray.s7 * u + ray.s8 * v;
  r.dy = ray.s9 + ray.sa * u + ray.sb * v;
  return r;
}
