// Devices without extras show the same bytes: every method under the limits of limits.cpp, scaled
// down with the image, in both vector widths, against the same device without limits.
#include <gmock/gmock.h>

#include <filesystem>
#include <tuple>

#include "program/cli/program.hpp"

namespace meniscus::test {
namespace {

using testing::HasSubstr;

using Environment = std::vector<std::pair<std::string, std::string>>;

// 16 MiB at 1024x768, as many bytes a pixel here.
const Environment kLimits{{"LD_PRELOAD", MENISCUS_LIMITS},
                          {"MENISCUS_LIMIT_BUFFER", "1638400"},
                          {"MENISCUS_LIMIT_LOCAL", "32768"},
                          {"MENISCUS_LIMIT_GROUP", "64"}};

class Limits : public Program {
 protected:
  Outcome extract(const std::string& method, const std::string& name,
                  const Environment& environment) const {
    Conditions conditions;
    conditions.environment = environment;
    return run({"extract", MENISCUS_TEST_DATA "/dam_4913.ply", "--size", "320x240", "--method",
                method, "--compression", "none", "-o", name + ".exr", "-o", name + ".ply"},
               conditions);
  }
};

class LimitsOnMethods
    : public Limits,
      public testing::WithParamInterface<std::tuple<const char*, const char*, const char*>> {};

TEST_P(LimitsOnMethods, GiveTheSameBytes) {
  const auto& [method, kind, group] = GetParam();
  const Outcome free = extract(method, "free", {});
  ASSERT_EQ(free.exit_code, 0) << free.err;
  Environment limits = kLimits;
  limits.push_back({"MENISCUS_LIMIT_KIND", kind});
  limits.push_back({"MENISCUS_LIMIT_GROUP", group});
  const Outcome limited = extract(method, "limited", limits);
  ASSERT_EQ(limited.exit_code, 0) << limited.err;
  for (const std::string ending : {".exr", ".ply"})
    EXPECT_EQ(read("free" + ending), read("limited" + ending)) << ending;
}

// Groups of 64 items, and of 8, which are less than a row of a tile.
INSTANTIATE_TEST_SUITE_P(Frame, LimitsOnMethods,
                         testing::Combine(testing::Values("fit", "stable", "paper", "ssm"),
                                          testing::Values("cpu", "gpu"),
                                          testing::Values("64", "8")),
                         [](const auto& test) {
                           std::string name = std::get<0>(test.param);
                           name += "_";
                           name += std::get<1>(test.param);
                           return name + "_" + std::get<2>(test.param);
                         });

// Frames in flight on a GPU share its context.
TEST_F(Limits, FramesInFlightOnAGpuGiveTheSameBytes) {
  for (int k = 1; k <= 6; ++k)
    std::filesystem::copy_file(MENISCUS_TEST_DATA "/dam_4913.ply",
                               path("f." + std::to_string(k) + ".ply"));
  const auto sequence = [&](const std::string& name, const std::string& in_flight,
                            const Environment& environment) {
    Conditions conditions;
    conditions.environment = environment;
    return run({"extract", path("f.#.ply"), "--size", "320x240", "--in-flight", in_flight,
                "--compression", "none", "-o", path(name + ".#.exr")},
               conditions);
  };
  const Outcome free = sequence("free", "1", {});
  ASSERT_EQ(free.exit_code, 0) << free.err;
  Environment limits = kLimits;
  limits.push_back({"MENISCUS_LIMIT_KIND", "gpu"});
  const Outcome limited = sequence("limited", "3", limits);
  ASSERT_EQ(limited.exit_code, 0) << limited.err;
  for (int k = 1; k <= 6; ++k) {
    const std::string ending = "." + std::to_string(k) + ".exr";
    EXPECT_EQ(read("free" + ending), read("limited" + ending)) << ending;
  }
}

TEST_F(Limits, AreWhatDevicesSayAndDo) {
  Conditions conditions;
  conditions.environment = kLimits;
  EXPECT_THAT(run({"devices"}, conditions).out, HasSubstr("OpenCL 1.2 limited"));
  // The image's normals, which stay in one piece: 12 bytes a pixel.
  conditions.environment.push_back({"MENISCUS_LIMIT_BUFFER", "900000"});
  expect_error(extract("fit", "small", conditions.environment), 1,
               {"a buffer of 921600 bytes is needed", "allows 89", "--device"});
  EXPECT_FALSE(exists("small.exr"));
}

}  // namespace
}  // namespace meniscus::test
