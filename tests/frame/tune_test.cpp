// What meniscus tune keeps.
#include "frame/tune.hpp"

#include <gtest/gtest.h>

namespace meniscus {
namespace {

Trial trial(double ms, double spread_ms) { return {{8, 64}, ms, spread_ms, true, ""}; }

TEST(Tune, KeepsNothingWithinThreePercentOrTheSpread) {
  EXPECT_TRUE(is_faster(trial(9, 0.1), trial(10, 0.1)));
  EXPECT_FALSE(is_faster(trial(9.8, 0), trial(10, 0)));     // 2 %
  EXPECT_FALSE(is_faster(trial(9, 0.6), trial(10, 0.6)));   // each spreads over more than half
  EXPECT_FALSE(is_faster(trial(9, 0.1), trial(10, 1.0)));   // the default was once as fast
  EXPECT_FALSE(is_faster(trial(11, 0.1), trial(10, 0.1)));  // slower
}

}  // namespace
}  // namespace meniscus
