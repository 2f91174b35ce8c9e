// Collects the errors of an output and keeps the one that uses the most of its bound.
#pragma once

#include <cmath>
#include <utility>

#include "meniscus/error.hpp"
#include "verify/bits.hpp"
#include "verify/stage_cases.hpp"

namespace meniscus::verify {

/// Inputs are made so that no rounding decides what is found: throws where one may, or where a
/// bound is so wide that it says nothing.
inline void require_decided(bool decided) {
  require(decided, "a reference's input lies where rounding decides");
}

class Worst {
 public:
  Worst(std::string kernel, std::string output) : error_{std::move(kernel), std::move(output)} {}

  /// A value that should be `expected`, give or take `bound`; both infinite: no surface.
  /// `size`: whose last place counts, the expected value's unless it is given.
  void see(double found, double expected, double bound) { see(found, expected, bound, expected); }
  void see(double found, double expected, double bound, double size) {
    ++seen_;
    if (found == expected) return;
    const double unit = ulp_of(size), off = std::abs(found - expected);
    if (!std::isfinite(off)) return keep(INFINITY, 0, INFINITY);
    keep(off / unit, bound / unit, bound > 0 ? off / bound : INFINITY);
  }

  /// A value between two bounds; where only the upper one is infinite, there may be none as well.
  void see_within(double found, double low, double high) {
    if (std::isfinite(high))
      see(found, (low + high) / 2, (high - low) / 2);
    else if (std::isinf(low) || found < low)
      see(found, low, 0);
  }

  const ReferenceError& error() const { return error_; }
  std::size_t seen() const { return seen_; }  // values

 private:
  void keep(double ulp, double allowed, double share) {
    if (!(share > share_)) return;
    share_ = share;
    error_.ulp = ulp;
    error_.allowed = allowed;
  }

  ReferenceError error_;
  double share_ = 0;  // of the bound
  std::size_t seen_ = 0;
};

}  // namespace meniscus::verify
