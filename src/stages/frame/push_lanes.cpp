#include "stages/frame/push_lanes.hpp"

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstring>

#include "base/x86.hpp"

namespace meniscus {
namespace {

// Eight values, which compilers put into two registers.
using Lanes = float __attribute__((vector_size(kListLanes * sizeof(float))));
using LaneBits = std::int32_t __attribute__((vector_size(kListLanes * sizeof(float))));

// Puts down where the particles of a group go.
void put(const LaneLists::Group& group, const float* lanes, std::vector<float>& to) {
  std::copy(lanes, lanes + group.count, to.begin() + group.first);
}

void push_lanes(const LaneLists::Block& block, const PairForce& force, int round,
                const Places& from, Places& to) {
  constexpr LaneBits kBits{1, 2, 4, 8, 16, 32, 64, 128};
  const Lanes none{};
  for (std::size_t g = 0; g + 1 < block.groups.size(); ++g) {
    const LaneLists::Group& group = block.groups[g];
    if (group.rounds <= round) continue;
    Lanes at_x, at_y, at_z, to_x{}, to_y{}, to_z{};
    std::memcpy(&at_x, from.x.data() + group.first, sizeof at_x);
    std::memcpy(&at_y, from.y.data() + group.first, sizeof at_y);
    std::memcpy(&at_z, from.z.data() + group.first, sizeof at_z);
    LaneLists::visit(block, g, [&](std::int32_t place, std::uint32_t lanes) {
      const std::size_t j = static_cast<std::size_t>(place);
      const Lanes dx = at_x - from.x[j], dy = at_y - from.y[j], dz = at_z - from.z[j];
      const Lanes squared = dx * dx + dy * dy + dz * dz;
      const LaneBits is_near = (static_cast<std::int32_t>(lanes) & kBits) == kBits;
      const Lanes falls = 1 - squared * force.far;
      const Lanes fades = (Lanes)((LaneBits)falls & is_near & (LaneBits)(falls > none));
      const Lanes fades2 = fades * fades;
      const Lanes push = (1 - squared * force.rest) * (fades2 * fades2);
      to_x += dx * push;
      to_y += dy * push;
      to_z += dz * push;
    });
    to_x = at_x + force.step * to_x;
    to_y = at_y + force.step * to_y;
    to_z = at_z + force.step * to_z;
    std::array<float, kListLanes> lanes;
    const auto put_lanes = [&](const Lanes& values, std::vector<float>& of) {
      std::memcpy(lanes.data(), &values, sizeof lanes);
      put(group, lanes.data(), of);
    };
    put_lanes(to_x, to.x);
    put_lanes(to_y, to.y);
    put_lanes(to_z, to.z);
  }
}

#ifdef MENISCUS_X86
// The same in one register: half the time. No fused instructions, whose bits are others.
__attribute__((target("avx2"))) void push_lanes_avx2(const LaneLists::Block& block,
                                                     const PairForce& force, int round,
                                                     const Places& from, Places& to) {
  static_assert(kListLanes == 8);
  const __m256i bits = _mm256_setr_epi32(1, 2, 4, 8, 16, 32, 64, 128);
  const __m256 none = _mm256_setzero_ps(), one = _mm256_set1_ps(1), far = _mm256_set1_ps(force.far),
               rest = _mm256_set1_ps(force.rest), step = _mm256_set1_ps(force.step);
  const float *const x = from.x.data(), *const y = from.y.data(), *const z = from.z.data();
  for (std::size_t g = 0; g + 1 < block.groups.size(); ++g) {
    const LaneLists::Group& group = block.groups[g];
    if (group.rounds <= round) continue;
    const __m256 at_x = _mm256_loadu_ps(x + group.first), at_y = _mm256_loadu_ps(y + group.first),
                 at_z = _mm256_loadu_ps(z + group.first);
    __m256 to_x = none, to_y = none, to_z = none;
    const LaneLists::Near* near = block.near.data() + group.near;
    for (std::uint32_t r = group.runs; r < block.groups[g + 1].runs; ++r) {
      std::int32_t j = block.runs[r].first;
      for (const LaneLists::Near* const end = near + block.runs[r].count; near < end; ++near) {
        j += near->step;
        const __m256i lanes = _mm256_and_si256(_mm256_set1_epi32(near->lanes), bits);
        const __m256 is_near = _mm256_castsi256_ps(_mm256_cmpeq_epi32(lanes, bits));
        const __m256 dx = _mm256_sub_ps(at_x, _mm256_broadcast_ss(x + j)),
                     dy = _mm256_sub_ps(at_y, _mm256_broadcast_ss(y + j)),
                     dz = _mm256_sub_ps(at_z, _mm256_broadcast_ss(z + j));
        const __m256 squared = _mm256_add_ps(
            _mm256_add_ps(_mm256_mul_ps(dx, dx), _mm256_mul_ps(dy, dy)), _mm256_mul_ps(dz, dz));
        const __m256 falls = _mm256_max_ps(_mm256_sub_ps(one, _mm256_mul_ps(squared, far)), none);
        const __m256 fades = _mm256_and_ps(falls, is_near), fades2 = _mm256_mul_ps(fades, fades);
        const __m256 push = _mm256_mul_ps(_mm256_sub_ps(one, _mm256_mul_ps(squared, rest)),
                                          _mm256_mul_ps(fades2, fades2));
        to_x = _mm256_add_ps(to_x, _mm256_mul_ps(dx, push));
        to_y = _mm256_add_ps(to_y, _mm256_mul_ps(dy, push));
        to_z = _mm256_add_ps(to_z, _mm256_mul_ps(dz, push));
      }
    }
    alignas(32) std::array<float, kListLanes> lanes;
    _mm256_store_ps(lanes.data(), _mm256_add_ps(at_x, _mm256_mul_ps(step, to_x)));
    put(group, lanes.data(), to.x);
    _mm256_store_ps(lanes.data(), _mm256_add_ps(at_y, _mm256_mul_ps(step, to_y)));
    put(group, lanes.data(), to.y);
    _mm256_store_ps(lanes.data(), _mm256_add_ps(at_z, _mm256_mul_ps(step, to_z)));
    put(group, lanes.data(), to.z);
  }
}
#endif

}  // namespace

std::vector<PushLanes*> lane_pushers() {
#ifdef MENISCUS_X86
  if (__builtin_cpu_supports("avx2")) return {push_lanes_avx2, push_lanes};
#endif
  return {push_lanes};
}

}  // namespace meniscus
