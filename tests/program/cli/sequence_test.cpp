// Sequences: which frames come out, and that none is lost or half-written whatever happens.
#include <gmock/gmock.h>
#include <sys/stat.h>
#include <sys/wait.h>
#include <unistd.h>

#include <chrono>
#include <csignal>
#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>
#include <random>
#include <sstream>
#include <thread>

#include "meniscus/camera.hpp"
#include "meniscus/io.hpp"
#include "meniscus/motion.hpp"
#include "program/cli/program.hpp"

namespace meniscus::test {
namespace {

namespace fs = std::filesystem;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;
using testing::Not;

constexpr char kCamera[] =
    R"({"width": 64, "height": 48, "view": [[1,0,0,0],[0,1,0,0],[0,0,1,-4],[0,0,0,1]],
        "projection": [[2,0,0,0],[0,2,0,0],[0,0,-1.02,-0.2],[0,0,-1,0]]})";

class Sequence : public Program {
 protected:
  /// d.0000.ply to d.<n-1>.ply: a block that grows.
  void write_sequence(int n) const {
    for (int frame = 0; frame < n; ++frame)
      write_particles(name("d.", frame, ".ply"), block(3 + frame % 3));
  }

  static std::string name(const std::string& stem, int frame, const std::string& ending) {
    char number[16];
    std::snprintf(number, sizeof number, "%04d", frame);
    return stem + number + ending;
  }

  static std::vector<std::string> words(const std::vector<std::string>& more = {}) {
    std::vector<std::string> all{"extract",    "d.####.ply", "--size",     "64x48", "-o",
                                 "o.####.exr", "-o",         "o.####.png", "-o",    "o.####.ply"};
    all.insert(all.end(), more.begin(), more.end());
    return all;
  }

  /// Bytes of the outputs, by name.
  std::map<std::string, std::string> outputs(const std::string& stem = "o.") const {
    std::map<std::string, std::string> bytes;
    for (const std::string& file : files())
      if (file.starts_with(stem)) bytes[file] = read(file);
    return bytes;
  }

  std::vector<std::string> temporary_files() const {
    std::vector<std::string> names;
    for (const auto& entry : fs::directory_iterator(path("")))
      if (entry.path().filename().string().starts_with("."))
        names.push_back(entry.path().filename());
    return names;
  }

  std::vector<nlohmann::json> log(const std::string& file) const {
    std::vector<nlohmann::json> records;
    std::istringstream lines(read(file));
    for (std::string line; std::getline(lines, line);)
      records.push_back(nlohmann::json::parse(line));
    return records;
  }
};

TEST_F(Sequence, ExtractsEveryFrameAsByItself) {
  write_sequence(4);
  const Outcome outcome = run(words({"--eye", "1,1,3", "--target", "0,0,0"}));
  ASSERT_EQ(outcome.exit_code, 0) << outcome.err;
  EXPECT_EQ(outputs().size(), 12u);
  EXPECT_THAT(outcome.err, HasSubstr("4 frames 0-3"));
  EXPECT_THAT(outcome.err, HasSubstr("frame 3 done"));
  for (int frame = 0; frame < 4; ++frame) {
    ASSERT_EQ(run({"extract", name("d.", frame, ".ply"), "--size", "64x48", "--eye", "1,1,3",
                   "--target", "0,0,0", "-o", "single.exr"})
                  .exit_code,
              0);
    const Surface one = read_exr(path("single.exr")),
                  many = read_exr(path(name("o.", frame, ".exr")));
    EXPECT_EQ(one.depth, many.depth);
    EXPECT_EQ(one.normal, many.normal);
    EXPECT_EQ(one.group, many.group);
  }
}

