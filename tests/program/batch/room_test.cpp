#include "program/batch/room.hpp"

#include <gtest/gtest.h>
#include <sys/resource.h>

#include <limits>

namespace meniscus {
namespace {

constexpr std::size_t kPixels = 1024 * 768;

TEST(Room, ACrewThatFitsStays) {
  const Crew crew{2, 8};
  EXPECT_EQ(crew_within(crew, kPixels, std::numeric_limits<std::size_t>::max()), crew);
  EXPECT_EQ(crew_within(crew, kPixels, room_for(crew, kPixels)), crew);
}

TEST(Room, ALargerOneShrinksToWhatFits) {
  for (const Crew& asked : {Crew{2, 8}, Crew{8, 1}, Crew{1, 1}}) {
    const std::size_t least = room_for({1, 1}, kPixels);
    EXPECT_EQ(crew_within(asked, kPixels, least - 1), Crew());
    EXPECT_EQ(crew_within(asked, kPixels, least), (Crew{1, 1}));
    EXPECT_EQ(crew_within(asked, kPixels, 0), Crew());
    const std::size_t room = room_for({2, 1}, kPixels) + 1;
    const Crew found = crew_within(asked, kPixels, room);
    EXPECT_LE(room_for(found, kPixels), room);
    EXPECT_EQ(found.extracting + found.writing, std::min(3, asked.extracting + asked.writing));
  }
}

TEST(Room, IsWhatTheLimitLeaves) {
  rlimit before{};
  getrlimit(RLIMIT_AS, &before);
  // Far more than a test takes, also where a sanitizer keeps 20 TB of addresses for itself.
  constexpr rlim_t kLimit = rlim_t{1} << 46;
  if (before.rlim_max < kLimit) GTEST_SKIP() << "there is a lower limit already";
  const rlimit limited{kLimit, before.rlim_max};
  setrlimit(RLIMIT_AS, &limited);
  const std::size_t left = room_left();
  setrlimit(RLIMIT_AS, &before);
  EXPECT_LT(left, kLimit);
  EXPECT_GT(left, kLimit / 2);
}

}  // namespace
}  // namespace meniscus
