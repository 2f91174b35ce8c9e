// What is refused of a sequence, before a file is overwritten or a frame begun.
#include <gmock/gmock.h>

#include <filesystem>

#include "program/cli/sequence_frames.hpp"

namespace meniscus::test {
namespace {

using testing::HasSubstr;
using testing::IsEmpty;

constexpr char kCamera[] =
    R"({"width": 64, "height": 48, "view": [[1,0,0,0],[0,1,0,0],[0,0,1,-4],[0,0,0,1]],
        "projection": [[2,0,0,0],[0,2,0,0],[0,0,-1.02,-0.2],[0,0,-1,0]]})";

TEST_F(Sequence, WrongUseIsNamed) {
  write_sequence(2);
  expect_error(run(words({"--frames", ""})), 2, {"--frames is empty"});
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
  const auto refused = [&](const std::string& input) {
    return run({"mesh", input, "-o", "a.ply"});
  };
  expect_error(refused("d.0000"), 1, {"d.0000: no such file or folder, did you mean d.0000.ply?"});
  expect_error(refused("./f.0001.ply"), 1, {"or folder, did you mean ./d.0001.ply?"});
  EXPECT_THAT(refused("frame.ply").err, testing::EndsWith("frame.ply: no such file or folder\n"));
  EXPECT_THAT(refused("d").err,
              testing::EndsWith("d: no such file or folder, did you mean d.0000.ply?\n"));
  EXPECT_THAT(refused("no/d.0000").err, testing::EndsWith("no such file or folder\n"));
  expect_error(run({"extract", "d.####.ply", "--camera", "none.json", "-o", "o.####.exr"}), 1,
               {"none.json: cannot be opened: No such file", "--write-camera FILE keeps it)"});
  expect_error(run({"extract", "d.0000.ply", "--camera", "none.json", "-o", "o.exr"}), 1,
               {"none.json: cannot be opened: No such file",
                "(without --camera the program chooses a "
                "camera, and --write-camera FILE keeps it)"});
  expect_error(run({"extract", "d.0000.ply", "--camera", "c.png", "-o", "./c.png"}), 2,
               {"output ./c.png: is the camera's file"});
  expect_error(run({"extract", "d.0000.ply", "-o", "o.exr", "--frames", "1-2"}), 2,
               {"--frames is for sequences", "d.0000.ply has no place"});
  expect_error(run({"extract", "e.####.ply", "-o", "o.####.exr"}), 1,
               {"e.####.ply: no file matches; the folder has "});
  for (const char* absent : {"in/nofolder", "nofolder/frames/", "nofile.ply"})
    for (const char* command : {"extract", "mesh"})
      expect_error(run({command, absent, "-o", "o.####.ply"}), 1,
                   {std::string(absent) + ": no such file or folder"});
  expect_error(run({"extract", "-", "-o", "o.exr"}), 1, {"-: standard input is not read"});
  expect_error(run({"extract", "d.000?.ply", "-o", "o.exr"}), 1,
               {"d.000?.ply: no such file or folder (a sequence is written as dam.####.ply"});
  expect_error(run(words({"--timings"})), 2, {"--timings of a sequence", "--log"});
  expect_error(run(words({"--frames", "1-"})), 2, {"frames 1-: \"1-\" is no frame"});
  expect_error(run(words({"--shard", "3/2"})), 2, {"shard 3/2"});
  expect_error(run(words({"--missing", "perhaps"})), 2, {"must be one of fail, skip"});
  expect_error(run({"extract", "d.####.ply", "-o", "nowhere/o.####.exr"}), 1,
               {"nowhere/o.0000.exr: cannot be written", "make the folder nowhere first"});
}

TEST_F(Sequence, AStarIsNoSequence) {
  write_sequence(2);  // 27 and 64 particles
  const Outcome outcome = run_well({"extract", "d.*.ply", "-o", "o.png", "--size", "64x48"});
  EXPECT_THAT(outcome.err, HasSubstr("d.*.ply: 91 in 2 files, the parts of one frame"));
  expect_error(run({"extract", "d.*.ply", "-o", "o.####.png"}), 2,
               {"o.####.png has a place", "d.*.ply is one frame (* stands for its parts)"});
  write("o.####.png", "there already");
  expect_error(run({"extract", "d.0000.ply", "-o", "o.####.png"}), 2, {"d.0000.ply is one frame;"});
  run_well({"extract", "d.0000.ply", "-o", "o#1.png", "--size", "64x48"});
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

TEST_F(Sequence, NoInputIsOverwrittenWhetherAskedForOrNot) {
  write_sequence(3);
  const std::string frame = read("d.0002.ply"), camera = kCamera;
  for (const char* const file : {"c.0000.json", "c.0001.json", "c.0002.json"}) write(file, camera);
  const std::vector<std::string> first{"extract", "d.####.ply", "--frames",
                                       "0-1",     "--camera",   "c.####.json"};
  const auto with = [&](const std::vector<std::string>& more) { return run(first + more); };
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

}  // namespace
}  // namespace meniscus::test
