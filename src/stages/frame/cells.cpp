#include "stages/frame/cells.hpp"

#include <bit>

#include "base/parallel.hpp"
#include "base/x86.hpp"

namespace meniscus {
namespace {

std::size_t find_near(const Cells& cells, std::int32_t first, std::int32_t last, std::uint32_t tag,
                      const std::array<float, 3>& at, float squared_reach, std::int32_t* found) {
  constexpr std::int32_t kAtOnce = 64;
  std::array<std::int32_t, kAtOnce> near;  // 1 for those that are
  std::size_t count = 0;
  for (; first < last; first += kAtOnce) {
    const std::int32_t number = std::min(kAtOnce, last - first);
    // A loop that becomes vectors, and one without branches, which would be mispredicted.
    for (std::int32_t k = 0; k < number; ++k) {
      const std::int32_t p = first + k;
      const float dx = cells.x[p] - at[0], dy = cells.y[p] - at[1], dz = cells.z[p] - at[2];
      near[k] = (dx * dx + dy * dy + dz * dz < squared_reach) & same_row(cells.tag[p], tag);
    }
    for (std::int32_t k = 0; k < number; ++k) {
      found[count] = cells.item[first + k];
      count += static_cast<std::size_t>(near[k]);
    }
  }
  return count;
}

void near_before(const Cells& cells, std::int32_t begin, std::int32_t end, float squared_reach,
                 std::uint16_t* near) {
  for (std::int32_t p = begin; p < end; ++p) {
    std::uint32_t bits = 0;
    for (std::int32_t q = std::max(p - kBefore, begin); q < p; ++q) {
      const float dx = cells.x[q] - cells.x[p], dy = cells.y[q] - cells.y[p],
                  dz = cells.z[q] - cells.z[p];
      bits |= static_cast<std::uint32_t>(dx * dx + dy * dy + dz * dz < squared_reach)
              << (kBefore - (p - q));
    }
    near[p - begin] = static_cast<std::uint16_t>(bits);
  }
}

#ifdef MENISCUS_X86
// Sixteen at a time: less than half the time. What is near moves together in a register, which is
// stored whole.
__attribute__((target("avx512f"))) std::size_t find_near_avx512(
    const Cells& cells, std::int32_t first, std::int32_t last, std::uint32_t tag,
    const std::array<float, 3>& at, float squared_reach, std::int32_t* found) {
  const __m512 x = _mm512_set1_ps(at[0]), y = _mm512_set1_ps(at[1]), z = _mm512_set1_ps(at[2]),
               most = _mm512_set1_ps(squared_reach);
  const __m512i row = _mm512_set1_epi32(static_cast<int>(tag)),
                of_row = _mm512_set1_epi32(~2047);  // see same_row
  std::size_t count = 0;
  for (std::int32_t p = first; p < last; p += 16) {
    const __mmask16 there = static_cast<__mmask16>(last - p < 16 ? (1 << (last - p)) - 1 : 0xffff);
    const __m512 dx = _mm512_sub_ps(_mm512_maskz_loadu_ps(there, cells.x.data() + p), x),
                 dy = _mm512_sub_ps(_mm512_maskz_loadu_ps(there, cells.y.data() + p), y),
                 dz = _mm512_sub_ps(_mm512_maskz_loadu_ps(there, cells.z.data() + p), z);
    const __m512 squared = _mm512_add_ps(
        _mm512_add_ps(_mm512_mul_ps(dx, dx), _mm512_mul_ps(dy, dy)), _mm512_mul_ps(dz, dz));
    const __mmask16 inside = _mm512_mask_cmp_ps_mask(there, squared, most, _CMP_LT_OQ);
    const __m512i tags = _mm512_maskz_loadu_epi32(inside, cells.tag.data() + p);
    const __mmask16 near =
        _mm512_mask_testn_epi32_mask(inside, _mm512_xor_si512(tags, row), of_row);
    _mm512_storeu_si512(
        found + count,
        _mm512_maskz_compress_epi32(near, _mm512_maskz_loadu_epi32(near, cells.item.data() + p)));
    count += static_cast<std::size_t>(std::popcount(static_cast<unsigned>(near)));
  }
  return count;
}

__attribute__((target("avx512f"))) void near_before_avx512(const Cells& cells, std::int32_t begin,
                                                           std::int32_t end, float squared_reach,
                                                           std::uint16_t* near) {
  static_assert(kBefore == 16);
  // There are not as many before the first ones of all.
  const std::int32_t rest = std::min(end, std::max(begin, kBefore));
  near_before(cells, begin, rest, squared_reach, near);
  const float *const x = cells.x.data(), *const y = cells.y.data(), *const z = cells.z.data();
  const __m512 most = _mm512_set1_ps(squared_reach);
  for (std::int32_t p = rest; p < end; ++p) {
    const __mmask16 there =
        static_cast<__mmask16>(p - begin < kBefore ? 0xffff << (kBefore - (p - begin)) : 0xffff);
    const std::int32_t first = p - kBefore;
    const __m512 dx = _mm512_sub_ps(_mm512_maskz_loadu_ps(there, x + first), _mm512_set1_ps(x[p])),
                 dy = _mm512_sub_ps(_mm512_maskz_loadu_ps(there, y + first), _mm512_set1_ps(y[p])),
                 dz = _mm512_sub_ps(_mm512_maskz_loadu_ps(there, z + first), _mm512_set1_ps(z[p]));
    const __m512 squared = _mm512_add_ps(
        _mm512_add_ps(_mm512_mul_ps(dx, dx), _mm512_mul_ps(dy, dy)), _mm512_mul_ps(dz, dz));
    near[p - begin] = _mm512_mask_cmp_ps_mask(there, squared, most, _CMP_LT_OQ);
  }
}
#endif

}  // namespace

std::vector<NearFinder*> near_finders() {
#ifdef MENISCUS_X86
  if (__builtin_cpu_supports("avx512f")) return {find_near_avx512, find_near};
#endif
  return {find_near};
}

std::vector<NearBefore*> before_finders() {
#ifdef MENISCUS_X86
  if (__builtin_cpu_supports("avx512f")) return {near_before_avx512, near_before};
#endif
  return {near_before};
}

Cells make_cells(const std::vector<float>& x, const std::vector<float>& y,
                 const std::vector<float>& z, float cell) {
  Cells cells;
  cells.inverse_cell = 1.0f / cell;
  const std::size_t n = x.size();
  const std::uint32_t buckets =
      std::max(std::bit_ceil(static_cast<std::uint32_t>(n / 2 + 1)), kFewestBuckets);
  cells.mask = buckets - 1;
  constexpr std::size_t kGrain = 4096;  // points that are worth a thread
  std::vector<std::uint32_t> bucket(n), tag(n);
  parallel_for(n, kGrain, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) {
      const std::int32_t cx = cell_of(x[i], cells.inverse_cell),
                         cy = cell_of(y[i], cells.inverse_cell),
                         cz = cell_of(z[i], cells.inverse_cell);
      bucket[i] = bucket_of(cx, cy, cz, cells.mask);
      tag[i] = tag_of(cx, cy, cz);
    }
  });
  // Where bucket b begins stands at b + 1, until the points that go there have moved it to b's end.
  cells.start.assign(buckets + 2, 0);
  for (const std::uint32_t b : bucket) ++cells.start[b + 2];
  for (std::size_t b = 0; b < buckets; ++b) cells.start[b + 2] += cells.start[b + 1];
  cells.item.resize(n);
  for (std::size_t i = 0; i < n; ++i)
    cells.item[static_cast<std::size_t>(cells.start[bucket[i] + 1]++)] =
        static_cast<std::int32_t>(i);
  cells.start.pop_back();
  cells.x.resize(n);
  cells.y.resize(n);
  cells.z.resize(n);
  cells.tag.resize(n);
  parallel_for(n, kGrain, [&](std::size_t begin, std::size_t end) {
    for (std::size_t p = begin; p < end; ++p) {
      const std::size_t i = static_cast<std::size_t>(cells.item[p]);
      cells.x[p] = x[i];
      cells.y[p] = y[i];
      cells.z[p] = z[i];
      cells.tag[p] = tag[i];
    }
  });
  return cells;
}

std::vector<float> by_item(const Cells& cells, const float* in_buckets) {
  std::vector<float> values(cells.item.size());
  for (std::size_t p = 0; p < values.size(); ++p)
    values[static_cast<std::size_t>(cells.item[p])] = in_buckets[p];
  return values;
}

Cells make_cells(const std::vector<Vec3d>& points, float cell) {
  const std::size_t n = points.size();
  std::vector<float> x(n), y(n), z(n);
  for (std::size_t k = 0; k < n; ++k) {
    x[k] = static_cast<float>(points[k].x);
    y[k] = static_cast<float>(points[k].y);
    z[k] = static_cast<float>(points[k].z);
  }
  return make_cells(x, y, z, cell);
}

}  // namespace meniscus
