// What the program writes: for few particles, for none in view, when it is stopped, in every run.
#include <gmock/gmock.h>
#include <unistd.h>

#include <algorithm>
#include <csignal>
#include <cstdlib>
#include <random>
#include <sstream>

#include "meniscus/io.hpp"
#include "meniscus/motion.hpp"
#include "meniscus/parameters.hpp"
#include "program/cli/program.hpp"
#include "same_bits.hpp"

namespace meniscus::test {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;
using testing::StartsWith;

const std::vector<std::string> kMethods = [] {
  std::vector<std::string> names;
  for (const MethodEntry& entry : method_list()) names.push_back(entry.name);
  return names;
}();

class ProgramOutput : public Program {
 protected:
  /// Extracts to a.exr, a.ply, a.obj and a.png and expects that all are whole.
  Outcome extract_all(const std::string& input, std::vector<std::string> more) const {
    const Outcome outcome = run_well(
        Words{"extract", input, "-o", "a.exr", "-o", "a.ply", "-o", "a.obj", "-o", "a.png"} + more);
    EXPECT_EQ(read("a.exr").substr(0, 4), "\x76\x2f\x31\x01");
    EXPECT_EQ(read("a.png").substr(0, 8), "\x89PNG\r\n\x1a\n");
    EXPECT_EQ(read("a.ply").substr(0, 4), "ply\n");
    EXPECT_TRUE(exists("a.obj"));
    return outcome;
  }