TEST_F(Sequence, FramesAndCamerasAreChosen) {
  write_sequence(6);
  ASSERT_EQ(run(words({"--frames", "1-5x2,0", "-q"})).exit_code, 0);
  std::vector<std::string> pictures;
  for (const auto& [file, bytes] : outputs())
    if (file.ends_with(".png")) pictures.push_back(file);
  EXPECT_THAT(pictures, ElementsAre("o.0000.png", "o.0001.png", "o.0003.png", "o.0005.png"));

  expect_error(run({"extract", "d.####.ply", "-o", "o.####.exr", "--camera", "c.{}.json"}), 1,
               {"c.{}.json: no file matches"});
  expect_error(run({"extract", "d.###.ply", "-o", "o.####.exr"}), 1,
               {"d.###.ply: no file matches; the nearest is d.0000.ply (write {} "});
  expect_error(run(words({"--log", "nowhere/log.jsonl"})), 1, {"make the folder nowhere first"});
  fs::remove(path("d.0004.ply"));
  expect_error(run(words({"--frames", "3-5"})), 1,
               {"d.####.ply: frame 4 missing", "--missing skip"});
  const Outcome skipped = run(words({"--frames", "3-9", "--missing", "skip"}));
  EXPECT_EQ(skipped.exit_code, 0) << skipped.err;
  EXPECT_THAT(skipped.err, HasSubstr("frame 4 missing and skipped"));
  EXPECT_THAT(skipped.err, HasSubstr("4 frames 6-9 left out: the sequence ends with frame 5"));
  EXPECT_THAT(run(words({"-q"})).err, HasSubstr("d.####.ply: frame 4 is missing"));
  expect_error(run(words({"--frames", "100-110"})), 1,
               {"d.####.ply: none of 11 frames 100-110 is there", "--missing skip"});
  const Outcome beyond = run(words({"--frames", "100-110", "--missing", "skip"}));
  EXPECT_EQ(beyond.exit_code, 0) << beyond.err;
  EXPECT_THAT(beyond.err, HasSubstr("11 frames 100-110 left out"));
}

TEST_F(Sequence, MotionOnTheScreenIsTowardsTheNextFramesCamera) {
  for (int frame = 0; frame < 3; ++frame)
    write_particles(name("d.", frame, ".ply"), block(4), 0.1, "0 1 0");
  nlohmann::json list;
  std::vector<Camera> cameras;
  for (int frame = 0; frame < 3; ++frame) {
    const Camera camera =
        look_at({1 + 0.1 * frame, 1, 3}, {0, 0.1 * frame, 0}, {0, 1, 0}, 40, 64, 48);
    const auto rows = [](const std::array<double, 16>& m) {
      nlohmann::json matrix;
      for (int r = 0; r < 4; ++r)
        matrix.push_back({m[4 * r], m[4 * r + 1], m[4 * r + 2], m[4 * r + 3]});
      return matrix;
    };
    list.push_back({{"frame", frame},
                    {"width", 64},
                    {"height", 48},
                    {"view", rows(camera.view)},
                    {"projection", rows(camera.projection)}});
    cameras.push_back(camera);
  }
  write("c.json", list.dump());
  const std::vector<std::string> all{"extract",    "d.####.ply", "--camera", "c.json",  "-o",
                                     "o.####.exr", "--fps",      "25",       "--resume"};
  ASSERT_EQ(run(all).exit_code, 0);
  for (int frame = 0; frame < 3; ++frame) {
    const Surface surface = read_exr(path(name("o.", frame, ".exr")));
    const ScreenMotion expected =
        screen_motion(surface, cameras[static_cast<std::size_t>(std::min(frame + 1, 2))], 25);
    EXPECT_EQ(surface.forward.pixels, expected.pixels) << frame;
    EXPECT_EQ(surface.forward.frames_per_second, 25);
  }
  // What the next frame's camera is, and the rate, are part of what a frame was made with.
  EXPECT_THAT(run(all).err, HasSubstr("3 were there already"));
  list[2]["view"][0][3] = 0.5;
  write("c.json", list.dump());
  const Outcome moved = run(all);
  EXPECT_THAT(moved.err, HasSubstr("1 was there already"));
  EXPECT_THAT(moved.err, HasSubstr("; again, since o.0001.exr was made with another camera\n"));
  std::vector<std::string> other = all;
  other[7] = "24";
  EXPECT_THAT(run(other).err, HasSubstr("3 frames"));
  EXPECT_EQ(read_exr(path("o.0000.exr")).forward.frames_per_second, 24);
}

