// The limits: that devices keep what they claim, and that a smaller one is found.
#include "verify/limits.hpp"

#include <gmock/gmock.h>

#include "stages/stage_test_support.hpp"

namespace meniscus::verify {
namespace {

using Limits = OnDevice;

std::vector<Row> limits_of(Device& device) {
  std::vector<Row> rows;
  probe_limits(device, false, [&](Row row) { rows.push_back(std::move(row)); });
  return rows;
}

TEST_P(Limits, AreWhatTheDeviceClaims) {
  const std::vector<Row> rows = limits_of(device_);
  std::vector<std::string> names;
  for (const Row& row : rows) {
    names.push_back(row.kernel);
    EXPECT_EQ(row.group, "limit");
    EXPECT_EQ(row.result, Result::pass) << row.kernel << ": " << row.reason;
    EXPECT_FALSE(row.required);
    EXPECT_FALSE(row.reason.empty()) << row.kernel;
  }
  EXPECT_THAT(names, testing::ElementsAre("largest_buffer", "work_group", "launch_cost", "transfer",
                                          "transfer", "build_time", "build_time", "local_memory"));
}

// A device whose work-items lose their way in groups of more than `most`.
std::vector<Row> with_groups_up_to(const DeviceInfo& info, int most) {
  Device device(info);
  device.state().kernel_text = [&](const std::string&, std::string text) {
    const std::string from = "name[0] = i;";
    if (const auto at = text.find(from); at != std::string::npos)
      text.replace(at, from.size(),
                   "name[0] = get_local_size(0) > " + std::to_string(most) + " ? -1 : i;");
    return text;
  };
  return limits_of(device);
}

TEST_P(Limits, ASmallerOneIsFoundAndFailsWhereItIsNeeded) {
  for (const int most : {0, 5, 21})
    for (const Row& row : with_groups_up_to(GetParam(), most)) {
      if (row.kernel != "work_group") continue;
      EXPECT_EQ(row.result, Result::fail);
      EXPECT_EQ(row.required, most == 0);
      EXPECT_THAT(row.reason, testing::StartsWith(std::to_string(most) + " items"));
    }
}

MENISCUS_ON_EVERY_DEVICE(Limits);

TEST(LargestThatWorks, IsFoundToWithinAStep) {
  int tried = 0;
  const auto up_to = [&](std::size_t limit) {
    return [&tried, limit](std::size_t n) {
      ++tried;
      return n <= limit;
    };
  };
  EXPECT_EQ(largest_that_works(1000, 1, up_to(1000)), 1000u);
  EXPECT_EQ(tried, 1);  // nothing else is tried
  for (const std::size_t limit : {0, 1, 2, 499, 500, 501, 998, 999})
    EXPECT_EQ(largest_that_works(1000, 1, up_to(limit)), limit);
  const std::size_t near = largest_that_works(1000, 64, up_to(700));
  EXPECT_LE(near, 700u);
  EXPECT_GT(near, 700u - 64);
}

}  // namespace
}  // namespace meniscus::verify