  /// How many vertices or faces the PLY's header announces.
  int elements(const std::string& name, const std::string& kind) const {
    const std::string text = read(name), line = "\nelement " + kind + " ";
    const std::size_t at = text.find(line);
    return at == std::string::npos ? -1 : std::atoi(text.c_str() + at + line.size());
  }
};

TEST_F(ProgramOutput, TellsWhatItDid) {
  write_particles("in.ply", block(4));
  const Outcome outcome = extract_all("in.ply", {"--size", "64x48"});
  EXPECT_THAT(outcome.out, IsEmpty());
  for (const char* part : {"in.ply", "64\n", "0.1, from the file", "64x48", "fit", "a.exr", "a.ply",
                           "a.obj", "a.png", " ms\n"})
    EXPECT_THAT(outcome.err, HasSubstr(part));
}

TEST_F(ProgramOutput, QuietSaysNothing) {
  write_particles("in.ply", block(4));
  const Outcome outcome = extract_all("in.ply", {"--size", "64x48", "-q"});
  EXPECT_THAT(outcome.err, IsEmpty());
  EXPECT_THAT(outcome.out, IsEmpty());
}

TEST_F(ProgramOutput, SaysWhereTheRadiusIsFrom) {
  write_particles("in.ply", block(4), 0);
  EXPECT_THAT(extract_all("in.ply", {"--size", "64x48"}).err, HasSubstr("estimated"));
  EXPECT_THAT(extract_all("in.ply", {"--size", "64x48", "--particle-radius", "0.1"}).err,
              HasSubstr("0.1, given"));
}

TEST_F(ProgramOutput, TimingsListStagesAndCounts) {
  write_particles("in.ply", block(4));
  const Outcome outcome = extract_all("in.ply", {"--size", "64x48", "-q", "--timings"});
  for (const char* part :
       {"host ms", "device ms", "project", "blend", "all stages", "particles", "visible",
        "triangles", "fits", "pixels", "read ", "build kernels ", "write "})
    EXPECT_THAT(outcome.out, HasSubstr(part));
}

TEST_F(ProgramOutput, TheFirstStartSaysThatKernelsAreBuiltOnce) {
  write_particles("in.ply", block(3));
  const Conditions conditions{.environment = {{"MENISCUS_CACHE_DIR", path("programs")}}};
  const std::vector<std::string> words{"extract", "in.ply", "--size", "64x48", "-o", "a.png"};
  EXPECT_THAT(run(words, conditions).err, HasSubstr("programs, once per device\n"));
  EXPECT_THAT(run(words, conditions).err, testing::Not(HasSubstr("once per device")));
}

TEST_F(ProgramOutput, WritesTheCameraThatItChose) {
  write_particles("in.ply", block(4));
  run_well({"extract", "in.ply", "--size", "64x48", "--up", "0,0,1", "--fov", "25",
            "--write-camera", "camera.json", "-o", "a.ply"});
  run_well({"extract", "in.ply", "--camera", "camera.json", "-o", "b.ply"});
  EXPECT_EQ(read("a.ply"), read("b.ply"));
  for (const char* up : {"z", "Z"}) {
    ASSERT_EQ(
        run({"extract", "in.ply", "--size", "64x48", "--up", up, "--fov", "25", "-o", "b.ply"})
            .exit_code,
        0);
    EXPECT_EQ(read("a.ply"), read("b.ply")) << up;
  }
  expect_error(run({"extract", "in.ply", "--write-camera", "in.ply", "-o", "c.ply"}), 2,
               {"in.ply"});
}

TEST_F(ProgramOutput, WarnsOfOptionsWithoutEffect) {
  write_particles("in.ply", block(3));
  const Outcome outcome = run({"extract", "in.ply", "--size", "64x48", "-o", "a.png", "-q",
                               "--half", "--cell", "3", "--ssm-sigma", "2", "--preview", "normal"});
  EXPECT_EQ(outcome.exit_code, 0);
  EXPECT_EQ(outcome.err,
            "meniscus: warning: --half has no effect: no output is an .exr\n"
            "meniscus: warning: --cell has no effect: no output is a mesh\n"
            "meniscus: warning: --ssm-sigma has no effect: it is of method ssm, and this is fit\n");
  EXPECT_EQ(run({"extract", "in.ply", "--size", "64x48", "-o", "a.png", "-q", "--method", "spheres",
                 "--support", "5"})
                .err,
            "meniscus: warning: --support has no effect: it is of methods fit, groups and stable, "
            "and this is spheres\n");
  write("pairs.ply",
        "ply\nformat ascii 1.0\nelement vertex 1\nproperty float x\nproperty float y\n"
        "property float z\nproperty float temp\nend_header\n0 0 0 1\n");
  const std::string carried =
      "meniscus: warning: --attribute has no effect: no output is an .exr, ";
  for (const std::vector<std::string>& words :
       {std::vector<std::string>{"extract", "-o", "a.png", "-o", "a.obj", "--size", "64x48"},
        {"mesh", "-o", "a.stl"}}) {
    std::vector<std::string> all{words};
    all.insert(all.end(), {"pairs.ply", "-r", "0.1", "-q", "--attribute", "temp", "--dataset",
                           "foo", "--timestep", "3"});
    EXPECT_EQ(
        run(all).err,
        carried +
            ".ply, .vtp or .glb\n"
            "meniscus: warning: --dataset has no effect: the input is no HDF5 file, .npy, .npz or "
            ".vdb\n"
            "meniscus: warning: --timestep has no effect: the input is no LAMMPS dump\n");
  }
  for (const char* output : {"a.ply", "a.vtp", "a.glb", "a.exr"})
    EXPECT_EQ(run({"extract", "pairs.ply", "-r", "0.1", "-q", "--attribute", "temp", "--size",
                   "64x48", "-o", output})
                  .err,
              "");
  // Of a parameter of several methods each counts.
  for (const char* method : {"fit", "groups", "stable"})
    EXPECT_EQ(run({"extract", "in.ply", "--size", "64x48", "-o", "a.png", "-q", "--method", method,
                   "--thin", "2"})
                  .err,
              "");
}

TEST_F(ProgramOutput, LayersAreAddedToTheFront) {
  write_particles("in.ply", block(6));
  const std::vector<std::string> common{"extract", "in.ply", "--size", "64x48", "-q"};
  const auto extracted = [&](std::vector<std::string> more) {
    const Outcome outcome = run(common + more);
    EXPECT_EQ(outcome.exit_code, 0);
    return outcome.err;
  };
  EXPECT_EQ(extracted({"-o", "front.exr", "-o", "lit.png"}), "");
  EXPECT_EQ(extracted({"--layers", "2", "-o", "a.exr", "-o", "a.deep.exr", "-o", "a.png"}), "");
  const Surface front = read_exr(path("front.exr")), layered = read_exr(path("a.exr"));
  EXPECT_TRUE(same_bits(front, layered));
  EXPECT_EQ(front.layers.most, 0);
  ASSERT_EQ(layered.layers.count.size(), 64u * 48u);
  EXPECT_EQ(read("lit.png").size(), read("a.png").size());
  EXPECT_GT(read("a.deep.exr").size(), 1000u);
  // A deep file alone, and glass alone, ask for what they need.
  EXPECT_EQ(extracted({"-o", "b.deep.exr"}), "");
  EXPECT_EQ(extracted({"--layers", "8", "-o", "c.deep.exr"}), "");
  EXPECT_EQ(read("b.deep.exr"), read("c.deep.exr"));
  EXPECT_EQ(extracted({"-o", "glass.png", "--preview", "glass"}), "");
  EXPECT_NE(read("glass.png"), read("lit.png"));
  EXPECT_EQ(
      extracted({"--layers", "2", "-o", "c.png"}),
      "meniscus: warning: --layers has no effect: no output is an .exr, a .deep.exr or a .png "
      "of --preview glass\n");
  const auto refused = [&](const std::vector<std::string>& asked, const std::string& what) {
    std::vector<std::string> words{"extract", "in.ply", "--method", "ssm"};
    words.insert(words.end(), asked.begin(), asked.end());
    expect_error(run(words), 2, {what});
  };
  refused({"--layers", "1", "-o", "d.exr"}, "leave --layers out");
  const std::string why =
      " needs layers, which method ssm has not: use --method fit, groups or stable";
  refused({"-o", "d.deep.exr"}, "d.deep.exr" + why);
  refused({"-o", "d.png", "--preview", "glass"}, "--preview glass" + why);
}

TEST_F(ProgramOutput, LayersOfASequenceAreResumedAsOtherOutputs) {
  for (int frame = 0; frame < 3; ++frame)
    write_particles("d.000" + std::to_string(frame) + ".ply", block(3 + frame));
  const auto outputs = [&] {
    std::map<std::string, std::string> bytes;
    for (const std::string& file : files())
      if (file.starts_with("o.")) bytes[file] = read(file);
    return bytes;
  };
  const std::vector<std::string> all{"extract",  "d.####.ply", "--size",   "64x48",
                                     "-o",       "o.####.exr", "-o",       "o.####.deep.exr",
                                     "--report", "r.html",     "--layers", "2"};
  run_well(all);
  const auto before = outputs();
  EXPECT_EQ(before.size(), 6u);
  EXPECT_EQ(read_exr(path("o.0001.exr")).layers.most, 1);
  std::string flipped = before.at("o.0001.deep.exr");
  flipped[flipped.size() - 5] ^= 1;
  write("o.0001.deep.exr", flipped);
  std::vector<std::string> again = all;
  again.push_back("--resume");
  EXPECT_THAT(run(again).err, HasSubstr("2 were there already"));
  EXPECT_EQ(outputs(), before);
  again[again.size() - 2] = "3";  // other layers are other parameters
  EXPECT_THAT(run(again).err, Not(HasSubstr("were there already")));
}

TEST_F(ProgramOutput, AsksWhetherNumberedPartsAreASequence) {
  for (const char* name : {"d.0001.ply", "d.0002.ply", "rank1.ply", "rank2.ply"})
    write_particles(name, block(3));
  const std::vector<std::string> more{"--size", "64x48", "-o", "a.png", "-q"};
  const auto warned = [&](const std::string& input) {
    return run(Words{"extract", input} + more).err;
  };
  EXPECT_THAT(warned("d.*.ply"),
              HasSubstr("2 numbered files; did you mean the sequence d.####.ply?"));
  EXPECT_THAT(warned("rank*.ply"), testing::Not(HasSubstr("did you mean")));
}

TEST_F(ProgramOutput, TellsAMeshFromParticles) {
  write_particles("in.ply", block(5));
  const std::vector<std::string> more{"--size", "64x48", "-o", "a.png", "-q"};
  const auto warned = [&](const std::string& input) {
    return run(Words{"extract", input} + more).err;
  };
  run_well({"mesh", "in.ply", "-o", "mesh.ply"});
  EXPECT_THAT(warned("mesh.ply"), HasSubstr("mesh.ply: has faces: a mesh, not particles"));
  EXPECT_THAT(warned("in.ply"), testing::Not(HasSubstr("faces")));
}

TEST_F(ProgramOutput, FindsFaultsOfCameraAndDeviceBeforeItReadsParticles) {
  write("bad.ply", "no particles");
  write("camera.json", "{}");
  expect_error(run({"extract", "bad.ply", "--camera", "camera.json", "-o", "a.png"}), 1,
               {"camera.json", "width"});
  expect_error(run({"extract", "bad.ply", "--device", "no such", "-o", "a.png"}), 1, {"no such"});
}

// 4:3 in the projection, 2:1 in the size.
TEST_F(ProgramOutput, WarnsOfASizeThatIsNotTheProjections) {
  write_particles("in.ply", block(3));
  write("camera.json",
        R"({"width": 96, "height": 48, "view": [[1,0,0,0],[0,1,0,0],[0,0,1,-5],[0,0,0,1]],
            "projection": [[1.5,0,0,0],[0,2,0,0],[0,0,-1.002,-0.2],[0,0,-1,0]]})");
  EXPECT_THAT(run({"extract", "in.ply", "--camera", "camera.json", "-o", "a.png"}).err,
              HasSubstr("1.33 times as wide as high, but width and height are 96 and 48"));
}