TEST_F(Sequence, SaysWhichFramesHaveNoVelocities) {
  std::string declared = "ply\nformat binary_little_endian 1.0\nelement vertex 0\n";
  for (const char* property : {"x", "y", "z", "vx", "vy", "vz"})
    declared.append("property float ").append(property).append("\n");
  write("d.0000.ply", declared + "end_header\n");
  write_particles("d.0001.ply", block(4), 0.1, "0 1 0");
  const std::string what = "the particles carry no velocities";
  const Outcome same = run(words());
  ASSERT_EQ(same.exit_code, 0) << same.err;
  EXPECT_THAT(same.err, Not(HasSubstr(what)));
  const Surface empty = read_exr(path("o.0000.exr"));
  EXPECT_EQ(empty.velocity, std::vector<Vec3>(64 * 48));
  EXPECT_EQ(empty.forward.pixels.size(), 64u * 48u);

  write_particles("d.0002.ply", block(4));
  write_particles("d.0003.ply", block(4));
  const Outcome mixed = run(words({"--log", "log.jsonl"}));
  EXPECT_THAT(mixed.err, HasSubstr("meniscus: warning: 2 frames 2,3: " + what));
  EXPECT_THAT(mixed.err, HasSubstr("which other frames have"));
  for (const nlohmann::json& record : log("log.jsonl"))
    EXPECT_EQ(record["velocities"], record["frame"] < 2) << record;
  EXPECT_THAT(run(words({"--frames", "2-3"})).err, Not(HasSubstr(what)));
  EXPECT_THAT(run(words({"--frames", "2-3", "--aov", "V"})).err,
              HasSubstr("--aov V: 2 frames 2,3: " + what));
  EXPECT_THAT(run({"extract", "d.0002.ply", "--size", "64x48", "-o", "a.exr", "--aov", "V"}).err,
              HasSubstr("meniscus: warning: d.0002.ply: --aov V: " + what));
}

TEST_F(Sequence, WrongUseIsNamed) {
  write_sequence(2);
  expect_error(run(words({"--frames", ""})), 2, {"--frames: is empty"});
  expect_error(run({"extract", "d.####.ply", "-o", "o.exr"}), 2,
               {"output o.exr has no place for the frame's number", "name it o.####.exr"});
  expect_error(run({"extract", "d.####.ply", "-o", "o.exr", "--frames", "1"}), 2,
               {"output o.exr has no place for the frame's number"});
  EXPECT_FALSE(exists("o.exr"));
  expect_error(run({"extract", "d.####.ply", "-o", "d.####.ply"}), 2, {"is the input"});
  std::filesystem::copy_file(MENISCUS_EXAMPLE_DATA "/dam/camera.json", path("c.png"));
  expect_error(run({"extract", "d.####.ply", "--camera", "c.png", "-o", "o.####.exr", "--report",
                    "./c.png"}),
               2, {"output ./c.png: is the camera's file"});
  expect_error(run({"extract", "d.0000.ply", "--camera", "c.png", "-o", "./c.png"}), 2,
               {"output ./c.png: is the camera's file"});
  expect_error(run({"extract", "d.0000.ply", "-o", "o.exr", "--frames", "1-2"}), 2,
               {"--frames is for sequences", "d.0000.ply has no place"});
  expect_error(run({"extract", "e.####.ply", "-o", "o.####.exr"}), 1,
               {"e.####.ply: no file matches"});
  for (const char* absent : {"in/nofolder", "nofolder/frames/", "nofile.ply"})
    for (const char* command : {"extract", "mesh"})
      expect_error(run({command, absent, "-o", "o.####.ply"}), 1,
                   {std::string(absent) + ": no such file or folder"});
  expect_error(run(words({"--timings"})), 2, {"--timings of a sequence", "--log"});
  expect_error(run(words({"--frames", "1-"})), 2, {"frames 1-: \"1-\" is no frame"});
  expect_error(run(words({"--shard", "3/2"})), 2, {"shard 3/2"});
  expect_error(run(words({"--missing", "perhaps"})), 2, {"must be one of fail, skip"});
  expect_error(run({"extract", "d.####.ply", "-o", "nowhere/o.####.exr"}), 1,
               {"nowhere/o.0000.exr: cannot be written", "make the folder nowhere first"});
}

