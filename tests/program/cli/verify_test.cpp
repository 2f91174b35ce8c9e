// What `meniscus verify` says and writes.
#include <gmock/gmock.h>

#include <algorithm>
#include <chrono>
#include <csignal>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <map>
#include <nlohmann/json.hpp>
#include <thread>

#include "program/cli/program.hpp"

namespace meniscus::test {
namespace {

using testing::AllOf;
using testing::HasSubstr;
using testing::Not;

using ProgramVerify = Program;

TEST_F(ProgramVerify, PassesHereAndWritesJsonJUnitAndPage) {
  const Outcome outcome =
      run({"verify", "--device", "cpu", "--size", "small", "--kernel", "cover_discs", "--json",
           "v.json", "--junit", "v.xml", "--html", "v.html"});
  EXPECT_EQ(outcome.exit_code, 0) << outcome.out << outcome.err;
  EXPECT_THAT(outcome.out, HasSubstr("PASSED"));
  const auto json = nlohmann::json::parse(read("v.json"));
  ASSERT_FALSE(json["rows"].empty());
  for (const auto& row : json["rows"]) {
    EXPECT_EQ(row["result"], "pass");
    EXPECT_THAT(row["kernel"].get<std::string>(), HasSubstr("cover_discs"));
  }
  EXPECT_THAT(read("v.xml"), HasSubstr("<testcase classname=\"cover_discs\""));
  EXPECT_THAT(read("v.html"), HasSubstr("cover_discs"));

  const Outcome same = run_well({"verify", "--compare", "v.json", "v.json"});
  EXPECT_THAT(same.out, AllOf(HasSubstr(", 0 differ\n"), HasSubstr("A  v.json: ")));
  EXPECT_THAT(outcome.out, HasSubstr("kernels and references only"));

  // Two runs of the program itself differ, or one of them failed.
  auto other = json;
  other["rows"][0]["ulp"] = 3;
  write("other.json", other.dump());
  const Outcome differs = run({"verify", "--compare", "v.json", "other.json"});
  EXPECT_EQ(differs.exit_code, 1) << differs.err;
  EXPECT_THAT(differs.out,
              AllOf(HasSubstr(", 1 differ (1 of them required)\n"), HasSubstr("B  other.json: ")));
  for (auto& row : other["rows"])
    if (row["required"]) row["result"] = "fail";
  write("other.json", other.dump());
  const Outcome failed = run({"verify", "--compare", "other.json", "other.json", "--json", "-"});
  EXPECT_EQ(failed.exit_code, 1) << failed.err;
}

TEST_F(ProgramVerify, ListsItsKernels) {
  const Outcome outcome = run_well({"verify", "--list"});
  EXPECT_THAT(outcome.out, AllOf(HasSubstr("\nfit_particles\n"), HasSubstr("\nbound_bins\n")));
  EXPECT_THAT(outcome.out, Not(HasSubstr(" ")));
  expect_error(run({"verify", "--list", "--kernel", "fit"}), 2,
               {"--kernel and --list are both given"});
}

TEST_F(ProgramVerify, SaysWhatIsWrongWithItsArguments) {
  expect_error(run({"verify", "--kernel", "no_such"}), 2,
               {"--kernel is no_such, must be a part of a name (--list has them all"});
  expect_error(run({"verify", "--kernel", "cover_disks"}), 2,
               {"--kernel is cover_disks, must be a part of a name such as cover_discs (--list"});
  expect_error(run({"verify", "--kernel", ""}), 2, {"--kernel has an empty name"});
  expect_error(run({"verify", "--device", "no such"}), 1, {"no usable OpenCL device matches"});
  expect_error(run({"verify", "--size", "huge"}), 2, {"--size"});
  expect_error(run({"verify", "--json", "a.html", "--html", "./a.html"}), 2,
               {"./a.html", "named twice"});
  expect_error(run({"verify", "--html", "frame.ply"}), 2, {"--html is frame.ply", ".html"});
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
  run_well(command, {.environment = {{"MENISCUS_LAUNCHER", "env ANYTHING=1"}}});
  expect_error(run(command, {.environment = {{"MENISCUS_LAUNCHER", "false"}}}), 1,
               {"listing the OpenCL devices", "exit code 1"});
  expect_error(run(command, {.environment = {{"MENISCUS_LAUNCHER", "no_such_launcher"}}}), 1,
               {"MENISCUS_LAUNCHER: no_such_launcher cannot be started: No such file"});
}

constexpr char kWildStore[] = "*(volatile global int*)(size_t)64 = 1;";
constexpr char kEndlessLoop[] = "for (volatile int again = 1; again;) {}";

// A program that has a fault in a kernel, and no built kernels from before.
Conditions faulty(const std::string& kernel, const std::string& fault, const std::string& cache) {
  return {.environment = {{"LD_PRELOAD", MENISCUS_FAULTY_KERNEL_LIBRARY},
                          {"MENISCUS_FAULTY_KERNEL", kernel},
                          {"MENISCUS_FAULT", fault},
                          {"MENISCUS_CACHE_DIR", cache}}};
}

// A kernel that really crashes is named in all outputs; after two failures the others go on
// without it, and reproducers show what they were given.
TEST_F(ProgramVerify, NamesAKernelThatCrashesAndGoesOnWithoutIt) {
  const Conditions crash = faulty("find_fronts", kWildStore, path("cache"));
  const Outcome outcome =
      run({"verify", "--device", "cpu", "--size", "small", "--kernel", "find_fronts,select_near",
           "--json", "v.json", "--junit", "v.xml", "--html", "v.html", "--repro", "repro"},
          crash);
  EXPECT_EQ(outcome.exit_code, 1) << outcome.err;
  const auto json = nlohmann::json::parse(read("v.json"));
  int failed = 0, left_out = 0, passed = 0;
  for (const auto& row : json["rows"]) {
    if (row["kernel"] == "select_near") {
      EXPECT_EQ(row["result"], "pass") << row << ": canonical values took the place of its inputs";
      ++passed;
      continue;
    }
    EXPECT_EQ(row["kernel"], "find_fronts");
    const std::string reason = row["reason"];
    if (row["result"] == "skip") {
      EXPECT_THAT(reason, HasSubstr("left out: it crashed or hung before"));
      ++left_out;
      continue;
    }
    EXPECT_EQ(row["result"], "fail");
    EXPECT_THAT(reason, HasSubstr("while it ran, the process was ended by signal 11"));
    EXPECT_EQ(row["size"], "stream on block, 101 particles, 24x17");
    ++failed;
  }
  EXPECT_EQ(failed, 2);
  EXPECT_EQ(left_out, 2) << "in the two variants that come later";
  EXPECT_EQ(passed, 4) << "in all variants";
  EXPECT_THAT(read("v.xml"), HasSubstr("<testcase classname=\"find_fronts\""));
  EXPECT_THAT(read("v.html"), HasSubstr("<td class=\"word\">find_fronts</td>"));
  // As it happens, a line each, before the table.
  EXPECT_THAT(outcome.err, HasSubstr("FAILED kernel find_fronts, width 8, stream on block"));

  EXPECT_THAT(outcome.err, HasSubstr("2 reproducers in repro: each has a README.md"));
  std::string folder;
  for (const auto& entry : std::filesystem::directory_iterator(path("repro")))
    if (entry.path().filename().string().starts_with("find_fronts.width_8."))
      folder = "repro/" + entry.path().filename().string();
  EXPECT_THAT(read(folder + "/README.md"), HasSubstr("**while it ran, the process was ended by"));
  // By itself the kernel is right; with the same fault its host crashes, too.
  Conditions by_itself;
  by_itself.program = path(folder) + "/host";
  by_itself.launcher = {"/bin/sh", "-c", "cd " + path(folder) + " && make -s && \"$@\" '' 20",
                        "sh"};
  const Outcome right = run({}, by_itself);
  EXPECT_EQ(right.exit_code, 0) << right.out << right.err;
  EXPECT_THAT(right.out, HasSubstr("the same bits in 20 runs"));
  by_itself.launcher[2] =
      "cd " + path(folder) + " && LD_PRELOAD=" MENISCUS_FAULTY_KERNEL_LIBRARY " \"$@\"";
  by_itself.environment = {{"MENISCUS_FAULTY_KERNEL", "find_fronts"},
                           {"MENISCUS_FAULT", kWildStore}};
  EXPECT_EQ(run({}, by_itself).exit_code, 128 + SIGSEGV);
}

TEST_F(ProgramVerify, NamesAKernelThatHangs) {
  const Outcome outcome = run({"verify", "--device", "cpu", "--size", "small", "--kernel",
                               "select_near", "--timeout", "4", "--json", "v.json"},
                              faulty("select_near", kEndlessLoop, path("cache")));
  EXPECT_EQ(outcome.exit_code, 1) << outcome.err;
  const auto json = nlohmann::json::parse(read("v.json"));
  std::vector<std::string> results;
  for (const auto& row : json["rows"]) {
    EXPECT_EQ(row["kernel"], "select_near");
    results.push_back(row["result"]);
    const char* const why = row["result"] == "fail"
                                ? "while it ran, the process gave no sign for 4 s and was ended"
                                : "left out: it crashed or hung before";
    EXPECT_THAT(row["reason"].get<std::string>(), HasSubstr(why));
  }
  EXPECT_THAT(results, testing::ElementsAre("fail", "fail", "skip", "skip"))
      << "one for each variant, and a wait for two of them";
}

// Stopped while a kernel hangs, so that the moment is known: its first failure is a line, which
// says that all before it is compared and that the next process is under way.
TEST_F(ProgramVerify, StoppedBySignalsItKeepsWhatItFound) {
  for (const int signal : {SIGINT, SIGTERM}) {
    const int process =
        start({"verify", "--device", "cpu", "--size", "small", "--kernel", "bound_bins,select_near",
               "--timeout", "4", "--json", "v.json", "--junit", "v.xml", "--html", "v.html"},
              faulty("select_near", kEndlessLoop, path("cache")));
    while (read("stderr.log").find("FAILED kernel select_near") == std::string::npos &&
           kill(process, 0) == 0)
      std::this_thread::sleep_for(std::chrono::milliseconds(20));
    kill(process, signal);
    kill(process, signal);  // as `timeout` does
    const Outcome outcome = wait_for(process);
    const std::string name = signal == SIGINT ? "signal 2 (Interrupt)" : "signal 15 (Terminated)";
    expect_error(outcome, 128 + signal, {"verify was stopped by " + name, "unfinished"});
    EXPECT_THAT(outcome.out, AllOf(HasSubstr("UNFINISHED: stopped by " + name + " after "),
                                   HasSubstr("; not run: "), HasSubstr("  FAILED, ")));
    const auto json = nlohmann::json::parse(read("v.json"));
    EXPECT_THAT(json["devices"][0]["unfinished"].get<std::string>(), HasSubstr(name));
    std::map<std::string, int> passed;
    for (const auto& row : json["rows"])
      if (row["result"] == "pass") ++passed[row["kernel"]];
    EXPECT_GT(passed["bound_bins"], 0) << json.dump(1);
    EXPECT_THAT(read("v.xml"), HasSubstr("<error message=\"stopped by " + name));
    EXPECT_THAT(read("v.html"), HasSubstr("<strong>Unfinished:</strong> stopped by " + name));
    const Outcome compared = run({"verify", "--compare", "v.json", "v.json"});
    EXPECT_EQ(compared.exit_code, 1);
    EXPECT_THAT(compared.out, HasSubstr("UNFINISHED: stopped by " + name));
  }
}

// A kernel that crashes in the vector width that is not used is still tried in the one that is.
TEST_F(ProgramVerify, WhatIsNotRequiredCostsNothingThatIs) {
  const Outcome outcome =
      run({"verify", "--device", "cpu", "--size", "small", "--kernel", "smooth_columns", "--json",
           "v.json"},
          faulty("smooth_columns", std::string("\n#if WIDTH == 1\n") + kWildStore + "\n#endif\n",
                 path("cache")));
  EXPECT_EQ(outcome.exit_code, 0) << outcome.out << outcome.err;
  const auto json = nlohmann::json::parse(read("v.json"));
  int failed = 0, left_out = 0;
  for (const auto& row : json["rows"]) {
    const bool one = row["variant"].get<std::string>().starts_with("width 1");
    EXPECT_TRUE(one || row["result"] == "pass") << row;
    failed += row["result"] == "fail";
    left_out += row["result"] == "skip";
  }
  EXPECT_EQ(failed, 2);
  EXPECT_GT(left_out, 2);
}

// Where nobody waits for each launch, it may be another one's fault that the process ends: a second
// process waits, and so can name the kernel.
TEST_F(ProgramVerify, NamesAKernelThatCrashesBehindTheHostsBack) {
  const Outcome outcome = run({"verify", "--device", "cpu", "--size", "small", "--kernel",
                               "smooth_columns", "--json", "v.json"},
                              faulty("smooth_columns", "unwatched", path("cache")));
  EXPECT_EQ(outcome.exit_code, 1) << outcome.err;
  const auto json = nlohmann::json::parse(read("v.json"));
  std::vector<std::string> named;
  for (const auto& row : json["rows"]) {
    EXPECT_EQ(row["result"], row["group"] == "kernel" ? "pass" : "fail") << row;
    if (row["group"] == "kernel") continue;
    EXPECT_EQ(row["group"], "reference");
    named.push_back(row["kernel"]);
    EXPECT_THAT(row["reason"].get<std::string>(),
                HasSubstr("while it ran, the process was ended by signal 9"));
  }
  EXPECT_THAT(named, testing::ElementsAre("smooth_columns", "smooth_columns"))
      << "in both vector widths, and each once";
}

TEST_F(ProgramVerify, RepeatsLaunches) {
  // A count in the buffer's padding, which stays from run to run: from the second on a value is
  // missing.
  const Conditions forgetful =
      faulty("smooth_columns",
             "if (get_global_id(0) + get_global_id(1) == 0 &&"
             "    atomic_inc((volatile global int*)smoothed + WIDTH + ny * nx + 64) > 0) return;",
             path("cache"));
  const std::vector<std::string> command{
      "verify",   "--device",       "cpu",    "--size", "small",
      "--kernel", "smooth_columns", "--json", "v.json", "--repeat"};
  const auto rows_of = [&](const char* runs) {
    std::vector<std::string> words = command;
    words.push_back(runs);
    run(words, forgetful);
    const auto json = nlohmann::json::parse(read("v.json"));
    std::vector<std::string> reasons;
    for (const auto& row : json["rows"])
      if (row["group"] == "kernel") reasons.push_back(row["reason"]);
    return reasons;
  };
  const std::vector<std::string> once = rows_of("1"), twice = rows_of("2");
  EXPECT_THAT(once, testing::Each(""));
  ASSERT_EQ(once.size(), 16u) << "four cases in four variants";
  EXPECT_EQ(twice.size(), once.size());
  EXPECT_THAT(twice,
              testing::Each(AllOf(HasSubstr("differs from run to run: launch "),
                                  HasSubstr("run 2 is not like run 1: argument smoothed: "))));
}

TEST_F(ProgramVerify, ReproducersWantAFolderOfTheirOwn) {
  std::filesystem::create_directory(path("full"));
  write("full/file", "");
  write("file", "");
  const std::vector<std::string> command{"verify", "--device", "cpu",        "--size",
                                         "small",  "--kernel", "bound_bins", "--repro"};
  const auto with = [&](const char* folder) {
    std::vector<std::string> words = command;
    words.push_back(folder);
    return run(words);
  };
  expect_error(with("full"), 2, {"full: is not empty, wanted a folder that is empty or not there"});
  expect_error(with("file"), 2, {"file: is no folder"});
  expect_error(with("file/below"), 1, {"file/below: cannot be written: Not a directory"});
  const Outcome outcome = with("new/folder");
  EXPECT_EQ(outcome.exit_code, 0) << outcome.err;
  EXPECT_THAT(outcome.err, HasSubstr("no launch failed: there is no reproducer"));
  EXPECT_FALSE(exists("new/folder"));
}

TEST_F(ProgramVerify, JudgesKernelsOfOthers) {
  const auto example = [&](const std::string& name) {
    const std::string path = MENISCUS_KERNELS "/" + name;
    return run({"verify", "--device", "cpu", "--program", path + ".cl", "--manifest",
                path + ".json", "--json", "v.json"});
  };
  const Outcome right = example("chain_sums");
  EXPECT_EQ(right.exit_code, 0) << right.out << right.err;
  EXPECT_THAT(right.out, AllOf(HasSubstr("programs    2 passed"), HasSubstr("PASSED"),
                               Not(HasSubstr("canonical bits"))));

  const Outcome race = example("racing_chain_sums");
  EXPECT_EQ(race.exit_code, 1) << race.out << race.err;
  const auto json = nlohmann::json::parse(read("v.json"));
  ASSERT_EQ(json["rows"].size(), 1u);
  EXPECT_EQ(json["rows"][0]["kernel"], "racing_chain_sums");
  EXPECT_THAT(json["rows"][0]["reason"].get<std::string>(),
              HasSubstr("is not like run 1: argument sum: "));
  for (const char* name : {"chain_sums.json", "racing_chain_sums.json"}) {
    std::ifstream manifest(std::string(MENISCUS_KERNELS "/") + name);
    const auto lines = std::count(std::istreambuf_iterator<char>(manifest), {}, '\n');
    EXPECT_LE(lines, 20) << name;
  }
}

TEST_F(ProgramVerify, KernelsOfOthersThatDoNotRunAreFailures) {
  write("k.cl", "kernel void k(global int* to) { for (volatile int again = 1; again;) {} }");
  write("m.json", R"({"kernel": "k", "range": [1], "arguments": [{"type": "int", "count": 1}]})");
  const auto verify = [&](const std::vector<std::string>& more) {
    return run(Words{"verify", "--program", "k.cl", "--manifest", "m.json"} + more);
  };
  const Outcome hang = verify({"--device", "cpu", "--timeout", "3"});
  EXPECT_EQ(hang.exit_code, 1);
  EXPECT_THAT(hang.out, HasSubstr("FAILED program k"));
  EXPECT_THAT(hang.out, HasSubstr("while it ran, the process gave no sign for 3 s"));

  write("k.cl", "kernel void k(global int* to) {\n  *to = missing;\n}");
  const Outcome none = verify({"--device", "cpu"});
  EXPECT_EQ(none.exit_code, 1);
  EXPECT_THAT(none.out, HasSubstr("it did not build: "));
  EXPECT_THAT(none.out, HasSubstr("k.cl:2:9: use of undeclared identifier 'missing'"));

  expect_error(verify({"--device", "no such"}), 1, {"no usable OpenCL device matches"});
  expect_error(verify({"--repeat", "2"}), 2, {"--repeat and --program are both given"});
  expect_error(verify({"--json", "m.json"}), 2, {"m.json", "is the input"});
  expect_error(run({"verify", "--program", "k.cl"}), 2, {"--program requires --manifest"});
  write("m.json", "{");
  expect_error(verify({}), 1, {"m.json: is not JSON"});
}

TEST_F(ProgramVerify, NothingToCompareIsNoSuccess) {
  write("k.cl", "kernel void k(global int* to) { *to = 1; }");
  write("m.json", R"({"kernel": "k", "range": [1], "repeat": 1,
                      "arguments": [{"type": "int", "count": 1}]})");
  const Outcome outcome =
      run({"verify", "--device", "cpu", "--program", "k.cl", "--manifest", "m.json"});
  EXPECT_EQ(outcome.exit_code, 1);
  EXPECT_THAT(outcome.out,
              AllOf(HasSubstr("there is nothing to compare with"), HasSubstr("not verified")));
}

TEST_F(ProgramVerify, TextsOfFilesThatAreComparedSteerNoTerminal) {
  write("a.json", R"({"meniscus": "0", "devices": [
    {"name": "a", "platform": "p", "driver": "1", "version": "1", "seconds": 1},
    {"name": "b", "platform": "p", "driver": "1", "version": "1\u001b[2J", "seconds": 1}],
    "rows": [{"index": 1, "group": "kernel", "device": "b", "kernel": "k\u0007", "variant": "",
    "size": "", "result": "fail", "ulp": null, "reason": "\u001b[31m", "ms": 1, "required": true,
    "section": ""}]})");
  const Outcome outcome = run({"verify", "--compare", "a.json"});
  EXPECT_EQ(outcome.exit_code, 1) << outcome.err;
  EXPECT_THAT(outcome.out, testing::AllOf(HasSubstr("k\\x07"), HasSubstr("\\x1b[31m"),
                                          testing::Not(HasSubstr("\x1b"))));
}

}  // namespace
}  // namespace meniscus::test