// An emitter that has not begun.
TEST_F(ProgramOutput, AFrameWithoutParticlesIsNoError) {
  write_particles("in.ply", {});
  const std::string said = extract_all("in.ply", {"--size", "64x48"}).err;
  EXPECT_THAT(said, HasSubstr("0 pixels"));
  EXPECT_THAT(said, testing::Not(HasSubstr("\nradius")));  // of what?
}

TEST_F(ProgramOutput, OnlyWhatWasAskedForIsWritten) {
  write_particles("in.ply", block(4));
  run_well({"extract", "in.ply", "--size", "64x48", "-o", "b.obj"});
  EXPECT_THAT(files(), ElementsAre("b.obj", "in.ply"));
}

TEST_F(ProgramOutput, EndingsMayBeCapitalsAndNamesMayHaveSpaces) {
  write_particles("in put.PLY", block(4));
  run_well({"extract", "in put.PLY", "--size", "64x48", "-o", "Größe 1.PNG", "-o", "m.OBJ", "-o",
            "z.EXR"});
  EXPECT_EQ(read("Größe 1.PNG").substr(1, 3), "PNG");
  EXPECT_THAT(read("m.OBJ"), HasSubstr("\nvn "));
}

TEST_F(ProgramOutput, HasMotionWhereParticlesCarryVelocities) {
  write_particles("in.ply", block(5), 0.1, "1.5 -0.5 2");
  const std::vector<std::string> where{"--size", "64x48", "--eye", "1,1,3", "--target", "0,0,0"};
  const auto extract = [&](std::vector<std::string> more) {
    more.insert(more.end(), where.begin(), where.end());
    extract_all("in.ply", more);
    return read_exr(path("a.exr"));
  };
  const Surface moving = extract({"--fps", "30"});
  ASSERT_EQ(moving.velocity.size(), moving.depth.size());
  EXPECT_EQ(moving.forward.frames_per_second, 30);
  const ScreenMotion expected = screen_motion(moving, moving.camera, 30);
  EXPECT_EQ(moving.forward.pixels, expected.pixels);
  EXPECT_THAT(read("a.ply"), HasSubstr("property float vz\n"));
  EXPECT_EQ(extract({}).forward.frames_per_second, 24);

  const Surface still = extract({"--no-motion"});
  EXPECT_TRUE(still.velocity.empty());
  EXPECT_TRUE(still.forward.pixels.empty());
  EXPECT_EQ(still.depth, moving.depth);
  EXPECT_EQ(still.normal, moving.normal);
  EXPECT_THAT(read("a.ply"), testing::Not(HasSubstr("property float vz\n")));
  const std::string without = read("a.exr");
  write_particles("in.ply", block(5));
  extract({});
  EXPECT_EQ(read("a.exr"), without) << "particles without velocities give what they gave";
}

