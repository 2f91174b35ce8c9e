#include <cmath>
#include <cstring>

#include "kernels/native/native.hpp"

namespace meniscus::bench::native {
namespace {

float smaller(float a, float b) { return a < b ? a : b; }
float larger(float a, float b) { return a > b ? a : b; }
float clamped(float x) { return smaller(larger(x, -1.0f), 1e6f); }

// Read before the exchange: most samples are met by one triangle only.
void lower(std::uint32_t* word, std::uint32_t bits) {
  std::uint32_t now = __atomic_load_n(word, __ATOMIC_RELAXED);
  while (bits < now &&
         !__atomic_compare_exchange_n(word, &now, bits, true, __ATOMIC_RELAXED, __ATOMIC_RELAXED)) {
  }
}

}  // namespace

void draw_triangles(const Triangles& input, std::size_t begin, std::size_t end) {
  const float first = input.first, step = input.step;
  for (std::size_t k = begin; k < end; ++k) {
    float u[3], v[3], t[3];
    for (int c = 0; c < 3; ++c) {
      const float* const row = input.corners + 3 * static_cast<std::size_t>(c) * input.stride + k;
      u[c] = row[0];
      v[c] = row[input.stride];
      t[c] = input.perspective ? 1.0f / row[2 * input.stride] : row[2 * input.stride];
    }
    const float doubled = (u[1] - u[0]) * (v[2] - v[0]) - (u[2] - u[0]) * (v[1] - v[0]);
    if (std::fabs(doubled) < 1e-9f) continue;
    const float inverse = 1.0f / doubled;
    const float u0 = smaller(u[0], smaller(u[1], u[2])), u1 = larger(u[0], larger(u[1], u[2]));
    const float v0 = smaller(v[0], smaller(v[1], v[2])), v1 = larger(v[0], larger(v[1], v[2]));
    const int low_i = static_cast<int>(std::ceil(clamped((u0 - first) / step)));
    const int high_i = static_cast<int>(std::floor(clamped((u1 - first) / step)));
    const int low_j = static_cast<int>(std::ceil(clamped((v0 - first) / step)));
    const int high_j = static_cast<int>(std::floor(clamped((v1 - first) / step)));
    const int i0 = low_i > 0 ? low_i : 0, i1 = high_i < input.nx ? high_i : input.nx - 1;
    const int j0 = low_j > 0 ? low_j : 0, j1 = high_j < input.ny ? high_j : input.ny - 1;
    for (int j = j0; j <= j1; ++j) {
      const float y = first + step * static_cast<float>(j);
      std::uint32_t* const row =
          input.depth + static_cast<std::size_t>(j) * static_cast<std::size_t>(input.nx);
      for (int i = i0; i <= i1; ++i) {
        const float x = first + step * static_cast<float>(i);
        const float l1 = ((x - u[0]) * (v[2] - v[0]) - (u[2] - u[0]) * (y - v[0])) * inverse;
        const float l2 = ((u[1] - u[0]) * (y - v[0]) - (x - u[0]) * (v[1] - v[0])) * inverse;
        const float l0 = 1.0f - l1 - l2;
        if ((l0 < -1e-5f) | (l1 < -1e-5f) | (l2 < -1e-5f)) continue;
        float d = l0 * t[0] + l1 * t[1] + l2 * t[2];
        if (input.perspective) d = 1.0f / d;
        if (!(d > 0.0f)) continue;
        std::uint32_t bits;
        std::memcpy(&bits, &d, sizeof bits);
        lower(row + i, bits);
      }
    }
  }
}

}  // namespace meniscus::bench::native
