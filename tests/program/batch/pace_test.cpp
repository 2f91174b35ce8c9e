#include "program/batch/pace.hpp"

#include <gtest/gtest.h>

namespace meniscus {
namespace {

using namespace std::chrono_literals;

const Pace::Time kBegin{};

TEST(Pace, IsNotKnownBeforeAFrameHasEnded) { EXPECT_EQ(Pace(kBegin, 2).frames_per_second(), 0); }

TEST(Pace, LeavesOutTheBuildingOfKernels) {
  Pace pace(kBegin, 2);
  pace.begin(kBegin + 12s);  // the last kernel
  pace.ended(kBegin + 13s);
  EXPECT_DOUBLE_EQ(pace.frames_per_second(), 1);
  pace.begin(kBegin + 13s);  // frames have ended: too late
  pace.ended(kBegin + 14s);
  EXPECT_DOUBLE_EQ(pace.frames_per_second(), 1);
}

// The first two end together after 10 s, then four a second.
TEST(Pace, ForgetsTheStartSoonerThanItsShareOfAllFramesWould) {
  Pace pace(kBegin, 2);
  pace.ended(kBegin + 10s);
  pace.ended(kBegin + 10s);
  EXPECT_DOUBLE_EQ(pace.frames_per_second(), .2);
  for (int k = 1; k <= 11; ++k) pace.ended(kBegin + 10s + 250ms * k);
  EXPECT_NEAR(pace.frames_per_second(), 12 / 2.75, 1e-12);
}

// A thousand frames of .1 s, then some of 2 s: the fluid has grown.
TEST(Pace, FollowsFramesThatGrow) {
  Pace pace(kBegin, 2);
  Pace::Time now = kBegin;
  for (int k = 0; k < 1000; ++k) pace.ended(now += 100ms);
  EXPECT_NEAR(pace.frames_per_second(), 10, 1e-9);
  for (int k = 0; k < 30; ++k) pace.ended(now += 2s);
  EXPECT_NEAR(pace.frames_per_second(), .5, 1e-9);
}

// Frames of a minute: the last `few` count, though the first of them ended long ago.
TEST(Pace, CountsSomeFramesHoweverSlowTheyAre) {
  Pace pace(kBegin, 1);
  for (int k = 1; k <= 100; ++k) pace.ended(kBegin + 60s * k);
  EXPECT_NEAR(pace.frames_per_second(), 1 / 60.0, 1e-12);
}

// 64 at once: as long as one such crowd has ended, the frames of the next are not known to end
// sooner.
TEST(Pace, TakesACrowdThatEndsTogetherForNoPace) {
  Pace pace(kBegin, 64);
  for (int k = 0; k < 64; ++k) pace.ended(kBegin + 60s + 1ms * k);
  EXPECT_NEAR(pace.frames_per_second(), 64 / 60.063, 1e-9);
}

}  // namespace
}  // namespace meniscus