TEST_F(ProgramOutput, HasTheMapsThatAreNamed) {
  write_particles("in.ply", block(5), 0.1, "1.5 -0.5 2");
  const auto extract = [&](std::vector<std::string> more) {
    more.insert(more.end(), {"--size", "64x48"});
    extract_all("in.ply", more);
    return read_exr(path("a.exr"));
  };
  const Surface all = extract({});
  EXPECT_EQ(all.group.size(), all.depth.size());
  const std::string mesh = read("a.ply"), picture = read("a.png");

  // Of the normals a picture is made.
  const Surface ids = extract({"--aov", "id"});
  EXPECT_EQ(ids.depth, all.depth);
  EXPECT_EQ(ids.normal, all.normal);
  EXPECT_EQ(ids.group, all.group);
  EXPECT_THAT(ids.position, IsEmpty());
  EXPECT_THAT(ids.kind, IsEmpty());
  EXPECT_THAT(ids.residual, IsEmpty());
  EXPECT_THAT(ids.velocity, IsEmpty());
  EXPECT_THAT(ids.forward.pixels, IsEmpty());
  EXPECT_EQ(read("a.ply"), mesh) << "the mesh keeps its velocities";
  EXPECT_EQ(read("a.png"), picture);

  const Surface moving = extract({"--aov", "V", "--preview", "groups"});
  EXPECT_EQ(moving.velocity, all.velocity);
  EXPECT_EQ(moving.forward.pixels, all.forward.pixels);
  EXPECT_EQ(moving.kind, all.kind);
  EXPECT_THAT(moving.position, IsEmpty());

  const Outcome wrong = run({"extract", "in.ply", "-o", "b.exr", "--aov", "N,normals"});
  EXPECT_EQ(wrong.exit_code, 2);
  EXPECT_THAT(
      wrong.err,
      HasSubstr("--aov has \"normals\", must be a list of maps beside depth: N, P, id, kind, "
                "residual, V"));
}