TEST_F(Sequence, AStarIsNoSequence) {
  write_sequence(2);  // 27 and 64 particles
  const Outcome outcome = run({"extract", "d.*.ply", "-o", "o.png", "--size", "64x48"});
  ASSERT_EQ(outcome.exit_code, 0) << outcome.err;
  EXPECT_THAT(outcome.err, HasSubstr("d.*.ply: 91 in 2 files, the parts of one frame"));
  expect_error(run({"extract", "d.*.ply", "-o", "o.####.png"}), 2,
               {"o.####.png has a place", "d.*.ply is one frame (* stands for its parts)"});
  write("o.####.png", "there already");
  expect_error(run({"extract", "d.0000.ply", "-o", "o.####.png"}), 2, {"d.0000.ply is one frame;"});
  EXPECT_EQ(run({"extract", "d.0000.ply", "-o", "o#1.png", "--size", "64x48"}).exit_code, 0);
}

TEST_F(Sequence, OtherFilesAreNotTakenForLogs) {
  write_sequence(2);
  write("notes.txt", "first\nsecond without an end");
  expect_error(run(words({"--log", "notes.txt", "-q"})), 1, {"notes.txt: is no log", "--log"});
  EXPECT_EQ(read("notes.txt"), "first\nsecond without an end");
  EXPECT_THAT(outputs(), IsEmpty());
  expect_error(run(words({"--log", "a", "--report", "./a"})), 2, {"output ./a: is named twice"});
}

TEST_F(Sequence, LogAndReportAreNeitherInputsNorOutputs) {
  write_sequence(2);
  const std::string frame = read("d.0001.ply");
  for (const std::string option : {"--log", "--report"}) {
    expect_error(run(words({option, "./d.0001.ply"})), 2, {"output ./d.0001.ply: is the input"});
    expect_error(run(words({option, "./o.0001.exr"})), 2, {"output ./o.0001.exr: is named twice"});
  }
  EXPECT_EQ(read("d.0001.ply"), frame);
  EXPECT_THAT(outputs(), IsEmpty());
}

TEST_F(Sequence, ShardsTogetherAreTheWhole) {
  write_sequence(5);
  ASSERT_EQ(run(words({"-q"})).exit_code, 0);
  const auto whole = outputs();
  for (const auto& [file, bytes] : whole) fs::remove(path(file));
  ASSERT_EQ(run(words({"-q", "--shard", "1/2"})).exit_code, 0);
  EXPECT_EQ(outputs().size(), 9u);
  const Conditions task{{{"SLURM_ARRAY_TASK_ID", "7"},
                         {"SLURM_ARRAY_TASK_COUNT", "2"},
                         {"SLURM_ARRAY_TASK_MIN", "6"}}};
  const Outcome second = run(words(), task);
  ASSERT_EQ(second.exit_code, 0) << second.err;
  EXPECT_THAT(second.err, HasSubstr("2 of 2 of 5 frames, from SLURM_ARRAY_TASK_ID"));
  Conditions sparse = task;
  sparse.environment[0].second = "9";
  expect_error(run(words(), sparse), 2, {"SLURM_ARRAY_TASK_ID is 9", "gaps", "--shard k/N"});
  EXPECT_EQ(outputs(), whole);
}

