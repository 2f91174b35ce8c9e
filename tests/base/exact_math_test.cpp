// exact_math against long double, which is ten bits finer.
#include "base/exact_math.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <string>

#include "base/content_hash.hpp"

namespace meniscus {
namespace {

// In units in the last place of the true value.
double error(double found, long double wanted) {
  const double near = static_cast<double>(wanted);
  const double unit = std::nextafter(near, INFINITY) - near;
  return static_cast<double>(std::fabs(static_cast<long double>(found) - wanted) / unit);
}

TEST(ExactMath, ExponentialIsWithinAUnitInTheLastPlace) {
  double worst = 0;
  for (int k = 0; k < 400000; ++k) {
    const double x = -0.00173 * k - 1e-9 * (k % 97);
    worst = std::max(worst, error(exp_negative(x), std::exp(static_cast<long double>(x))));
  }
  EXPECT_LT(worst, 1.0);
  EXPECT_EQ(exp_negative(0), 1);
  EXPECT_EQ(exp_negative(-1000), 0);
  EXPECT_EQ(exp_negative(-INFINITY), 0);
  EXPECT_TRUE(std::isnan(exp_negative(std::numeric_limits<double>::quiet_NaN())));
}

TEST(ExactMath, LogarithmIsWithinTwoUnitsInTheLastPlace) {
  double worst = 0;
  for (int k = 1; k < 400000; ++k) {
    const double x = std::ldexp(1 + k * 1.7e-6, k % 601 - 300);
    if (x > 0.5 && x < 2) continue;  // there errors are absolute
    worst = std::max(worst, error(logarithm(x), std::log(static_cast<long double>(x))));
  }
  EXPECT_LT(worst, 2.0);
  for (int k = 0; k < 1000; ++k) {
    const double x = 0.5 + 0.0015 * k;
    EXPECT_NEAR(logarithm(x), static_cast<double>(std::log(static_cast<long double>(x))), 4e-16);
  }
  EXPECT_EQ(logarithm(1), 0);
}

TEST(ExactMath, CubeRootIsWithinAUnitInTheLastPlace) {
  double worst = 0;
  for (int k = 1; k < 400000; ++k) {
    const double x = std::ldexp(1 + k * 1.7e-6, k % 601 - 300);
    worst = std::max(worst, error(cube_root(x), std::cbrt(static_cast<long double>(x))));
  }
  EXPECT_LT(worst, 1.0);
  for (int k = 0; k < 100; ++k) EXPECT_EQ(cube_root(double(k) * k * k), k);
  EXPECT_EQ(cube_root(0), 0);
  EXPECT_EQ(cube_root(INFINITY), INFINITY);
  EXPECT_LT(error(cube_root(5e-324), std::cbrt(static_cast<long double>(5e-324))), 1.0);
}

// The bits that every compiler and processor must give.
TEST(ExactMath, GivesTheSameBitsEverywhere) {
  std::string bytes;
  for (int k = 0; k < 10000; ++k) {
    const double values[2] = {exp_negative(-0.01 * k), cube_root(0.37 * k)};
    bytes.append(reinterpret_cast<const char*>(values), sizeof(values));
  }
  EXPECT_EQ(hex_digits(content_hash(bytes)), "0c5a893f26d8b9ec");
}

}  // namespace
}  // namespace meniscus