TEST_F(ProgramOutput, NothingInViewIsAValidEmptyResultAndAWarning) {
  write_particles("in.ply", block(4));
  for (const std::string& method : kMethods) {
    const Outcome outcome = extract_all("in.ply", {"--method", method, "--eye", "0,0,5", "--target",
                                                   "0,0,10", "--size", "64x48", "-q"});
    EXPECT_THAT(outcome.err, HasSubstr("meniscus: warning: ")) << method;
    EXPECT_EQ(elements("a.ply", "vertex"), 0) << method;
    EXPECT_EQ(elements("a.ply", "face"), 0) << method;
  }
}

TEST_F(ProgramOutput, FewParticlesGiveValidResults) {
  const std::vector<std::array<double, 3>> points{{0, 0, 0}, {0.2, 0, 0}, {0, 0.2, 0}};
  for (std::size_t n = 0; n <= points.size(); ++n) {
    write_particles("in.ply", {points.begin(), points.begin() + static_cast<long>(n)});
    for (const std::string& method : kMethods) {
      SCOPED_TRACE(method + ", " + std::to_string(n) + " particles");
      const Outcome outcome = extract_all("in.ply", {"--method", method, "--size", "64x48", "-q"});
      if (n == 0) {
        EXPECT_THAT(outcome.err, HasSubstr("meniscus: warning: "));
      } else {
        EXPECT_GT(elements("a.ply", "vertex"), 0);
        EXPECT_GT(elements("a.ply", "face"), 0);
      }
    }
  }
}

TEST_F(ProgramOutput, SamePointAndLineGiveValidResults) {
  std::vector<std::array<double, 3>> line;
  for (int k = 0; k < 30; ++k) line.push_back({0.2 * k, 0, 0});
  for (const auto& points : {std::vector<std::array<double, 3>>(30, {1, 2, 3}), line})
    for (const double radius : {0.1, 0.0}) {  // given, and estimated
      write_particles("in.ply", points, radius);
      for (const std::string& method : kMethods) {
        SCOPED_TRACE(method + ", radius " + std::to_string(radius));
        extract_all("in.ply", {"--method", method, "--size", "64x48", "-q"});
      }
    }
}

