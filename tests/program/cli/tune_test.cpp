// What `meniscus tune` says, and that later runs go by it.
#include <gmock/gmock.h>

#include <cstdlib>

#include "device/tuning.hpp"
#include "meniscus/device.hpp"
#include "program/cli/program.hpp"

namespace meniscus::test {
namespace {

using testing::AllOf;
using testing::HasSubstr;
using testing::Not;

using ProgramTune = Program;

TEST_F(ProgramTune, MeasuresKeepsAndForgets) {
  const Conditions conditions{.environment = {{"MENISCUS_CACHE_DIR", "cache"}}};
  const Outcome tuned = run_well({"tune", "--device", "cpu", "--rounds", "1", "-q"}, conditions);
  EXPECT_THAT(tuned.out, AllOf(HasSubstr("width 1, groups of 64"), HasSubstr("discs by minima"),
                               HasSubstr("(default)"),
                               HasSubstr("kept: width 8, groups of 64, discs by bins, since")));
  EXPECT_EQ(tuned.err, "");
  const Outcome forgotten = run_well({"tune", "--device", "cpu", "--forget"}, conditions);
  EXPECT_THAT(forgotten.out,
              HasSubstr("forgotten: width 8, groups of 64, discs by bins from now on"));
}

TEST_F(ProgramTune, WhatWasKeptIsShownWithTheDevices) {
  const Conditions conditions{.environment = {{"MENISCUS_CACHE_DIR", path("cache")}}};
  EXPECT_THAT(run({"devices"}, conditions).out, Not(HasSubstr("launched with")));
  setenv("MENISCUS_CACHE_DIR", path("cache").c_str(), 1);
  const bool kept = keep_tuning(select_device("cpu"), {1, 16});
  unsetenv("MENISCUS_CACHE_DIR");
  ASSERT_TRUE(kept);
  EXPECT_THAT(run({"devices"}, conditions).out, HasSubstr("launched with width 1, groups of 16"));
  run_well({"tune", "--forget"}, conditions);
  EXPECT_THAT(run({"devices"}, conditions).out, Not(HasSubstr("launched with")));
}

TEST_F(ProgramTune, SaysWhatIsWrong) {
  expect_error(run({"tune", "--rounds", "0"}), 2, {"--rounds"});
  expect_error(run({"tune", "--device", "no such"}), 1, {"no usable OpenCL device matches"});
}

}  // namespace
}  // namespace meniscus::test