TEST_F(Sequence, FramesInATaskOfAnArrayAreSplitOnlyWhereThatIsSaid) {
  write_sequence(4);
  const Conditions task{{{"SLURM_ARRAY_TASK_ID", "2"},
                         {"SLURM_ARRAY_TASK_COUNT", "4"},
                         {"SLURM_ARRAY_TASK_MIN", "0"}}};
  expect_error(run(words({"--frames", "2"}), task), 2,
               {"--frames 2 in task 2", "--shard 1/1", "--shard slurm"});
  EXPECT_THAT(outputs(), IsEmpty());
  ASSERT_EQ(run(words({"--frames", "2", "--shard", "1/1"}), task).exit_code, 0);
  EXPECT_TRUE(exists("o.0002.exr"));
  EXPECT_EQ(outputs().size(), 3u);
  ASSERT_EQ(run(words({"--frames", "1-3", "--shard", "slurm"}), task).exit_code, 0);
  EXPECT_TRUE(exists("o.0003.exr"));  // the third of them
  EXPECT_EQ(outputs().size(), 6u);
  expect_error(run(words({"--shard", "slurm"}),
                   {{{"SLURM_ARRAY_TASK_ID", ""}, {"SLURM_ARRAY_TASK_COUNT", ""}}}),
               2, {"--shard slurm: SLURM_ARRAY_TASK_ID"});
}

