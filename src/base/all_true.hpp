// Whether all of some conditions hold.
#pragma once

namespace meniscus {

/// All conditions are told, without branches between them: compilers make vectors of such loops.
template <class... Conditions>
constexpr bool all_true(Conditions... condition) {
  return (static_cast<int>(condition) & ...) != 0;
}

}  // namespace meniscus
