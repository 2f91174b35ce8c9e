#include "printed.hpp"

#include <gtest/gtest.h>

namespace meniscus {
namespace {

TEST(Printed, NumbersHaveThreeDigits) {
  EXPECT_EQ(three_digits(0.012345), "0.0123");
  EXPECT_EQ(three_digits(4.5678), "4.57");
  EXPECT_EQ(three_digits(789.4), "789");
  EXPECT_EQ(three_digits(50887.4), "50,887");
  EXPECT_EQ(three_digits(-8388608), "-8,388,608");
  EXPECT_EQ(three_digits(0), "0");
  EXPECT_EQ(with_prefix(634.2e6), "634 M");
  EXPECT_EQ(with_prefix(12), "12.0");
  EXPECT_EQ(grouped(1234567), "1,234,567");
  EXPECT_EQ(grouped(123), "123");
  EXPECT_EQ(size_of(262144), "256 KiB");
  EXPECT_EQ(size_of(1 << 27), "128 MiB");
}

TEST(Printed, DurationsAreThoseOfAClock) {
  EXPECT_EQ(duration(0.4), "0 s");
  EXPECT_EQ(duration(59.6), "1:00");
  EXPECT_EQ(duration(3723), "1:02:03");
}

TEST(FrameRate, TurnsAroundBelowOneASecond) {
  EXPECT_EQ(frame_rate(24.56), "24.6 frames/s");
  EXPECT_EQ(frame_rate(1), "1.00 frames/s");
  EXPECT_EQ(frame_rate(0.27), "3.70 s a frame");
  EXPECT_EQ(frame_rate(1.0 / 75), "1:15 a frame");
}

}  // namespace
}  // namespace meniscus
