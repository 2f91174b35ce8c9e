// Room for arrays as large as images, which are new in every frame.
#pragma once

#include <sys/mman.h>

#include <bit>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "base/rounded_up.hpp"

namespace meniscus {

/// Room for n values, in large pages where the system has some to give (Linux's transparent huge
/// pages). New memory costs a page fault a page: at 3264x2448 a third of what it takes to write the
/// maps (docs/performance_appendix.md).
template <class T>
void reserve_in_large_pages(std::vector<T>& values, std::size_t n) {
  constexpr std::size_t kPage = std::size_t{2} << 20, kWorthIt = 4 * kPage;  // bytes
  values.reserve(n);
#ifdef MADV_HUGEPAGE
  if (n * sizeof(T) < kWorthIt) return;
  const auto begin = std::bit_cast<std::uintptr_t>(values.data());
  const std::uintptr_t first = rounded_up(begin, kPage),
                       last = (begin + n * sizeof(T)) / kPage * kPage;
  // Only a hint: results do not depend on it.
  madvise(std::bit_cast<void*>(first), last - first, MADV_HUGEPAGE);
#endif
}

}  // namespace meniscus