TEST_F(Sequence, TwoDevicesGiveTheSameBytes) {
  write_sequence(5);
  ASSERT_EQ(run(words({"-q"})).exit_code, 0);
  const auto one = outputs();
  for (const auto& [file, bytes] : one) fs::remove(path(file));
  const Conditions two{{{"POCL_DEVICES", "pthread pthread"}}};
  // PoCL 3.1 may abort when two of its devices build the same kernel at once for the first time
  // (docs/portability.md), so that each has built all by itself before.
  for (const char* device : {"0", "1"}) {
    ASSERT_EQ(run(words({"-q", "--device", device, "--in-flight", "1"}), two).exit_code, 0);
    EXPECT_EQ(outputs(), one);
    for (const auto& [file, bytes] : one) fs::remove(path(file));
  }
  const Outcome outcome = run(words({"--device", "all", "--log", "log.jsonl"}), two);
  ASSERT_EQ(outcome.exit_code, 0) << outcome.err;
  EXPECT_EQ(outputs(), one);
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
  const Outcome several = run(words({"--frames", "3-4"}));
  EXPECT_EQ(several.exit_code, 0) << several.err;
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

TEST_F(Sequence, OneFrameWithFluidSettlesCameraAndRadius) {
  write_particles("d.0000.ply", {}, 0);  // an emitter has not begun
  const double nan = std::nan("");
  write_particles("d.0001.ply", {{0, 0, 0}, {nan, 0, 0}, {3, 0, 0}, {0, 3, 0}}, 0);  // drops
  write_particles("d.0002.ply", block(7), 0);
  write_particles("d.0003.ply", block(8), 0);
  const Outcome outcome = run(words());
  ASSERT_EQ(outcome.exit_code, 0) << outcome.err;
  EXPECT_THAT(outcome.err,
              HasSubstr("framed around the particles of d.0002.ply, d.0000.ply, d.0003.ply,"));
  EXPECT_THAT(outcome.err, HasSubstr("d.0002.ply, for all frames: no particle radius"));
  // A small block has much surface, which the estimate takes for thinner fluid.
  EXPECT_NEAR(read_exr(path("o.0003.exr")).particle_radius, 0.1, 0.02);
}

TEST_F(Sequence, AFrameWithoutARadiusHasThatOfTheOthers) {
  write_sequence(3);
  write_particles("d.0003.ply", {{0, 0, 0}}, 0);  // a drop
  const std::vector<std::string> all = words({"--resume"});
  const Outcome outcome = run(all);
  ASSERT_EQ(outcome.exit_code, 0) << outcome.err;
  EXPECT_THAT(outcome.err, HasSubstr("frame 3: d.0003.ply: no particle radius in the file: 0.1 of "
                                     "d.0002.ply is used"));
  EXPECT_EQ(read_exr(path("o.0003.exr")).particle_radius,
            read_exr(path("o.0002.exr")).particle_radius);
  EXPECT_THAT(run(all).err, HasSubstr("4 were there already"));
  for (int frame = 0; frame < 3; ++frame)
    write_particles(name("d.", frame, ".ply"), block(3 + frame % 3), 0.2);
  EXPECT_EQ(run(all).exit_code, 0);
  EXPECT_NEAR(read_exr(path("o.0003.exr")).particle_radius, 0.2, 1e-6);
}

TEST_F(Sequence, SaysWhenTheFluidLeavesTheFramedImage) {
  write_sequence(2);
  EXPECT_THAT(run(words()).err, Not(HasSubstr("outside the image")));
  write_sequence(5);
  auto gone = block(4);
  for (std::size_t k = 0; k < 10; ++k) gone[k][0] -= 100;
  write_particles("d.0001.ply", gone);  // neither the first nor the middle nor the last
  const Outcome outcome = run(words({"--log", "log.jsonl", "--report", "page.html"}));
  const std::string what = "more than 5 % of the particles are outside the image";
  EXPECT_THAT(outcome.err, HasSubstr("frame 1: d.0001.ply: " + what));
  EXPECT_THAT(read("page.html"), HasSubstr(what));
  for (const nlohmann::json& record : log("log.jsonl"))
    EXPECT_EQ(record.dump().find(what) != std::string::npos, record["frame"] == 1) << record;
  // A camera that was given is looked at, too.
  const std::vector<std::string> eye = {"--eye", "1.5,1.5,30", "--target", "1.5,1.5,0"};
  const Outcome given = run(words(eye));
  ASSERT_EQ(given.exit_code, 0) << given.err;
  EXPECT_THAT(given.err, HasSubstr("frame 1: d.0001.ply: " + what + " (expected for a close-up)"));
  const Outcome others = run(words({eye[0], eye[1], eye[2], eye[3], "--frames", "2-4"}));
  ASSERT_EQ(others.exit_code, 0) << others.err;
  EXPECT_THAT(others.err, Not(HasSubstr("outside the image")));
}

TEST_F(Sequence, APartWarnsOfACameraThatOtherPartsMayNotHave) {
  write_sequence(3);
  const std::string what =
      "the camera was chosen from the frames that are there now (d.0002.ply, d.0000.ply, "
      "d.0001.ply): keep it with --write-camera FILE";
  EXPECT_THAT(run(words()).err, Not(HasSubstr("chosen from the frames")));
  EXPECT_THAT(run(words({"--frames", "0-1"})).err, HasSubstr(what));
  EXPECT_THAT(run(words({"--shard", "1/2"})).err, HasSubstr(what));
  EXPECT_THAT(run(words({"--frames", "0-1", "--write-camera", "c.json"})).err,
              Not(HasSubstr("chosen from the frames")));
}

TEST_F(Sequence, LargeFramesHaveOneRadius) {
  for (const auto& [frame, scale] : {std::pair{0, 1.0f}, std::pair{1, 1.5f}}) {
    std::string bytes =
        "ply\nformat binary_little_endian 1.0\nelement vertex 262144\nproperty float x\n"
        "property float y\nproperty float z\nend_header\n";
    for (int k = 0; k < 64 * 64 * 64; ++k)
      for (const int x : {k % 64, k / 64 % 64, k / 4096}) {
        const float value = scale * static_cast<float>(x);
        bytes.append(reinterpret_cast<const char*>(&value), sizeof value);
      }
    write(name("d.", frame, ".ply"), bytes);
  }
  const Outcome outcome = run(words());
  ASSERT_EQ(outcome.exit_code, 0) << outcome.err;
  EXPECT_THAT(outcome.err, HasSubstr("d.0000.ply, for all frames: no particle radius"));
  EXPECT_EQ(read_exr(path("o.0000.exr")).particle_radius,
            read_exr(path("o.0001.exr")).particle_radius);
  // Such a frame keeps what its front is made of.
  const Outcome one = run({"extract", "d.0000.ply", "--size", "64x48", "-o", "a.png", "--timings"});
  EXPECT_THAT(one.err, HasSubstr("262,144 particles, "));
  for (const std::string& counts : {one.err, one.out}) {
    EXPECT_THAT(counts, HasSubstr("used"));
    EXPECT_THAT(counts, Not(HasSubstr("in view")));
  }
}

TEST_F(Sequence, TheBarFitsTheTerminal) {
  write_sequence(3);
  const Outcome outcome = run_on_terminal(50, words());
  EXPECT_EQ(outcome.exit_code, 0);
  const std::vector<std::string> bars = bars_in(outcome.err);
  EXPECT_GE(bars.size(), 2u) << outcome.err;
  // The first start says that it builds kernels.
  EXPECT_THAT(bars, testing::Each(testing::AllOf(
                        testing::AnyOf(testing::StartsWith("["),
                                       testing::StartsWith("building kernels, once per device")),
                        testing::SizeIs(testing::Lt(50)))));
}

TEST_F(Sequence, ResumeRedoesWhatIsNotWhole) {
  write_sequence(6);
  ASSERT_EQ(run(words({"-q", "--log", "log.jsonl"})).exit_code, 0);
  const auto before = outputs();
  fs::remove(path("o.0001.png"));                                // missing
  write("o.0002.exr", before.at("o.0002.exr").substr(0, 2000));  // cut off
  std::string flipped = before.at("o.0003.ply");
  flipped[flipped.size() - 5] ^= 1;
  write("o.0003.ply", flipped);
  write("o.0004.png", before.at("o.0005.png"));  // whole, but another frame's
  const Outcome outcome = run(words({"--resume", "--log", "log.jsonl"}));
  ASSERT_EQ(outcome.exit_code, 0) << outcome.err;
  EXPECT_THAT(outcome.err, HasSubstr("4 frames in"));
  EXPECT_THAT(outcome.err, HasSubstr("2 were there already"));
  EXPECT_EQ(outputs(), before);
  EXPECT_EQ(log("log.jsonl").size(), 12u);
  for (const char* why :
       {"; again, since o.0001.png is missing", "; again, since o.0002.exr is cut off or damaged",
        "; again, since o.0003.ply is cut off or damaged",
        "; again, since o.0004.png was made from another input\n"})
    EXPECT_THAT(outcome.err, HasSubstr(why));
  for (const nlohmann::json& record : log("log.jsonl")) {
    if (!record.contains("again")) continue;
    EXPECT_THAT(record["again"].get<std::string>(), HasSubstr("o.000"));
  }

  const Outcome again = run(words({"--resume"}));
  EXPECT_THAT(again.err, HasSubstr("6 were there already"));
  const Outcome other = run(words({"--resume", "--support", "9"}));  // other parameters
  EXPECT_THAT(other.err, HasSubstr("6 frames in")) << other.err;
  EXPECT_THAT(other.err, HasSubstr("; again, since o.0000.exr was made with other parameters\n"));
  EXPECT_EQ(run(words({"--resume", "-q"})).exit_code, 0);
  EXPECT_EQ(outputs(), before);

  // A newer input.
  fs::last_write_time(path("d.0002.ply"), fs::file_time_type::clock::now() + std::chrono::hours(1));
  EXPECT_THAT(run(words({"--resume"})).err, HasSubstr("5 were there already"));
}

TEST_F(Sequence, ResumeRedoesWhatWasMadeFromAnotherInput) {
  write_sequence(3);
  ASSERT_EQ(run(words({"-q"})).exit_code, 0);
  EXPECT_THAT(run(words({"--resume"})).err, HasSubstr("3 were there already"));
  // As rsync -t and cp -p leave it: of another time, older than the outputs.
  const std::string input = path("d.0001.ply");
  const auto time = fs::last_write_time(input);
  fs::last_write_time(input, time - std::chrono::hours(1));
  EXPECT_THAT(run(words({"--resume"})).err, HasSubstr("2 were there already"));
  // Of the same time and size, but with another content.
  std::string text = read("d.0001.ply");
  text.replace(text.rfind("0.2"), 3, "0.3");
  write("d.0001.ply", text);
  fs::last_write_time(input, time - std::chrono::hours(1));
  EXPECT_THAT(run(words({"--resume"})).err, HasSubstr("2 were there already"));
  EXPECT_THAT(run(words({"--resume"})).err, HasSubstr("3 were there already"));
}

TEST_F(Sequence, ResumeRedoesWhatAnotherProgramMade) {
  write_sequence(2);
  ASSERT_EQ(run(words({"-q"})).exit_code, 0);
  Conditions other;
  other.program = path("meniscus");
  fs::copy_file(MENISCUS_PROGRAM, other.program);
  EXPECT_THAT(run(words({"--resume"}), other).err, HasSubstr("2 were there already"));
  std::ofstream(other.program, std::ios::binary | std::ios::app) << "another build";
  const Outcome redone = run(words({"--resume"}), other);
  EXPECT_THAT(redone.err, HasSubstr("2 frames in"));
  EXPECT_THAT(redone.err, HasSubstr("; again, since o.0000.exr was made by another program\n"));
}

TEST_F(Sequence, ResumeSkipsFramesInParts) {
  for (int frame = 0; frame < 2; ++frame)
    for (const char* const rank : {"rank0.ply", "rank1.ply"})
      write_particles(name("d.", frame, std::string(".") + rank), block(3));
  const std::vector<std::string> all{"extract", "d.####.rank*.ply", "--size",  "64x48",
                                     "-o",      "o.####.exr",       "--resume"};
  ASSERT_EQ(run(all).exit_code, 0);
  EXPECT_THAT(run(all).err, HasSubstr("2 were there already"));
  const std::string part = path("d.0001.rank1.ply");
  fs::last_write_time(part, fs::last_write_time(part) - std::chrono::hours(1));
  EXPECT_THAT(run(all).err, HasSubstr("1 was there already"));
  write_particles("d.0000.rank2.ply", block(2));
  EXPECT_THAT(run(all).err, HasSubstr("1 was there already"));
}

TEST_F(Sequence, NoInputIsOverwrittenWhetherAskedForOrNot) {
  write_sequence(3);
  const std::string frame = read("d.0002.ply"), camera = kCamera;
  for (const char* const file : {"c.0000.json", "c.0001.json", "c.0002.json"}) write(file, camera);
  const std::vector<std::string> first{"extract", "d.####.ply", "--frames",
                                       "0-1",     "--camera",   "c.####.json"};
  const auto with = [&](const std::vector<std::string>& more) {
    std::vector<std::string> all = first;
    all.insert(all.end(), more.begin(), more.end());
    return run(all);
  };
  expect_error(with({"-o", "o.####.exr", "--report", "./d.0002.ply"}), 2,
               {"output ./d.0002.ply: is the input, give another name"});
  expect_error(with({"-o", "o.####.exr", "--log", "./d.0002.ply"}), 2, {"is the input"});
  expect_error(run({"extract", "d.####.ply", "--frames", "0", "-o", "./d.000#.ply"}), 2,
               {"is the input"});
  expect_error(with({"-o", "o.####.exr", "--report", "./c.0001.json"}), 2,
               {"output ./c.0001.json: is the camera's file"});
  expect_error(with({"-o", "o.####.exr", "--report", "c.0002.json"}), 2, {"is the camera's file"});
  EXPECT_EQ(read("d.0002.ply"), frame);
  EXPECT_EQ(read("c.0001.json"), camera);
  EXPECT_THAT(outputs(), IsEmpty());
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
  const Outcome last = run(words({"--resume"}));
  ASSERT_EQ(last.exit_code, 0) << last.err;
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
  const Outcome rest = run(words({"--resume", "--log", "log.jsonl"}));
  ASSERT_EQ(rest.exit_code, 0) << rest.err;
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
  EXPECT_EQ(run(all).exit_code, 0);
  all.back() = "0-4";
  expect_error(run(all, {{}, 4'000'000}), 1, {"2 of 5 frames are done"});  // those two count
  expect_error(run(words({"--log", "/dev/full"})), 1,
               {"/dev/full: cannot be written: No space left on device (free some space",
                "of 5 frames are done; the same command with --resume goes on"});
}

}  // namespace
}  // namespace meniscus::test
