// What `meniscus verify` says and writes.
#include <gmock/gmock.h>

#include <nlohmann/json.hpp>

#include "cli/program.hpp"

namespace meniscus::test {
namespace {

using testing::HasSubstr;

using ProgramVerify = Program;

TEST_F(ProgramVerify, PassesHereAndWritesJsonJUnitAndPage) {
  const Outcome outcome =
      run({"verify", "--device", "cpu", "--size", "small", "--kernel", "project", "--json",
           "v.json", "--junit", "v.xml", "--html", "v.html"});
  EXPECT_EQ(outcome.exit_code, 0) << outcome.out << outcome.err;
  EXPECT_THAT(outcome.out, HasSubstr("PASSED"));
  const auto json = nlohmann::json::parse(read("v.json"));
  ASSERT_FALSE(json["rows"].empty());
  for (const auto& row : json["rows"]) {
    EXPECT_EQ(row["result"], "pass");
    EXPECT_THAT(row["kernel"].get<std::string>(), HasSubstr("project"));
  }
  EXPECT_THAT(read("v.xml"), HasSubstr("<testcase classname=\"project_particles\""));
  EXPECT_THAT(read("v.html"), HasSubstr("project_particles"));

  const Outcome same = run({"verify", "--compare", "v.json", "v.json"});
  EXPECT_EQ(same.exit_code, 0) << same.err;
  EXPECT_THAT(same.out, HasSubstr(", 0 differ"));
}

TEST_F(ProgramVerify, SaysWhatIsWrongWithItsArguments) {
  expect_error(run({"verify", "--kernel", "no_such"}), 2,
               {"--kernel is no_such", "project_particles"});
  expect_error(run({"verify", "--device", "no such"}), 1, {"no usable OpenCL device matches"});
  expect_error(run({"verify", "--size", "huge"}), 2, {"--size"});
  expect_error(run({"verify", "--json", "a", "--html", "./a"}), 2, {"./a", "named twice"});
  write("broken.json", "{");
  for (const char* option : {"--html", "--json", "--junit"})
    expect_error(
        run({"verify", "--compare", "broken.json", "broken.json", option, "./broken.json"}), 2,
        {"output ./broken.json: is the input"});
  EXPECT_EQ(read("broken.json"), "{");
  expect_error(run({"verify", "--compare", "broken.json", "broken.json"}), 1, {"broken.json"});
}

TEST_F(ProgramVerify, ProgressFitsTheTerminal) {
  // All small cases: what is over in half a second has no bar.
  const Outcome outcome = run_on_terminal(60, {"verify", "--device", "cpu", "--size", "small"});
  EXPECT_EQ(outcome.exit_code, 0);
  const std::vector<std::string> bars = bars_in(outcome.err);
  EXPECT_FALSE(bars.empty()) << outcome.err;
  EXPECT_THAT(bars,
              testing::Each(testing::AllOf(HasSubstr(" ["), testing::SizeIs(testing::Lt(60)))));
}

TEST_F(ProgramVerify, StartsItsProcessesWithALauncher) {
  const std::vector<std::string> command{"verify", "--device", "cpu",       "--size",
                                         "small",  "--kernel", "bound_bins"};
  EXPECT_EQ(run(command, {.environment = {{"MENISCUS_LAUNCHER", "env ANYTHING=1"}}}).exit_code, 0);
  expect_error(run(command, {.environment = {{"MENISCUS_LAUNCHER", "false"}}}), 1,
               {"listing the OpenCL devices", "exit code 1"});
  expect_error(run(command, {.environment = {{"MENISCUS_LAUNCHER", "no_such_launcher"}}}), 1,
               {"MENISCUS_LAUNCHER: no_such_launcher cannot be started: No such file"});
}

// A device that crashes or hangs costs rows; the next process goes on behind the case.
TEST_F(ProgramVerify, CrashesAndHangsAreRowsAndNoEnd) {
  for (const bool hangs : {false, true}) {
    const Outcome outcome = run({"verify", "--device", "cpu", "--size", "small", "--kernel",
                                 "select_near", "--timeout", "2", "--json", "v.json"},
                                {.environment = {{"LD_PRELOAD", MENISCUS_ENDING_CALL},
                                                 {"MENISCUS_END_CALL", "2"},
                                                 {"MENISCUS_END_BY", hangs ? "hang" : "crash"}}});
    EXPECT_EQ(outcome.exit_code, 1) << outcome.err;
    const auto json = nlohmann::json::parse(read("v.json"));
    ASSERT_EQ(json["rows"].size(), 4u) << "one for each variant";
    for (const auto& row : json["rows"]) {
      EXPECT_EQ(row["result"], "fail");
      EXPECT_THAT(row["kernel"].get<std::string>(), HasSubstr("kernels of stream on block"));
      EXPECT_THAT(row["reason"].get<std::string>(),
                  HasSubstr(hangs ? "gave no sign for 2 s" : "the process was ended by signal 9"));
    }
  }
}

TEST_F(ProgramVerify, TextsOfFilesThatAreComparedSteerNoTerminal) {
  write("a.json", R"({"meniscus": "0", "devices": [
    {"name": "a", "platform": "p", "driver": "1", "version": "1", "seconds": 1},
    {"name": "b", "platform": "p", "driver": "1", "version": "1\u001b[2J", "seconds": 1}],
    "rows": [{"index": 1, "group": "kernel", "device": "b", "kernel": "k\u0007", "variant": "",
    "size": "", "result": "fail", "ulp": null, "reason": "\u001b[31m", "ms": 1, "required": true,
    "section": ""}]})");
  const Outcome outcome = run({"verify", "--compare", "a.json"});
  EXPECT_EQ(outcome.exit_code, 0) << outcome.err;
  EXPECT_THAT(outcome.out, testing::AllOf(HasSubstr("k\\x07"), HasSubstr("\\x1b[31m"),
                                          testing::Not(HasSubstr("\x1b"))));
}

}  // namespace
}  // namespace meniscus::test
