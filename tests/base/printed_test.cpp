#include "base/printed.hpp"

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
  EXPECT_EQ(three_digits(4.4470319519981199e43), "4.45e+43");
  EXPECT_EQ(with_prefix(634.2e6), "634 M");
  EXPECT_EQ(with_prefix(12), "12.0");
  EXPECT_EQ(grouped(1234567), "1,234,567");
  EXPECT_EQ(grouped(123), "123");
  EXPECT_EQ(size_of(262144), "256 KiB");
  EXPECT_EQ(size_of(1 << 27), "128 MiB");
}

TEST(Counted, SaysOneOrSeveral) {
  EXPECT_EQ(counted(0, "frame"), "0 frames");
  EXPECT_EQ(counted(1, "frame"), "1 frame");
  EXPECT_EQ(counted(std::size_t{35937}, "frame"), "35,937 frames");
  EXPECT_EQ(counted(1u, "process", "es"), "1 process");
  EXPECT_EQ(counted(2u, "process", "es"), "2 processes");
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
