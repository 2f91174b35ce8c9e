// `meniscus mesh`: frames and sequences without a camera.
#include <gmock/gmock.h>
#include <signal.h>

#include <chrono>
#include <cmath>
#include <map>
#include <thread>

#include "program/cli/program.hpp"

namespace meniscus::test {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;

using ProgramMesh = Program;

TEST_F(ProgramMesh, OfAFrameIsWrittenInEveryFormat) {
  write_particles("in.ply", block(5), 0.1, "1 0 0");
  const Outcome made = run_well({"mesh", "in.ply", "-o", "a.ply", "-o", "a.vtp", "-o", "a.glb",
                                 "-o", "a.obj", "-o", "a.stl", "--cell", "0.7", "--timings"});
  EXPECT_THAT(files(), ElementsAre("a.glb", "a.obj", "a.ply", "a.stl", "a.vtp", "in.ply"));
  EXPECT_THAT(made.err, HasSubstr("triangles"));
  EXPECT_THAT(read("a.ply"), HasSubstr("property float vx"));
  const std::string mesh = read("a.ply");
  EXPECT_EQ(run({"mesh", "in.ply", "-o", "b.ply", "--cell", "0.7", "--threads", "1", "-q"}).err,
            "");
  EXPECT_EQ(read("b.ply"), mesh);
  EXPECT_EQ(run({"mesh", "in.ply", "-o", "c.ply", "--cell", "0.7", "--no-motion", "-q"}).err, "");
  EXPECT_THAT(read("c.ply"), testing::Not(HasSubstr("property float vx")));
  EXPECT_EQ(run({"mesh", "in.ply", "-o", "d.ply", "--cell", "0.7", "--adaptive", "0.05", "-q"}).err,
            "");
  EXPECT_LT(2 * read("d.ply").size(), mesh.size());
  // Without its number, before INPUT and at the end.
  EXPECT_EQ(run({"mesh", "--adaptive", "in.ply", "-o", "f.ply", "--cell", "0.7", "-q"}).err, "");
  EXPECT_EQ(read("f.ply"), read("d.ply"));
  EXPECT_EQ(run({"mesh", "in.ply", "-o", "g.ply", "--cell", "0.7", "-q", "--adaptive"}).err, "");
  EXPECT_EQ(read("g.ply"), read("d.ply"));
  EXPECT_EQ(run({"mesh", "in.ply", "-o", "e.ply", "--adaptive", "2"}).exit_code, 2);
}

// A mesh of a radius in another unit takes ten times as long, and is of no use.
TEST_F(ProgramMesh, WarnsOfAWrongUnitWhileItWorks) {
  run_well({"generate", "--particles", "300000", "-o", "in.ply", "-q"});
  const auto size = std::filesystem::file_size(path("in.ply"));
  ASSERT_GT(size, 0u);
  const int process = start({"mesh", "in.ply", "-o", "a.ply", "--particle-radius", "0.0005", "-q"});
  std::string err;
  for (int k = 0; k < 3000 && err.find('\n') == std::string::npos; ++k) {
    std::this_thread::sleep_for(std::chrono::milliseconds(20));
    err = read("stderr.log");
  }
  EXPECT_THAT(err, testing::StartsWith("meniscus: warning: in.ply: a particle radius of 0.0005 "));
  EXPECT_EQ(kill(process, SIGKILL), 0);
  const Outcome outcome = wait_for(process);
  EXPECT_EQ(outcome.exit_code, 128 + SIGKILL) << "it had ended";
  EXPECT_FALSE(exists("a.ply"));
}

// A simulation may throw a particle out of all bounds: the others are what is wanted.
TEST_F(ProgramMesh, LeavesOutParticlesThatLieWhereNoCellIs) {
  auto points = block(5);
  write_particles("near.ply", points);
  points.push_back({0, 1e8, 0});
  write_particles("in.ply", points);
  run_well({"mesh", "near.ply", "-o", "near_mesh.ply", "-q"});
  const Outcome made = run_well({"mesh", "in.ply", "-o", "a.ply"});
  EXPECT_THAT(made.err, HasSubstr("warning: in.ply: 1 of 126 particles lie more than"));
  EXPECT_THAT(made.err, HasSubstr("from the middle of the others, farther than a mesh reaches: "
                                  "they were dropped"));
  const auto triangles = [&](const char* mesh) {
    const std::string bytes = read(mesh);
    const std::size_t at = bytes.find("element face ");
    return bytes.substr(at, bytes.find('\n', at) - at);
  };
  EXPECT_EQ(triangles("a.ply"), triangles("near_mesh.ply"));
  expect_error(run({"mesh", "in.ply", "-o", "b.ply", "--strict"}), 1,
               {"1 of 126 particles lie more than", "leave --strict away to drop them"});
  EXPECT_FALSE(exists("b.ply"));
  write_particles("two.ply", {{0, 0, 0}, {0, 1e9, 0}});
  expect_error(run({"mesh", "two.ply", "-o", "c.ply"}), 1, {"2 of 2 particles", "none is left"});
}

TEST_F(ProgramMesh, OfASequenceGoesOnWhereItWasLeft) {
  for (int frame = 0; frame < 3; ++frame)
    write_particles("d." + std::to_string(frame) + ".ply", block(3 + frame));
  const std::vector<std::string> words{"mesh", "d.#.ply", "-o", "m.#.ply", "--log", "log.jsonl"};
  const Outcome made = run_well(words);
  EXPECT_THAT(made.err, testing::Not(HasSubstr("camera")));
  std::map<std::string, std::string> meshes;
  for (const char* name : {"m.0.ply", "m.1.ply", "m.2.ply"}) meshes[name] = read(name);
  run_well({"mesh", "d.1.ply", "-o", "one.ply", "-q"});
  // A sequence's files carry the job that made them behind the mesh.
  EXPECT_EQ(meshes["m.1.ply"].find(read("one.ply").substr(read("one.ply").find("end_header"))) !=
                std::string::npos,
            true);
  std::filesystem::remove(path("m.1.ply"));
  std::vector<std::string> resumed = words;
  resumed.push_back("--resume");
  const Outcome again = run_well(resumed);
  EXPECT_THAT(again.err, HasSubstr("1 frame in"));
  EXPECT_THAT(again.err, HasSubstr("2 were there already"));
  for (const auto& [name, bytes] : meshes) EXPECT_EQ(read(name), bytes) << name;
  resumed.insert(resumed.end(), {"--cell", "2"});  // another job: all of it
  EXPECT_THAT(run(resumed).err, HasSubstr("3 frames in"));
  EXPECT_NE(read("m.2.ply"), meshes["m.2.ply"]);
}

// Copies, a crowd and a particle without a place among them, which are told once.
TEST_F(ProgramMesh, OfALargeFrameIsTheSameInParts) {
  std::string rows;
  std::size_t count = 0;
  const auto add = [&](float x, float y, float z) {
    for (const float value : {x, y, z}) rows.append(reinterpret_cast<const char*>(&value), 4);
    ++count;
  };
  for (int i = 0; i < 300; ++i)
    for (int j = 0; j < 30; ++j)
      for (int k = 0; k < 30; ++k) {
        const float off = 0.002f * std::sin(static_cast<float>(37 * i + 11 * j + 5 * k));
        add(0.02f * static_cast<float>(i) + off, 0.02f * static_cast<float>(j) - off,
            0.02f * static_cast<float>(k) + off);
      }
  for (int k = 0; k < 40; ++k) add(2 + 1e-5f * static_cast<float>(k), 1, 0.5f);
  for (int k = 0; k < 3; ++k) add(0.75f, 0.01f, 0.75f);
  add(NAN, 0, 0);
  write("in.ply",
        "ply\nformat binary_little_endian 1.0\ncomment particle_radius 0.01\n"
        "element vertex " +
            std::to_string(count) +
            "\nproperty float x\nproperty float y\nproperty float z\nend_header\n" + rows);
  const std::vector<std::string> words{"mesh", "in.ply", "--cell", "2", "--timings", "-o"};
  std::vector<std::string> whole = words, parts = words;
  whole.push_back("whole.ply");
  parts.insert(parts.end(), {"parts.ply", "--memory", "30M"});
  const Outcome one = run_well(whole), some = run(parts);
  EXPECT_EQ(some.exit_code, 0) << some.err;
  EXPECT_THAT(one.out, testing::Not(HasSubstr("join ")));
  EXPECT_THAT(some.out, HasSubstr("join "));
  const std::string full = read("whole.ply");
  EXPECT_TRUE(full == read("parts.ply"));
  const auto until_written = [](const std::string& text) {
    return text.substr(0, text.find("wrote "));
  };
  EXPECT_EQ(until_written(one.err), until_written(some.err));
  EXPECT_THAT(one.err, testing::AllOf(HasSubstr("1 of "), HasSubstr("lie exactly where"),
                                      HasSubstr("crowd into a cube")));
  for (std::vector<std::string>* const with : {&whole, &parts})
    with->insert(with->end(), {"--adaptive", "0.1"});
  run_well(whole);
  run_well(parts);
  EXPECT_LT(read("whole.ply").size(), full.size() / 2);
  EXPECT_TRUE(read("whole.ply") == read("parts.ply"));
}

TEST_F(ProgramMesh, WhatCannotBeDoneIsOneLine) {
  write_particles("in.ply", block(3));
  expect_error(run({"mesh", "in.ply", "-o", "a.exr"}), 2, {"a.exr", ".ply", "meniscus extract"});
  expect_error(run({"mesh", "in.ply", "-o", "a.abc"}), 2,
               {"a.abc", "only meshes", "a.ply", ".glb"});
  expect_error(run({"mesh", "in.ply", "-o", "a.ply", "--cell", "0"}), 2, {"--cell", "0.1 to 4"});
  for (const char* bytes : {"0", "-5", "lots", "1P"})
    expect_error(run({"mesh", "in.ply", "-o", "a.ply", "--memory", bytes}), 2,
                 {std::string("--memory is ") + bytes, "with K, M, G or T"});
  expect_error(run({"mesh", "in.ply", "-o", "a.ply", "--resume"}), 2, {"--resume", "sequences"});
  expect_error(run({"mesh", "in.ply", "-o", "a.####.ply"}), 2, {"a.####.ply", "one frame"});
  expect_error(run({"mesh", "in.ply", "-o", "a.ply", "--eye", "1,2,3"}), 2, {"--eye"});
  expect_error(run({"mesh", "gone.ply", "-o", "a.ply"}), 1, {"gone.ply"});
  EXPECT_THAT(files(), ElementsAre("in.ply"));
}

}  // namespace
}  // namespace meniscus::test