// A particle's footprint is larger than the image.
TEST_F(ProgramOutput, ASurfaceFromVeryNearFillsTheImage) {
  write_particles("in.ply", block(10));
  for (const char* const method : {"ssm", "fit", "stable"})
    for (const char* const degrees : {"6", "2", "0.5"}) {
      const Outcome outcome =
          run_well({"extract", "in.ply", "--method", method, "--eye", "0.05,0.04,2.4", "--target",
                    "0.01,0.01,0", "--fov", degrees, "--size", "512x384", "-o", "a.exr"});
      EXPECT_THAT(outcome.err, HasSubstr(" 196,608 pixels")) << method << ' ' << degrees;
    }
}

// Sixteen times smaller than 16384 x 16384 in 12 GB: PoCL aborted.
TEST_F(ProgramOutput, AnImageForWhichALimitOnMemoryHasNoRoomIsOneLine) {
  write_particles("in.ply", block(10));
  for (const char* const megabytes : {"900", "1500", "3000"}) {
    const Conditions limited{
        {},
        0,
        {"/bin/sh", "-c",
         std::string("ulimit -v $((1024 * ") + megabytes + ")); exec timeout -s KILL 60 \"$@\"",
         "sh"}};
    const Outcome outcome =
        run({"extract", "in.ply", "--size", "4096x4096", "-o", "a.exr"}, limited);
    EXPECT_EQ(outcome.exit_code, 1) << outcome.err;
    EXPECT_THAT(outcome.err,
                testing::ContainsRegex(
                    "error: the limit on memory leaves [0-9,]+ MB and a frame of 16,777,216 "
                    "pixels takes about [0-9,]+ MB"));
    EXPECT_FALSE(std::filesystem::exists(path("a.exr")));
  }
}

TEST_F(ProgramOutput, WhatRunsAtExitCannotFailIt) {
  write_particles("in.ply", block(10));
  Conditions broken;
  broken.environment = {{"LD_PRELOAD", MENISCUS_BROKEN_EXIT_LIBRARY}};
  const Outcome outcome =
      run_well({"extract", "in.ply", "--size", "64x48", "-o", "a.png", "-o", "a.ply"}, broken);
  EXPECT_THAT(outcome.err, HasSubstr("total"));
  const Outcome help = run({"--help"}, broken);
  EXPECT_EQ(help.exit_code, 0);
  EXPECT_THAT(help.out, HasSubstr("extract"));
}

TEST_F(ProgramOutput, TwoDropsAreAsLargeAsTheirDistanceSays) {
  write_particles("in.ply", {{0, 0, 0}, {1, 0, 0}}, 0);
  const Outcome outcome = extract_all("in.ply", {"--size", "64x48"});
  EXPECT_THAT(outcome.err, HasSubstr("estimated 0.5 from the spacing"));
  EXPECT_GT(elements("a.ply", "vertex"), 0);
}

TEST_F(ProgramOutput, RadiiThatDifferGreatlyTakeNoLonger) {
  std::mt19937 random(3);
  std::uniform_real_distribution<double> place(-3000, 3000);
  std::ostringstream text;
  text << "ply\nformat ascii 1.0\nelement vertex 1000\nproperty float x\nproperty float y\n"
          "property float z\nproperty float radius\nend_header\n";
  for (int k = 0; k < 1000; ++k)
    text << place(random) << ' ' << place(random) << ' ' << place(random) << ' '
         << (k % 3 ? 1 : 5000) << '\n';
  write("in.ply", text.str());
  for (const char* const method : {"fit", "stable"})
    EXPECT_EQ(run({"extract", "in.ply", "--method", method, "--size", "256x256", "-o", "a.exr"},
                  in_time(60))
                  .exit_code,
              0)
        << method;
}

TEST_F(ProgramOutput, AStrayFarBehindTakesNoLonger) {
  auto points = block(5);
  for (auto& point : points)
    for (double& x : point) x *= 0.05;
  points.push_back({0, 0, -1e5});
  write_particles("in.ply", points, 0.005);
  for (const std::string& method : kMethods)
    EXPECT_EQ(run({"extract", "in.ply", "--method", method, "--eye", "0,0,0.2", "--target", "0,0,0",
                   "--size", "128x128", "-o", "a.exr"},
                  in_time(60))
                  .exit_code,
              0)
        << method;
}

