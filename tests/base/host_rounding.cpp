// Whether the compiler keeps roundings from double to float, with the flags that the library has
// (meniscus_flags). GCC 12.2 with -O2 leaves them out, two at a time, where it makes vectors of
// straight code; bits then depend on what a function was inlined into.
#include <cstdio>
#include <vector>

#include "stages/vec.hpp"

namespace meniscus {
namespace {

[[gnu::noinline]] void keep(std::vector<Vec3d>& kept, const Vec3d& a, const Vec3d& b) {
  const Vec3d apart = a - b;
  const Vec3d rounded = Vec3d(static_cast<Vec3>(apart));
  kept.push_back(rounded);
}

bool is_float(double v) {
  const volatile float rounded = static_cast<float>(v);
  return v == double{rounded};
}

}  // namespace
}  // namespace meniscus

int main() {
  using namespace meniscus;
  std::vector<Vec3d> kept;
  for (int k = 1; k < 100; ++k) keep(kept, {0.1 * k, 0.2 * k, 0.3 * k}, {1. / 3, 1. / 7, 1. / 11});
  for (const Vec3d& v : kept)
    if (!is_float(v.x) || !is_float(v.y) || !is_float(v.z)) {
      std::printf("%a %a %a were rounded to float, and are none\n", v.x, v.y, v.z);
      return 1;
    }
}
