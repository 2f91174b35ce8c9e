// What `meniscus bench` says of the kernels.
#include <gmock/gmock.h>
#include <unistd.h>

#include <chrono>
#include <csignal>
#include <nlohmann/json.hpp>
#include <set>
#include <thread>

#include "program/cli/program.hpp"

namespace meniscus::test {
namespace {

using testing::AllOf;
using testing::HasSubstr;
using testing::IsEmpty;
using testing::Not;

using ProgramBenchKernels = Program;

std::vector<std::string> tiny(std::vector<std::string> more) {
  return Words{"bench",    "--particles", "500",           "--size", "64x48",
               "--kernel", "fit_part",    "--repetitions", "2"} +
         more;
}

TEST_F(ProgramBenchKernels, HelpFitsATerminalAndNamesEveryOption) {
  const Outcome outcome = run({"bench", "--help"});
  EXPECT_EQ(outcome.exit_code, 0);
  std::istringstream lines(outcome.out);
  for (std::string line; std::getline(lines, line);) EXPECT_LE(line.size(), 100u) << line;
  for (const char* option : {"--device", "--kernel", "--particles", "--size", "--threads",
                             "--repetitions", "--json", "--html", "--compare", "--quiet"})
    EXPECT_THAT(outcome.out, HasSubstr(option));
}

TEST_F(ProgramBenchKernels, WritesTableJsonAndPage) {
  const Outcome outcome = run_well(tiny({"--json", "new.json", "--html", "new.html"}));
  EXPECT_THAT(outcome.out, HasSubstr("fit_particles"));
  EXPECT_THAT(outcome.out, HasSubstr("At the roofline"));
  EXPECT_THAT(outcome.out, Not(HasSubstr("differences")));
  EXPECT_THAT(outcome.err, HasSubstr("measuring  fit_particles, 500 particles"));
  EXPECT_THAT(read("new.html"), HasSubstr("fit_particles"));
  const auto json = nlohmann::json::parse(read("new.json"));
  const auto& sessions = json.at("sessions");
  ASSERT_FALSE(sessions.empty());
  // A CPU with several cores is measured on one, too, by a second process.
  if (sessions[0].at("kind") == "CPU" && sessions[0].at("compute_units") > 1) {
    ASSERT_EQ(sessions.size(), 2u);
    EXPECT_EQ(sessions[1].at("threads"), 1);
    EXPECT_EQ(sessions[1].at("results").size(), sessions[0].at("results").size());
  }
  for (const auto& session : sessions)
    for (const auto& result : session.at("results")) {
      EXPECT_EQ(result.at("kernel"), "fit_particles");
      EXPECT_EQ(result.at("particles"), 500);
      EXPECT_EQ(result.at("width"), 64);
      EXPECT_GE(result.at("ms").size(), 2u);
      EXPECT_FALSE(result.contains("note")) << result.at("note");
    }
  EXPECT_THAT(files(), testing::ElementsAre("new.html", "new.json"));
}

// What serves as a control alone takes no time of a run that nothing is compared with.
TEST_F(ProgramBenchKernels, NativeVersionsThatAreAControlAloneRunWhereOneIsWanted) {
  run_well(tiny({"-q", "--json", "kept.json"}));
  const auto json = nlohmann::json::parse(read("kept.json"));
  const auto& session = json.at("sessions").at(0);
  if (session.at("kind") != "CPU" || session.at("native_benchmarks"))
    GTEST_SKIP() << "native versions count here, or there are none";
  const auto natives = [](const std::string& text) {
    std::size_t count = 0;
    for (std::size_t at = 0; (at = text.find(" native* ", at)) != std::string::npos; ++at) ++count;
    return count;
  };
  const std::string left_out = "warning: native versions were left out";
  const std::size_t sessions = json.at("sessions").size();
  for (const auto& each : json.at("sessions")) EXPECT_EQ(each.at("results").size(), 2u);
  const Outcome plain = run_well(tiny({"-q"}));
  EXPECT_EQ(natives(plain.out), 0u) << plain.out;
  EXPECT_THAT(plain.out, HasSubstr(left_out));
  const Outcome compared = run_well(tiny({"-q", "--compare", "kept.json"}));
  EXPECT_GE(natives(compared.out), sessions) << compared.out;
  EXPECT_THAT(compared.out, Not(HasSubstr(left_out)));
}

TEST_F(ProgramBenchKernels, StoppedByASignalItKeepsWhatItMeasured) {
  const int process =
      start({"bench", "--particles", "500", "--size", "64x48", "--json", "new.json"});
  const auto measuring = [&] {
    const std::string err = read("stderr.log");
    int lines = 0;
    for (std::size_t at = 0; (at = err.find("measuring  ", at)) != std::string::npos; ++at) ++lines;
    return lines;
  };
  // The roofline and a kernel are measured, and dozens are to come.
  while (measuring() < 3 && kill(process, 0) == 0)
    std::this_thread::sleep_for(std::chrono::milliseconds(1));
  kill(process, SIGINT);
  const Outcome outcome = wait_for(process);
  expect_error(outcome, 128 + SIGINT, {"bench was stopped by signal 2", "unfinished"});
  EXPECT_THAT(outcome.out,
              AllOf(HasSubstr("UNFINISHED: stopped by signal 2"), HasSubstr(" kernels and sizes")));
  const auto json = nlohmann::json::parse(read("new.json"));
  EXPECT_THAT(json.at("sessions").at(0).at("unfinished").get<std::string>(),
              HasSubstr("stopped by signal 2 (Interrupt) after "));
  EXPECT_GT(json.at("sessions").at(0).at("results").size(), 0u);
  EXPECT_THAT(run_well({"bench", "--compare", "new.json", "new.json"}).out,
              HasSubstr("before: UNFINISHED: stopped by signal 2"));
}

TEST_F(ProgramBenchKernels, JsonGoesToStandardOutputAlone) {
  const Outcome outcome = run_well(tiny({"--json", "-", "-q", "--threads", "1"}));
  EXPECT_THAT(outcome.err, IsEmpty());
  const auto json = nlohmann::json::parse(outcome.out);
  EXPECT_EQ(json.at("sessions").size(), 1u);
  EXPECT_THAT(files(), IsEmpty());
}

TEST_F(ProgramBenchKernels, ComparesWithAnEarlierRun) {
  run_well(tiny({"-q", "--threads", "1", "--json", "old.json"}));
  // The same again, but as if the device had been a thousand times as slow, without noise: this
  // run's noise, a part of this run's small time, cannot reach that far. What the native version
  // took spreads so far that it has not moved.
  auto json = nlohmann::json::parse(read("old.json"));
  const auto compared = [&] {
    write("old.json", json.dump());
    const Outcome outcome =
        run_well(tiny({"-q", "--threads", "1", "--compare", "old.json", "--html", "page.html"}));
    EXPECT_THAT(read("page.html"), HasSubstr("<h2>Comparison"));
    return outcome.out;
  };
  auto& results = json["sessions"][0]["results"];
  ASSERT_EQ(results.size(), 2u);
  for (auto& result : results) {
    const double best = result["best_ms"];
    if (result["variant"] == "native")
      result["ms"] = {best, 1000 * best, 1000 * best, 1000 * best};
    else
      for (auto& ms : result["ms"]) ms = 1000 * best;
  }
  std::string out = compared();
  EXPECT_THAT(out, HasSubstr("faster"));
  EXPECT_THAT(out, HasSubstr("before: old.json: "));
  EXPECT_THAT(out, HasSubstr("1 of 1 kernel time changed by more than the noise\n"));
  // Where the native version has moved as far, the machine has.
  for (auto& result : results)
    for (auto& ms : result["ms"]) ms = 1000 * result["best_ms"].get<double>();
  out = compared();
  EXPECT_THAT(out, HasSubstr("undecided"));
  EXPECT_THAT(out, HasSubstr("0 of 1 kernel time changed by more than the noise, 1 undecided"));
}

TEST_F(ProgramBenchKernels, ComparesTwoEarlierRunsAndMeasuresNothing) {
  run_well(tiny({"-q", "--threads", "1", "--json", "old.json"}));
  auto json = nlohmann::json::parse(read("old.json"));
  for (auto& result : json["sessions"][0]["results"])
    if (result["variant"] == "device") result["ms"] = {1000 * result["best_ms"].get<double>()};
  write("new.json", json.dump());
  const Outcome outcome =
      run_well({"bench", "--compare", "old.json", "new.json", "--html", "page.html"});
  EXPECT_THAT(outcome.err, IsEmpty());
  EXPECT_THAT(outcome.out, AllOf(HasSubstr("before: old.json: "), HasSubstr("after:  new.json: "),
                                 HasSubstr(" slower\n")));
  EXPECT_THAT(read("page.html"), HasSubstr("<h2>Comparison"));
  expect_error(run({"bench", "--compare", "old.json", "new.json", "--threads", "1"}), 2,
               {"--threads is given with two files of --compare"});
  expect_error(run({"bench", "--compare", "old.json", "none.json"}), 1, {"none.json"});
}

TEST_F(ProgramBenchKernels, WhatCannotBeComparedIsNotMeasured) {
  run_well(tiny({"-q", "--threads", "1", "--json", "old.json"}));
  const Outcome none = run({"bench", "--particles", "600", "--size", "64x48", "--kernel",
                            "fit_particles", "--compare", "old.json", "--json", "new.json"});
  expect_error(
      none, 2,
      {"--compare: old.json has none of these kernels at these sizes", "500 particles at 64x48"});
  EXPECT_THAT(none.err, Not(HasSubstr("measuring")));
  auto json = nlohmann::json::parse(read("old.json"));
  json["sessions"][0]["device"] = "Other";
  write("old.json", json.dump());
  const Outcome other = run_well(tiny({"--threads", "1", "--compare", "old.json"}));
  EXPECT_THAT(other.err, HasSubstr("warning: --compare: old.json is of Other, this run is of "));
}

TEST_F(ProgramBenchKernels, ListsItsKernels) {
  const Outcome outcome = run_well({"bench", "--list"});
  EXPECT_THAT(outcome.out, HasSubstr("\nfit_particles\n"));
}

TEST_F(ProgramBenchKernels, MoreThreadsThanProcessorsAreWarnedOf) {
  const Outcome outcome = run_well(tiny({"-q", "--threads", "100"}));
  EXPECT_THAT(outcome.err, HasSubstr("warning: --threads is 100, but there are "));
}

TEST_F(ProgramBenchKernels, KernelsAreAListToo) {
  const Outcome outcome =
      run_well({"bench", "-q", "--threads", "1", "--particles", "500", "--size", "64x48",
                "--repetitions", "2", "--json", "-", "--kernel", "smooth_rows,depth_normals"});
  std::set<std::string> kernels;
  const auto json = nlohmann::json::parse(outcome.out);
  for (const auto& result : json["sessions"][0]["results"]) kernels.insert(result["kernel"]);
  EXPECT_THAT(kernels, testing::ElementsAre("depth_normals", "smooth_rows"));
}

TEST_F(ProgramBenchKernels, WrongOptionsAreOneLineAndExitCodeTwo) {
  expect_error(run({"bench", "--kernel", "polish"}), 2,
               {"--kernel is polish, must be a part of a name (--list has them all"});
  expect_error(run({"bench", "--kernel", "depth_normal_s"}), 2, {"a name such as depth_normals"});
  expect_error(run({"bench", "--kernel", "fit,polish"}), 2, {"--kernel is polish"});
  expect_error(run({"bench", "--particles", "100,many"}), 2, {"--particles is many"});
  expect_error(run({"bench", "--particles", "5"}), 2, {"--particles is 5"});
  expect_error(run({"bench", "--particles", ""}), 2, {"--particles"});
  expect_error(run({"bench", "--size", "64"}), 2, {"--size is 64", "WIDTHxHEIGHT"});
  expect_error(run({"bench", "--kernel", "fit", "frame"}), 2, {"--kernel", "frame"});
  expect_error(run({"bench", "--repetitions", "0"}), 2, {"--repetitions"});
  expect_error(run({"bench", "--threads", "0"}), 2, {"--threads"});
  expect_error(run({"bench", "--json", "a.html", "--html", "./a.html"}), 2,
               {"./a.html", "named twice"});
  expect_error(run({"bench", "--html", "frame.ply"}), 2, {"--html is frame.ply", ".html"});
  expect_error(run({"bench", "extra"}), 2, {"extra"});
}

TEST_F(ProgramBenchKernels, MoreParticlesThanMemoryHoldsAreOneLine) {
  if (sysconf(_SC_PHYS_PAGES) * sysconf(_SC_PAGE_SIZE) > 250'000'000'000)
    GTEST_SKIP() << "the machine has memory for the largest frame";
  expect_error(run({"bench", "--particles", "100,1e9"}), 1,
               {"--particles is 1000000000", "250 GB", "give fewer"});
}

TEST_F(ProgramBenchKernels, FilesThatCannotBeUsedAreNamedBeforeAnythingIsMeasured) {
  expect_error(run(tiny({"--compare", "missing.json"})), 1, {"missing.json"});
  write("wrong.json", "{}");
  expect_error(run(tiny({"--compare", "wrong.json", "--json", "./wrong.json"})), 2,
               {"output ./wrong.json: is the input"});
  expect_error(run(tiny({"--compare", "wrong.json"})), 1, {"wrong.json", "meniscus bench --json"});
  expect_error(run(tiny({"--json", "nowhere/new.json"})), 1, {"nowhere/new.json"});
  expect_error(run(tiny({"--html", "nowhere/new.html"})), 1, {"nowhere/new.html"});
  expect_error(run(tiny({"--device", "no such device"})), 1, {"no such device"});
  EXPECT_THAT(files(), testing::ElementsAre("wrong.json"));
}

}  // namespace
}  // namespace meniscus::test
