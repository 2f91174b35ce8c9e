// Sizes in whole steps.
#pragma once

#include <cstddef>

namespace meniscus {

/// The least multiple of `step` that is not below `n`.
constexpr std::size_t rounded_up(std::size_t n, std::size_t step) {
  return (n + step - 1) / step * step;
}

}  // namespace meniscus
