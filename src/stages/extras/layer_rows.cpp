#include "stages/extras/layer_rows.hpp"

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstdlib>
#include <limits>

#include "base/x86.hpp"
#include "stages/stage_data.hpp"

namespace meniscus {
namespace {

using Sides = std::array<std::int64_t, 3>;

void step(Sides& sides, const Sides& by) {
  for (std::size_t k = 0; k < 3; ++k) sides[k] += by[k];
}

bool is_inside(const Sides& within) { return (within[0] | within[1] | within[2]) >= 0; }

// A number at a pixel of a face.
float number_at(const FaceRows& face, FaceNumber n, int k, int j) {
  return (face.at[n] + static_cast<float>(k) * face.by_column[n]) +
         static_cast<float>(j) * face.by_row[n];
}

// Comparisons as those of max and min in registers, of numbers that may be none.
float depth_at(const FaceRows& face, int k, int j) {
  const float depth = face.depth + number_at(face, kAbove, k, j) / number_at(face, kBelow, k, j);
  const float behind = depth > face.least ? depth : face.least;
  return behind < face.most ? behind : face.most;
}

void add_other(BandCrossings& band, std::size_t pixel, float depth, bool enters) {
  band.other_pixel[band.others] = static_cast<std::uint32_t>(2 * pixel) + (enters ? 1 : 0);
  band.other_depth[band.others++] = depth;
}

void draw_face(const FaceRows& face, const float* front, int width, BandCrossings& band) {
  Sides left = face.within;
  for (int j = 0; j < face.rows; ++j, step(left, face.down)) {
    // Most faces are few pixels wide.
    Sides within = left;
    int k = 0;
    for (; k < face.columns && !is_inside(within); ++k) step(within, face.to_right);
    const std::size_t row = static_cast<std::size_t>(face.row + j),
                      column = static_cast<std::size_t>(face.column),
                      first = row * band.stride + column;
    const float* const shown = front + row * static_cast<std::size_t>(width) + column;
    for (; k < face.columns && is_inside(within); ++k, step(within, face.to_right)) {
      const float depth = depth_at(face, k, j);
      if (!(depth > shown[k] + face.nearest)) continue;
      const std::size_t pixel = first + static_cast<std::size_t>(k);
      if (face.enters) {
        add_other(band, pixel, depth, true);
        continue;
      }
      const bool is_first = band.exit[pixel] == kNoSurface;
      const std::size_t at = is_first ? pixel : band.others;
      std::array<std::vector<float>, 3>& normals = is_first ? band.normal : band.other_normal;
      for (std::size_t axis = 0; axis < 3; ++axis)
        normals[axis][at] = number_at(face, static_cast<FaceNumber>(kNormalX + axis), k, j);
      if (is_first)
        band.exit[pixel] = depth;
      else
        add_other(band, pixel, depth, false);
    }
  }
}

std::uint32_t fill_once(const View& view, const RowPart& part, const BandCrossings& band,
                        const std::uint32_t* others, Layers& layers) {
  std::uint32_t rest = 0;
  for (int k = 0; k < part.count; ++k) {
    const std::size_t pixel = part.pixel + static_cast<std::size_t>(k),
                      in_band = part.in_band + static_cast<std::size_t>(k);
    const float exit = band.exit[in_band];
    layers.exit[pixel] = exit;
    if (exit == kNoSurface || others[in_band] != kNoOther) {
      rest |= std::uint32_t{1} << k;
      continue;
    }
    const double stretch = length(ray_direction(view, part.column + k + 0.5, part.row + 0.5));
    layers.thickness[pixel] =
        static_cast<float>((double{exit} - double{layers.entry[pixel]}) * stretch);
    layers.count[pixel] = 1;
    const float x = band.normal[0][in_band], y = band.normal[1][in_band],
                z = band.normal[2][in_band];
    const float size = 1 / std::sqrt(x * x + y * y + z * z);
    layers.back_normal[pixel] = {x * size, y * size, z * size};
  }
  return rest;
}

#ifdef MENISCUS_X86
// Whether what its pixels are computed from fits in 32 bits.
bool is_small(const FaceRows& face) {
  bool fits = true;
  for (std::size_t s = 0; s < 3; ++s)
    fits &= std::abs(face.within[s]) + face.columns * std::abs(face.to_right[s]) +
                face.rows * std::abs(face.down[s]) <=
            std::numeric_limits<std::int32_t>::max();
  return fits;
}

// Sixteen pixels at a time, without jumps, which would be mispredicted in each row. What others
// there are moves together in registers, which are stored whole.
__attribute__((target("avx512f"))) void draw_face_avx512(const FaceRows& face, const float* front,
                                                         int width, BandCrossings& band) {
  if (!is_small(face)) return draw_face(face, front, width, band);
  constexpr int kLanes = 16;
  const __m512 none = _mm512_set1_ps(kNoSurface), nearest = _mm512_set1_ps(face.nearest),
               corner = _mm512_set1_ps(face.depth), least = _mm512_set1_ps(face.least),
               most = _mm512_set1_ps(face.most);
  const __m512i lanes = _mm512_setr_epi32(0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12, 13, 14, 15);
  for (int begin = 0; begin < face.columns; begin += kLanes) {
    const auto there = static_cast<__mmask16>((1u << std::min(face.columns - begin, kLanes)) - 1);
    const __m512i column = _mm512_add_epi32(lanes, _mm512_set1_epi32(begin));
    const __m512 k = _mm512_maskz_cvtepi32_ps(0xffff, column);
    __m512i within[3], down[3];
    for (std::size_t s = 0; s < 3; ++s) {
      const auto at = static_cast<int>(face.within[s]),
                 to_right = static_cast<int>(face.to_right[s]);
      within[s] = _mm512_add_epi32(_mm512_set1_epi32(at),
                                   _mm512_mullo_epi32(column, _mm512_set1_epi32(to_right)));
      down[s] = _mm512_set1_epi32(static_cast<int>(face.down[s]));
    }
    __m512 first[kFaceNumbers], by_row[kFaceNumbers];
    for (std::size_t n = 0; n < kFaceNumbers; ++n) {
      first[n] = _mm512_add_ps(_mm512_set1_ps(face.at[n]),
                               _mm512_mul_ps(k, _mm512_set1_ps(face.by_column[n])));
      by_row[n] = _mm512_set1_ps(face.by_row[n]);
    }
    std::size_t pixel = static_cast<std::size_t>(face.row) * band.stride +
                        static_cast<std::size_t>(face.column + begin);
    const float* shown = front +
                         static_cast<std::size_t>(face.row) * static_cast<std::size_t>(width) +
                         static_cast<std::size_t>(face.column + begin);
    for (int j = 0; j < face.rows; ++j, pixel += band.stride, shown += width) {
      const __mmask16 inside = _mm512_mask_cmpge_epi32_mask(
          there, _mm512_or_epi32(_mm512_or_epi32(within[0], within[1]), within[2]),
          _mm512_setzero_si512());
      for (std::size_t s = 0; s < 3; ++s) within[s] = _mm512_add_epi32(within[s], down[s]);
      const __m512 row = _mm512_set1_ps(static_cast<float>(j));
      const auto number = [&](std::size_t n) __attribute__((target("avx512f"))) {
        return _mm512_add_ps(first[n], _mm512_mul_ps(row, by_row[n]));
      };
      __m512 depth = _mm512_add_ps(corner, _mm512_div_ps(number(kAbove), number(kBelow)));
      depth = _mm512_maskz_min_ps(0xffff, _mm512_maskz_max_ps(0xffff, depth, least), most);
      const __m512 behind = _mm512_add_ps(_mm512_maskz_loadu_ps(inside, shown), nearest);
      const __mmask16 drawn = _mm512_mask_cmp_ps_mask(inside, depth, behind, _CMP_GT_OQ);
      __mmask16 rest = drawn;
      __m512 x = none, y = none, z = none;
      if (!face.enters) {
        const __mmask16 is_first = _mm512_mask_cmp_ps_mask(
            drawn, _mm512_maskz_loadu_ps(drawn, &band.exit[pixel]), none, _CMP_EQ_OQ);
        x = number(kNormalX);
        y = number(kNormalY);
        z = number(kNormalZ);
        _mm512_mask_storeu_ps(&band.exit[pixel], is_first, depth);
        _mm512_mask_storeu_ps(&band.normal[0][pixel], is_first, x);
        _mm512_mask_storeu_ps(&band.normal[1][pixel], is_first, y);
        _mm512_mask_storeu_ps(&band.normal[2][pixel], is_first, z);
        rest = static_cast<__mmask16>(drawn & ~is_first);
      }
      if (rest == 0) continue;
      const __m512i places =
          _mm512_add_epi32(_mm512_set1_epi32(static_cast<int>(2 * pixel) + (face.enters ? 1 : 0)),
                           _mm512_add_epi32(lanes, lanes));
      const std::size_t to = band.others;
      _mm512_storeu_si512(&band.other_pixel[to], _mm512_maskz_compress_epi32(rest, places));
      _mm512_storeu_ps(&band.other_depth[to], _mm512_maskz_compress_ps(rest, depth));
      if (!face.enters) {
        _mm512_storeu_ps(&band.other_normal[0][to], _mm512_maskz_compress_ps(rest, x));
        _mm512_storeu_ps(&band.other_normal[1][to], _mm512_maskz_compress_ps(rest, y));
        _mm512_storeu_ps(&band.other_normal[2][to], _mm512_maskz_compress_ps(rest, z));
      }
      band.others += static_cast<std::size_t>(std::popcount(static_cast<unsigned>(rest)));
    }
  }
}

// The lower (0) or upper (1) eight of sixteen.
template <int half>
__attribute__((target("avx512f"))) __m512d half_of(__m512 values) {
  return _mm512_maskz_cvtps_pd(
      0xff, _mm256_castpd_ps(_mm512_maskz_extractf64x4_pd(0xf, _mm512_castps_pd(values), half)));
}

// How long the ways along the rays of eight pixels of a row are between two depths.
__attribute__((target("avx512f"))) __m512 ways_of(const View& view, int column, int row,
                                                  __m512d from, __m512d to) {
  const std::array<double, 12>& r = view.ray;
  const __m512d u =
      _mm512_add_pd(_mm512_setr_pd(0, 1, 2, 3, 4, 5, 6, 7), _mm512_set1_pd(column + 0.5));
  const double v = row + 0.5;
  const __m512d x = _mm512_add_pd(
                    _mm512_add_pd(_mm512_set1_pd(r[6]), _mm512_mul_pd(_mm512_set1_pd(r[7]), u)),
                    _mm512_set1_pd(r[8] * v)),
                y = _mm512_add_pd(
                    _mm512_add_pd(_mm512_set1_pd(r[9]), _mm512_mul_pd(_mm512_set1_pd(r[10]), u)),
                    _mm512_set1_pd(r[11] * v));
  const __m512d squared =
      _mm512_add_pd(_mm512_add_pd(_mm512_mul_pd(x, x), _mm512_mul_pd(y, y)), _mm512_set1_pd(1));
  const __m512d ways = _mm512_mul_pd(_mm512_sub_pd(to, from), _mm512_maskz_sqrt_pd(0xff, squared));
  return _mm512_castps256_ps512(_mm512_maskz_cvtpd_ps(0xff, ways));
}

__attribute__((target("avx512f"))) std::uint32_t fill_once_avx512(const View& view,
                                                                  const RowPart& part,
                                                                  const BandCrossings& band,
                                                                  const std::uint32_t* others,
                                                                  Layers& layers) {
  // x, y and z of 16 vectors, in their order: from x and y, then from those and z.
  static constexpr auto kInterleave = [] {
    std::array<std::array<std::array<std::int32_t, 16>, 2>, 3> all{};
    for (int k = 0; k < 48; ++k) {
      const int of = k / 3, axis = k % 3;
      auto& [both, then] = all[static_cast<std::size_t>(k / 16)];
      both[static_cast<std::size_t>(k % 16)] = axis == 1 ? 16 + of : of;
      then[static_cast<std::size_t>(k % 16)] = axis == 2 ? 16 + of : k % 16;
    }
    return all;
  }();
  std::uint32_t rest = 0;
  for (int k = 0; k < part.count; k += 16) {
    const int n = std::min(part.count - k, 16);
    const auto there = static_cast<__mmask16>((1u << n) - 1);
    const std::size_t pixel = part.pixel + static_cast<std::size_t>(k),
                      in_band = part.in_band + static_cast<std::size_t>(k);
    const __m512 exit = _mm512_maskz_loadu_ps(there, &band.exit[in_band]),
                 from = _mm512_maskz_loadu_ps(there, &layers.entry[pixel]);
    const __mmask16 leaves =
        _mm512_mask_cmp_ps_mask(there, exit, _mm512_set1_ps(kNoSurface), _CMP_LT_OQ);
    const __mmask16 once =
        _mm512_mask_cmpeq_epi32_mask(leaves, _mm512_maskz_loadu_epi32(there, others + in_band),
                                     _mm512_set1_epi32(static_cast<int>(kNoOther)));
    rest |= static_cast<std::uint32_t>(there & ~once) << k;
    const __m512 x = _mm512_maskz_loadu_ps(once, &band.normal[0][in_band]),
                 y = _mm512_maskz_loadu_ps(once, &band.normal[1][in_band]),
                 z = _mm512_maskz_loadu_ps(once, &band.normal[2][in_band]);
    const __m512 squared =
        _mm512_add_ps(_mm512_add_ps(_mm512_mul_ps(x, x), _mm512_mul_ps(y, y)), _mm512_mul_ps(z, z));
    const __m512 size =
        _mm512_maskz_div_ps(once, _mm512_set1_ps(1), _mm512_maskz_sqrt_ps(once, squared));
    const __m512 unit_x = _mm512_mul_ps(x, size), unit_y = _mm512_mul_ps(y, size),
                 unit_z = _mm512_mul_ps(z, size);
    const __m512 low = ways_of(view, part.column + k, part.row, half_of<0>(from), half_of<0>(exit)),
                 high = ways_of(view, part.column + k + 8, part.row, half_of<1>(from),
                                half_of<1>(exit));
    const __m512 way = _mm512_maskz_shuffle_f32x4(0xffff, low, high, 0b01000100);
    _mm512_mask_storeu_ps(&layers.exit[pixel], there, exit);
    _mm512_mask_storeu_ps(&layers.thickness[pixel], there, _mm512_maskz_mov_ps(once, way));
    _mm512_mask_storeu_epi32(&layers.count[pixel], there, _mm512_maskz_set1_epi32(once, 1));
    for (int third = 0; third < 3; ++third) {
      const auto& [both, then] = kInterleave[static_cast<std::size_t>(third)];
      const __m512 xy = _mm512_permutex2var_ps(unit_x, _mm512_loadu_si512(both.data()), unit_y),
                   xyz = _mm512_permutex2var_ps(xy, _mm512_loadu_si512(then.data()), unit_z);
      const int left = std::clamp(3 * n - 16 * third, 0, 16);
      _mm512_mask_storeu_ps(&layers.back_normal[pixel].x + 16 * third,
                            static_cast<__mmask16>((1u << left) - 1), xyz);
    }
  }
  return rest;
}
#endif

}  // namespace

BandCrossings::BandCrossings(int rows, int width)
    : stride(static_cast<std::size_t>(width) + kSpare) {
  const std::size_t size = static_cast<std::size_t>(rows) * stride;
  exit.resize(size, kNoSurface);
  for (std::vector<float>& axis : normal) axis.resize(size);
}

void BandCrossings::make_room(std::size_t more) {
  const std::size_t needed = others + more + kSpare;
  if (other_pixel.size() >= needed) return;
  other_pixel.resize(2 * needed);
  other_depth.resize(2 * needed);
  for (std::vector<float>& axis : other_normal) axis.resize(2 * needed);
}

std::vector<LayerLoops> layer_loops() {
  const LayerLoops plain{draw_face, fill_once};
#ifdef MENISCUS_X86
  if (__builtin_cpu_supports("avx512f")) return {{draw_face_avx512, fill_once_avx512}, plain};
#endif
  return {plain};
}

}  // namespace meniscus
