// Eight floats side by side, as the compiler's own vector type: what explicit vectors are on the
// device; and sixteen in files that ask for MENISCUS_WIDE, where the processor's own vectors have
// them. Everything has internal linkage.
#pragma once

#include <cmath>
#include <cstdint>
#include <cstring>
#include <utility>
#ifdef __AVX__
#include <immintrin.h>
#endif

namespace meniscus::bench::native {
namespace {

#if defined(MENISCUS_WIDE) && defined(__AVX512F__)
constexpr int kWidth = 16;
typedef float Floats __attribute__((vector_size(64)));
typedef std::int32_t Ints __attribute__((vector_size(64)));
constexpr Ints kPlaces = {0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12, 13, 14, 15};
#else
constexpr int kWidth = 8;
typedef float Floats __attribute__((vector_size(32)));
typedef std::int32_t Ints __attribute__((vector_size(32)));
constexpr Ints kPlaces = {0, 1, 2, 3, 4, 5, 6, 7};
#endif

inline Floats all(float x) { return Floats{} + x; }
inline Floats load(const float* p) {
  Floats v;
  std::memcpy(&v, p, sizeof v);
  return v;
}
inline Ints load(const std::int32_t* p) {
  Ints v;
  std::memcpy(&v, p, sizeof v);
  return v;
}
inline void store(const Floats& v, float* p) { std::memcpy(p, &v, sizeof v); }
/// Whether a lane of a comparison holds.
inline bool any(const Ints& test) {
#if defined(MENISCUS_WIDE) && defined(__AVX512F__)
  return _mm512_test_epi32_mask(reinterpret_cast<__m512i>(test), reinterpret_cast<__m512i>(test)) !=
         0;
#elif defined(__AVX__)
  return _mm256_movemask_ps(_mm256_castsi256_ps(reinterpret_cast<__m256i>(test))) != 0;
#endif
  int found = 0;
  for (int k = 0; k < kWidth; ++k) found |= test[k];
  return found != 0;
}
/// The lanes in which a comparison holds, lane k as bit k.
inline unsigned bits_of(const Ints& test) {
#if defined(MENISCUS_WIDE) && defined(__AVX512F__)
  return _mm512_test_epi32_mask(reinterpret_cast<__m512i>(test), reinterpret_cast<__m512i>(test));
#elif defined(__AVX__)
  return static_cast<unsigned>(
      _mm256_movemask_ps(_mm256_castsi256_ps(reinterpret_cast<__m256i>(test))));
#endif
  unsigned bits = 0;
  for (int k = 0; k < kWidth; ++k) bits |= test[k] ? 1u << k : 0u;
  return bits;
}
inline Floats magnitude(const Floats& a) {
  Ints bits;
  std::memcpy(&bits, &a, sizeof bits);
  bits &= 0x7fffffff;
  Floats r;
  std::memcpy(&r, &bits, sizeof r);
  return r;
}
inline Floats smaller(const Floats& a, const Floats& b) { return a < b ? a : b; }
inline Floats larger(const Floats& a, const Floats& b) { return a > b ? a : b; }
inline float most_lane(const Floats& a) {
  float most = a[0];
  for (int k = 1; k < kWidth; ++k) most = most > a[k] ? most : a[k];
  return most;
}
inline float sum_of(const Floats& a) {
  float sum = a[0];
  for (int k = 1; k < kWidth; ++k) sum += a[k];
  return sum;
}
/// Stores the lanes that are set in `bits` one after the other, and anything in the rest of kWidth.
template <class Vector, class T>
inline void pack(unsigned bits, const Vector& v, T* to) {
#if defined(MENISCUS_WIDE) && defined(__AVX512F__)
  const __m512i packed =
      _mm512_maskz_compress_epi32(static_cast<__mmask16>(bits), reinterpret_cast<__m512i>(v));
  std::memcpy(to, &packed, sizeof packed);
  return;
#elif defined(__AVX512VL__)
  const __m256i packed =
      _mm256_maskz_compress_epi32(static_cast<__mmask8>(bits), reinterpret_cast<__m256i>(v));
  std::memcpy(to, &packed, sizeof packed);
  return;
#endif
  for (int k = 0; k < kWidth; ++k) {
    *to = v[k];
    to += bits >> k & 1;
  }
}
inline Floats root(const Floats& a) {
  Floats r{};
  for (int k = 0; k < kWidth; ++k) r[k] = __builtin_sqrtf(a[k]);
  return r;
}
inline Floats fused(const Floats& a, const Floats& b, const Floats& c) {
#if defined(MENISCUS_WIDE) && defined(__AVX512F__)
  return _mm512_fmadd_ps(a, b, c);
#elif defined(__FMA__)
  return _mm256_fmadd_ps(a, b, c);  // the loop below becomes eight scalar ones
#endif
  Floats r;
  for (int k = 0; k < kWidth; ++k) r[k] = __builtin_fmaf(a[k], b[k], c[k]);
  return r;
}

/// Calls step(k) for k = Begin .. End - 1, each a constant: a loop that is unrolled before the
/// compiler decides what to keep in registers.
template <int Begin, class Step, int... K>
[[gnu::always_inline]] inline void unrolled_from([[maybe_unused]] Step step,
                                                 std::integer_sequence<int, K...>) {
  (step(std::integral_constant<int, Begin + K>{}), ...);
}
template <int Begin, int End, class Step>
[[gnu::always_inline]] inline void unrolled(Step step) {
  unrolled_from<Begin>(step, std::make_integer_sequence<int, (End > Begin ? End - Begin : 0)>{});
}
#define MENISCUS_STEP(k) [&](auto k) __attribute__((always_inline))

// exp_negative of prelude.cl.
inline Floats exp_negative(const Floats& x) {
  const Floats y = larger(x, all(-87.0f)) * 1.44269504f;
  const Ints whole = __builtin_convertvector(y - 0.5f, Ints);
  const Floats f = (y - __builtin_convertvector(whole, Floats)) * 0.693147181f;
  Floats p = all(1.0f / 5040.0f);
  constexpr float kSeries[] = {1.0f / 720.0f, 1.0f / 120.0f, 1.0f / 24.0f, 1.0f / 6.0f,
                               0.5f,          1.0f,          1.0f};
  for (const float c : kSeries) p = fused(p, f, all(c));
  const Ints bits = (whole + 127) << 23;
  Floats power;
  std::memcpy(&power, &bits, sizeof power);
  return x < -87.0f ? Floats{} : p * power;
}

}  // namespace
}  // namespace meniscus::bench::native
