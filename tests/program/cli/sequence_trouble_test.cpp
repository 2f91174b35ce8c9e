// Sequences with bad frames, too little memory or disk, and signals: no frame is lost or
// half-written.
#include <gmock/gmock.h>
#include <sys/mount.h>
#include <sys/stat.h>

#include <chrono>
#include <csignal>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <random>
#include <thread>

#include "program/cli/sequence_frames.hpp"

namespace meniscus::test {
namespace {

namespace fs = std::filesystem;
using testing::HasSubstr;
using testing::IsEmpty;

// A frame of this size and a radius in another unit take half a minute.
TEST_F(Sequence, WarnsOfAWrongUnitWhileTheFirstFramesAreUnderWay) {
  for (const char* name : {"d.1.ply", "d.2.ply"})
    run_well({"generate", "--particles", "300000", "-o", name, "-q"});
  const int process = start({"mesh", "d.#.ply", "-o", "m.#.ply", "-r", "0.0005", "--log",
                             "log.jsonl", "--in-flight", "2"});
  std::string err;
  for (int k = 0; k < 3000 && err.find("would fit") == std::string::npos; ++k) {
    std::this_thread::sleep_for(std::chrono::milliseconds(20));
    err = read("stderr.log");
  }
  std::this_thread::sleep_for(
      std::chrono::seconds(1));  // in which the other frame could say so, too
  EXPECT_EQ(kill(process, SIGKILL), 0);
  const Outcome outcome = wait_for(process);
  EXPECT_EQ(outcome.exit_code, 128 + SIGKILL) << "it had ended";
  EXPECT_THAT(outcome.err, testing::ContainsRegex("meniscus: warning: frame [12]: d.[12].ply: a "
                                                  "particle radius of 0.0005 means"));
  EXPECT_EQ(outcome.err.find("would fit"), outcome.err.rfind("would fit")) << outcome.err;
  EXPECT_EQ(read("log.jsonl"), "");
}

// Both frames have it; it is printed when it is known, and at the end for all.
TEST_F(Sequence, WarnsOfEachKindOnceAndAtTheEndForAllFrames) {
  for (int frame = 0; frame < 2; ++frame) write_particles(name("d.", frame, ".ply"), block(12));
  const Outcome outcome = run_well(words({"-r", "20", "--log", "log.jsonl"}));
  std::size_t lines = 0;
  for (std::size_t at = 0; (at = outcome.err.find("would fit", at)) != std::string::npos; ++at)
    ++lines;
  EXPECT_EQ(lines, 2u) << outcome.err;
  EXPECT_THAT(outcome.err, HasSubstr("warning: 2 frames 0,1: a particle radius of 20 means"));
  for (const nlohmann::json& record : log("log.jsonl"))
    EXPECT_THAT(record["warnings"].dump(), HasSubstr("would fit"));
}

TEST_F(Sequence, BadFramesDoNotStopTheOthers) {
  write_sequence(7);
  const std::string good = read("d.0001.ply");
  write("d.0001.ply", good.substr(0, good.size() / 2));  // cut off
  write("d.0003.ply", "");
  write("d.0004.ply",
        "ply\nformat ascii 1.0\nelement vertex 1\nproperty float x\nproperty float "
        "y\nproperty float z\nend_header\nnan 0 0\n");
  const Outcome outcome = run(words({"--log", "log.jsonl", "--strict"}));
  expect_error(outcome, 3, {"3 of 7 frames failed: 1,3,4"});
  for (const char* part : {"meniscus: error: frame 1: d.0001.ply: ",
                           "error: frame 3: d.0003.ply: is empty", "error: frame 4: d.0004.ply: "})
    EXPECT_THAT(outcome.err, HasSubstr(part));
  EXPECT_EQ(outputs().size(), 12u);
  EXPECT_THAT(temporary_files(), IsEmpty());
  int failed = 0;
  for (const nlohmann::json& record : log("log.jsonl")) {
    const bool bad = record["frame"] == 1 || record["frame"] == 3 || record["frame"] == 4;
    EXPECT_EQ(record["status"], bad ? "failed" : "done");
    failed += bad;
    EXPECT_EQ(record["hash"].get<std::string>().size(), bad ? 0u : 16u) << record;
    EXPECT_EQ(record.contains("error"), bad) << record;
  }
  EXPECT_EQ(failed, 3);

  // Without --strict the NaN is dropped, which must leave some particles.
  const Outcome lenient = run(words({"--frames", "4"}));
  expect_error(lenient, 3, {"1 of 1 frame failed: 4"});
  EXPECT_THAT(lenient.err, HasSubstr("d.0004.ply: 1 of 1 particles have NaN"));

  // What several frames warn of is said once, and of which at the end.
  write_particles("d.0003.ply", {{0, 0, 0}, {std::nan(""), 0, 0}});
  write_particles("d.0004.ply", {{0, 0, 0}, {0, std::nan(""), 0}, {0, 0, 1}});
  const Outcome several = run_well(words({"--frames", "3-4"}));
  EXPECT_THAT(several.err, HasSubstr("meniscus: warning: 2 frames 3,4: 1 of "));
  EXPECT_THAT(several.err, HasSubstr("the others differ in their numbers"));
  // What a single one of many warns of is said again, too.
  const Outcome single = run(words({"--frames", "2-3"}));
  EXPECT_THAT(single.err, HasSubstr("meniscus: warning: frame 3: d.0003.ply: 1 of "));
  EXPECT_THAT(single.err, HasSubstr("meniscus: warning: frame 3: 1 of "));

  for (const auto& [file, bytes] : outputs()) fs::remove(path(file));
  const Outcome fast = run(words({"--fail-fast", "--in-flight", "1", "--threads", "1"}));
  EXPECT_EQ(fast.exit_code, 3) << fast.err;
  EXPECT_LT(outputs().size(), 12u);
}

// PoCL hangs or aborts in its locks where it gets no memory, so that what has no room is not begun.
TEST_F(Sequence, ALimitOnMemoryEndsInDoneFramesOrOneLine) {
  write_sequence(4);
  for (const int megabytes : {350, 450, 550, 650, 800, 1200, 1600}) {
    SCOPED_TRACE(megabytes);
    const Conditions limited{
        {},
        0,
        {"/bin/sh", "-c",
         "ulimit -v " + std::to_string(1024 * megabytes) + "; exec timeout -s KILL 60 \"$@\"",
         "sh"}};
    const Outcome outcome = run({"extract", "d.####.ply", "--size", "1024x768", "-o", "o.####.exr",
                                 "--aov", "N", "--in-flight", "4"},
                                limited);
    if (outcome.exit_code == 0)
      EXPECT_EQ(outputs().size(), 4u);
    else
      expect_error(outcome, 1, {"MB"});
    EXPECT_THAT(temporary_files(), IsEmpty());
    for (const auto& [file, bytes] : outputs()) fs::remove(path(file));
  }
}

TEST_F(Sequence, NobodyWaitsForAPipe) {
  write_sequence(2);
  ASSERT_EQ(mkfifo(path("d.0002.ply").c_str(), 0600), 0);
  ASSERT_EQ(mkfifo(path("camera.json").c_str(), 0600), 0);
  const Outcome frames = run(words(), in_time(60));
  expect_error(frames, 3, {"1 of 3 frames failed: 2"});
  EXPECT_THAT(frames.err, HasSubstr("d.0002.ply: is a pipe or a device, wanted a file"));
  expect_error(
      run({"extract", "d.####.ply", "--frames", "0", "--camera", "camera.json", "-o", "o.####.png"},
          in_time(60)),
      1, {"camera.json: is a pipe or a device, wanted a file"});
  expect_error(run({"extract", "d.0002.ply", "-o", "o.png"}, in_time(60)), 1, {"is a pipe"});
}

TEST_F(Sequence, GoesOnWhenNobodyListens) {
  write_sequence(6);
  // As `meniscus ... 2>&1 | head -1` in a shell; the pipe's reader is gone after the first line.
  const Conditions unheard{
      {}, 0, {"/bin/sh", "-c", "{ \"$@\" 2>&1; echo $? > code; } | head -n 1; sleep 0", "sh"}};
  run(words({"--in-flight", "1", "--threads", "1"}), unheard);
  for (int wait = 0; !exists("code") && wait < 600; ++wait)
    std::this_thread::sleep_for(std::chrono::milliseconds(100));
  EXPECT_EQ(read("code"), "0\n");
  EXPECT_EQ(outputs().size(), 18u);
  EXPECT_THAT(temporary_files(), IsEmpty());
}

// Of each run some frames are done when it is killed: a run that ended first proves nothing.
TEST_F(Sequence, KilledAtAnyMomentAndResumed) {
  write_sequence(8);
  // How long the frames take: a run less its start, which may build kernels.
  const int whole = start(words({"-q"}));
  for (int wait = 0; outputs().empty() && wait < 60'000; ++wait)
    std::this_thread::sleep_for(std::chrono::milliseconds(1));
  const auto first = std::chrono::steady_clock::now();
  ASSERT_EQ(wait_for(whole).exit_code, 0);
  const auto frames_took = std::chrono::steady_clock::now() - first;
  const auto undisturbed = outputs();
  for (const auto& [file, bytes] : undisturbed) fs::remove(path(file));
  std::mt19937 random(1);
  int killed = 0;
  for (int k = 0; k < 10; ++k) {
    const std::size_t before = outputs().size();
    const int process = start(words({"-q", "--resume"}));
    // Before the first output of this run, or after it; then up to the time that two frames take.
    const bool at_once = k % 5 == 4;
    for (int wait = 0; !at_once && outputs().size() <= before && wait < 10'000; ++wait)
      std::this_thread::sleep_for(std::chrono::milliseconds(1));
    std::this_thread::sleep_for(frames_took / 4 * (random() % 1000) / 1000.0);
    kill(process, SIGKILL);
    killed += wait_for(process).exit_code == 128 + SIGKILL;
    for (const auto& [file, bytes] : outputs()) EXPECT_EQ(bytes, undisturbed.at(file)) << file;
    if (outputs().size() > undisturbed.size() / 2)
      for (const auto& [file, bytes] : outputs()) fs::remove(path(file));
  }
  // At least half of a run is left when it is killed, at most a quarter and a frame of it pass.
  EXPECT_GE(killed, 5);
  run_well(words({"--resume"}));
  EXPECT_EQ(outputs(), undisturbed);
  EXPECT_THAT(temporary_files(), IsEmpty());
}

TEST_F(Sequence, SigtermFinishesTheFramesUnderWay) {
  write_sequence(60);
  const int process = start(words({"--log", "log.jsonl"}));
  while (!exists("log.jsonl") || read("log.jsonl").empty())
    std::this_thread::sleep_for(std::chrono::milliseconds(5));
  kill(process, SIGTERM);
  const Outcome stopped = wait_for(process);
  expect_error(stopped, 128 + SIGTERM, {"stopped by signal 15", "frames left", "--resume goes on"});
  EXPECT_THAT(temporary_files(), IsEmpty());
  const std::size_t done = log("log.jsonl").size();
  EXPECT_LT(done, 60u);
  EXPECT_EQ(outputs().size(), 3 * done);  // whole frames only
  const Outcome rest = run_well(words({"--resume", "--log", "log.jsonl"}));
  EXPECT_THAT(rest.err, HasSubstr(std::to_string(done) + " were there already"));
  EXPECT_EQ(outputs().size(), 180u);
}

TEST_F(Sequence, AFullDiskEndsTheBatch) {
  write_sequence(5);
  // An EXR of that size has 13 MB; the files of the OpenCL compiler stay below the limit.
  std::vector<std::string> all{"extract", "d.####.ply",    "-o",  "o.####.exr", "--size",
                               "640x480", "--compression", "none"};
  const Outcome outcome = run(all, {{}, 4'000'000});
  expect_error(outcome, 1,
               {"cannot be written: File too large", "0 of 5 frames are done", "--resume"});
  EXPECT_THAT(outputs(), IsEmpty());
  EXPECT_THAT(temporary_files(), IsEmpty());
  all.insert(all.end(), {"--resume", "--frames", "0,1"});
  run_well(all);
  all.back() = "0-4";
  expect_error(run(all, {{}, 4'000'000}), 1, {"2 of 5 frames are done"});  // those two count
  expect_error(run(words({"--log", "/dev/full"})), 1,
               {"/dev/full: cannot be written: No space left on device (free some space",
                "of 5 frames are done; the same command with --resume goes on"});
}

// The page's error took the place of the last words, and of the exit code.
TEST_F(Sequence, APageThatCannotBeWrittenHidesNothing) {
  write_sequence(3);
  write("d.0001.ply", "");
  fs::create_directory(path("disk"));
  if (mount("tmpfs", path("disk").c_str(), "tmpfs", 0, "size=8k") != 0)
    GTEST_SKIP() << "no file system may be mounted here";
  const Outcome outcome = run(words({"--report", "disk/page.html"}));
  EXPECT_TRUE(fs::is_empty(path("disk")));
  umount(path("disk").c_str());
  EXPECT_EQ(outcome.exit_code, 3);
  EXPECT_THAT(outcome.err, HasSubstr("error: disk/page.html: cannot be written: No space left"));
  EXPECT_THAT(outcome.err, HasSubstr("meniscus: error: 1 of 3 frames failed: 1"));
}

}  // namespace
}  // namespace meniscus::test