// The program is held where its files are whole and have no names yet: a signal sent as soon as a
// file is seen may come when all is done.
TEST_F(ProgramOutput, StoppedByASignalLeavesNothing) {
  write_particles("in.ply", block(4));
  for (const int signal : {SIGINT, SIGTERM}) {
    int sign[2];
    ASSERT_EQ(pipe(sign), 0);
    const int process =
        start({"extract", "in.ply", "--method", "ssm", "--size", "64x48", "-o", "a.exr"},
              {{{"LD_PRELOAD", MENISCUS_HELD_WRITING_LIBRARY},
                {"MENISCUS_HELD_SIGN", std::to_string(sign[1])}}});
    close(sign[1]);
    char byte;
    EXPECT_EQ(::read(sign[0], &byte, 1), 1) << "ended before it was held";
    close(sign[0]);
    EXPECT_THAT(files(), ElementsAre(StartsWith(".meniscus-"), "in.ply"));
    kill(process, signal);
    EXPECT_EQ(wait_for(process).exit_code, 128 + signal);
    EXPECT_THAT(files(), ElementsAre("in.ply"));
  }
}

// --- the same bytes every time
// ---------------------------------------------------------------------

/// Binary PLY of position, velocity and density, as the example frames have them.
std::string ply_bytes(const Particles& particles, const std::vector<std::size_t>& order) {
  std::string bytes =
      "ply\nformat binary_little_endian 1.0\ncomment time 0 particle_radius 0.025\nelement "
      "vertex " +
      std::to_string(order.size()) + "\n";
  for (const char* name : {"x", "y", "z", "vx", "vy", "vz", "density"})
    bytes += std::string("property float ") + name + "\n";
  bytes += "end_header\n";
  for (const std::size_t i : order)
    for (const auto* values : {&particles.x, &particles.y, &particles.z, &particles.vx,
                               &particles.vy, &particles.vz, &particles.density})
      bytes.append(reinterpret_cast<const char*>(&(*values)[i]), sizeof(float));
  return bytes;
}

class ProgramSameBytes : public Program, public testing::WithParamInterface<std::string> {
 protected:
  std::vector<std::string> outputs(const std::string& input,
                                   const std::vector<std::string>& more) const {
    run_well(Words{"extract", input, "-q", "--method", GetParam(), "--camera", "camera.json", "-o",
                   "a.exr", "-o", "a.ply", "-o", "a.obj", "-o", "a.png"} +
             more);
    return {read("a.exr"), read("a.ply"), read("a.obj"), read("a.png")};
  }
};

TEST_P(ProgramSameBytes, InEveryRunWithAnyThreadsAndAnyOrderOfParticles) {
  const std::string data = MENISCUS_EXAMPLE_DATA "/cube_drop/";
  const Particles particles = read_particles(data + "frame_007.ply");
  std::filesystem::copy_file(data + "camera.json", path("camera.json"));
  std::vector<std::size_t> order(particles.size());
  for (std::size_t i = 0; i < order.size(); ++i) order[i] = i;
  write("in.ply", ply_bytes(particles, order));
  std::shuffle(order.begin(), order.end(), std::mt19937(7));
  write("shuffled.ply", ply_bytes(particles, order));

  const auto first = outputs("in.ply", {});
  const char* const endings[] = {"exr", "ply", "obj", "png"};
  const auto expect_same = [&](const std::vector<std::string>& other, const char* what) {
    for (std::size_t k = 0; k < first.size(); ++k)
      EXPECT_TRUE(first[k] == other[k]) << endings[k] << " differs: " << what;
  };
  expect_same(outputs("in.ply", {}), "second run");
  expect_same(outputs("in.ply", {"--threads", "1"}), "one thread");
  expect_same(outputs("in.ply", {"--threads", "2"}), "two threads");
  expect_same(outputs("shuffled.ply", {}), "shuffled particles");
}

INSTANTIATE_TEST_SUITE_P(Methods, ProgramSameBytes, testing::ValuesIn(kMethods),
                         [](const auto& info) {
                           std::string name = info.param;
                           std::replace(name.begin(), name.end(), '-', '_');
                           return name;
                         });

}  // namespace
}  // namespace meniscus::test
