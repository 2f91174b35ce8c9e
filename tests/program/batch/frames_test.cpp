#include "program/batch/frames.hpp"

#include <gmock/gmock.h>

#include "meniscus/error.hpp"
#include "thrown.hpp"

namespace meniscus {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;

std::string error_of(const std::string& list) {
  return text_of_thrown<InvalidArgument>([&] { parse_frames(list); });
}

TEST(Frames, RangesAreInclusiveAndKeepTheirOrder) {
  EXPECT_THAT(parse_frames("7"), ElementsAre(7));
  EXPECT_THAT(parse_frames("1-4"), ElementsAre(1, 2, 3, 4));
  EXPECT_THAT(parse_frames("1-6x2"), ElementsAre(1, 3, 5));
  EXPECT_THAT(parse_frames("1,5,10-12"), ElementsAre(1, 5, 10, 11, 12));
  EXPECT_THAT(parse_frames("10-1x-3"), ElementsAre(10, 7, 4, 1));
  EXPECT_THAT(parse_frames("3-1"), ElementsAre(3, 2, 1));
  EXPECT_THAT(parse_frames("5-5x9"), ElementsAre(5));
}

TEST(Frames, EachComesOnce) { EXPECT_THAT(parse_frames("3,1-4,3"), ElementsAre(3, 1, 2, 4)); }

TEST(Frames, SaysWhatIsWrong) {
  for (const char* list :
       {"", ",", "1,", "a", "1-", "1-x2", "1-5x", "1 - 5", "1-5y2", "1.5", "1--"})
    EXPECT_THAT(error_of(list), HasSubstr("is no frame and no range of frames")) << list;
  EXPECT_THAT(error_of("-5-3"), HasSubstr("goes below frame 0"));
  EXPECT_THAT(error_of("1-5x0"), HasSubstr("never reaches its end"));
  EXPECT_THAT(error_of("1-5x-1"), HasSubstr("never reaches its end"));
  EXPECT_THAT(error_of("5-1x1"), HasSubstr("never reaches its end"));
  EXPECT_THAT(error_of("0-99999999999"), HasSubstr("names more than 10000000 frames"));
  EXPECT_THAT(error_of("0-999999999999999999"), HasSubstr("names more than 10000000 frames"));
  // No file's name holds more digits, and sums of such numbers would overflow.
  for (const char* list : {"9223372036854775807", "9223372036854775800-9223372036854775807",
                           "0-9223372036854775807", "1000000000000000000"})
    EXPECT_THAT(error_of(list), HasSubstr("goes beyond frame 999999999999999999")) << list;
  EXPECT_THAT(error_of("1-5x9223372036854775807"), HasSubstr("goes beyond frame"));
}

TEST(Frames, ListsAreShortAndReadBack) {
  EXPECT_EQ(frame_list({}), "");
  EXPECT_EQ(frame_list({5}), "5");
  EXPECT_EQ(frame_list({2, 1}), "1,2");
  EXPECT_EQ(frame_list({3, 1, 2, 7, 10, 12, 14}), "1-3,7,10-14x2");
  EXPECT_EQ(frame_list({1, 9, 10, 11}), "1,9-11");
  for (const char* list : {"1-3,7,10-14x2", "0-23", "0,5,6", "1,3,4,6", "2,4,6-8,100"}) {
    std::vector<std::int64_t> frames = parse_frames(list);
    EXPECT_EQ(parse_frames(frame_list(frames)), frames) << frame_list(frames);
  }
}

TEST(Shard, PartsAreDisjointAndTogetherAll) {
  const std::vector<std::int64_t> all = parse_frames("0-22");
  for (const int count : {1, 2, 5, 23, 40}) {
    std::vector<std::int64_t> together;
    for (int index = 1; index <= count; ++index)
      for (const std::int64_t frame : items_of(Shard{index, count}, all)) together.push_back(frame);
    std::sort(together.begin(), together.end());
    EXPECT_EQ(together, all) << count;
  }
}

TEST(Shard, IsKOfN) {
  EXPECT_EQ(parse_shard("2/8").index, 2);
  EXPECT_EQ(parse_shard("2/8").count, 8);
  for (const char* text : {"", "2", "0/8", "9/8", "-1/8", "2/", "/8", "2/8/1", "a/b", "1/2 "})
    EXPECT_THROW(parse_shard(text), InvalidArgument) << text;
}

}  // namespace
}  // namespace meniscus
