#include "kernels/native/native.hpp"

namespace meniscus::bench::native {

bool has_native_flags() { return MENISCUS_NATIVE_BENCHMARKS; }

}  // namespace meniscus::bench::native
