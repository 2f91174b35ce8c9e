// Which values of particles can be used.
#pragma once

#include <cmath>
#include <cstdint>
#include <limits>
#include <vector>

#include "base/notices.hpp"
#include "meniscus/parameters.hpp"

namespace meniscus {

/// Looks at values one by one and counts those that cannot be used.
class UsableCheck {
 public:
  /// Whether a value of the particle `place` of the file can be used: it is no NaN and not so large
  /// (1e30) that sums of some may overflow.
  template <class... Float>
  bool usable(std::int64_t place, Float... values) {
    constexpr float kMost = 1e30f;
    ++seen_;
    if ((... && (std::abs(values) < kMost))) return true;
    ++bad_;
    first_bad_ = place < first_bad_ ? place : first_bad_;
    return false;
  }

  /// Adds what another one counted.
  void add(const UsableCheck& other);

 protected:
  /// Adds the notice, whose text says what is wrong with how many, if there were any. Throws
  /// InputError when params.strict.
  void report(Notice notice, const Parameters& params, Notices& notices) const;

  std::int64_t seen_ = 0, bad_ = 0, first_bad_ = std::numeric_limits<std::int64_t>::max();
};

}  // namespace meniscus
