// Foam, spray and bubbles, as a user gives them: files, sequences, and what is wrong with them.
#include "meniscus/whitewater.hpp"

#include <gmock/gmock.h>

#include <algorithm>
#include <cmath>

#include "meniscus/device.hpp"
#include "program/cli/program.hpp"
#include "same_bits.hpp"

namespace meniscus::test {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;
using testing::Not;

class ProgramWhitewater : public Program {
 protected:
  // A pool of water and drops above it, in it and behind it: `type` counts 0, 1, 2.
  void write_files(const std::string& ending = ".ply") const {
    write_particles("water" + ending, block(6));
    std::string rows;
    std::size_t count = 0;
    for (int k = 0; k < 60; ++k, ++count) {
      const double x = -0.6 + 0.02 * k, z = k % 3 == 0 ? 0.62 : k % 3 == 1 ? 1.2 : -0.1;
      rows += std::to_string(x) + " " + std::to_string(0.3 * std::sin(0.5 * k)) + " " +
              std::to_string(z) + " 1 2 3 0.03 " + std::to_string(k % 3) + "\n";
    }
    write("white" + ending, header(count) + rows);
  }

  static std::string header(std::size_t count) {
    return "ply\nformat ascii 1.0\nelement vertex " + std::to_string(count) +
           "\nproperty float x\nproperty float y\nproperty float z\nproperty float vx\nproperty "
           "float vy\nproperty float vz\nproperty float radius\nproperty float type\nend_header\n";
  }

  static std::vector<std::string> words(const std::vector<std::string>& more,
                                        const std::string& water = "water.ply") {
    return Words{"extract", water,    "--eye", "0.5,1,4", "--target",
                 "0,0,0",   "--size", "96x72", "-q"} +
           more;
  }

  static double sum(const std::vector<float>& values) {
    double all = 0;
    for (const float value : values) all += value;
    return all;
  }
};

TEST_F(ProgramWhitewater, IsThatOfTheLibraryAndLeavesTheWaterAlone) {
  write_files();
  const std::string foam = "foam=white.ply@type=0", spray = "spray=white.ply@type=1",
                    bubble = "bubble=white.ply@type=2";
  run_well(words({"-o", "a.exr", "-o", "a.png"}));
  const Outcome outcome = run_well(words(
      {"--whitewater", foam, spray, bubble, "-o", "b.exr", "-o", "b.png", "--write-camera", "c"}));
  EXPECT_EQ(outcome.err, "");
  const Surface bare = read_exr(path("a.exr")), surface = read_exr(path("b.exr"));
  EXPECT_TRUE(same_bits(bare, surface));
  EXPECT_NE(read("a.png"), read("b.png"));
  ASSERT_EQ(surface.whitewater.size(), 3u);
  for (const WhitewaterMaps& maps : surface.whitewater) {
    EXPECT_GT(sum(maps.coverage), 1) << to_string(maps.type);
    EXPECT_EQ(maps.velocity.size(), maps.coverage.size());
    EXPECT_EQ(maps.behind.empty(), maps.type != WhitewaterType::bubble);
  }
  // Each behind its own option, and after the outputs.
  ASSERT_EQ(run(words({"-o", "d.exr", "--whitewater", bubble, "--whitewater", foam, "--whitewater",
                       spray}))
                .exit_code,
            0);
  EXPECT_TRUE(
      same_bits(read_exr(path("d.exr")).whitewater[2].behind, surface.whitewater[2].behind));

  Device device(select_device(""));
  const Particles all = read_particles(path("white.ply"), ReadOptions{.attributes = {"type"}});
  const auto source = source_of(all);
  Surface expected = bare;
  draw_whitewater(device, {{WhitewaterType::foam, source.get(), "type", 0}}, {}, expected);
  EXPECT_TRUE(same_bits(expected.whitewater[0].coverage, surface.whitewater[0].coverage));
  EXPECT_TRUE(same_bits(expected.whitewater[0].depth, surface.whitewater[0].depth));
}

TEST_F(ProgramWhitewater, RadiusAndToleranceAreTaken) {
  write_files();
  const auto coverage = [&](const std::vector<std::string>& more) {
    run_well(words(Words{"--whitewater", "foam=white.ply", "-o", "a.exr"} + more));
    return sum(read_exr(path("a.exr")).whitewater.at(0).density);
  };
  const double own = coverage({});
  EXPECT_GT(coverage({"--whitewater-radius", "0.05"}), 2 * own);
  EXPECT_GT(coverage({"--whitewater-tolerance", "50"}), 1.2 * own);  // those in the water, too
}

TEST_F(ProgramWhitewater, SequencesTakeTheFilesOfEachFrame) {
  for (int frame = 0; frame < 3; ++frame) {
    const std::string number = std::to_string(frame);
    write_particles("w.000" + number + ".ply", block(4 + frame));
    if (frame < 2) write("f." + number + ".ply", header(1) + "0 0 1 0 0 0 0.1 0\n");
  }
  const std::vector<std::string> more{"--whitewater", "foam=f.{}.ply", "-o",      "o.####.exr",
                                      "--frames",     "0-1",           "--resume"};
  run_well(words(more, "w.####.ply"));
  EXPECT_EQ(read_exr(path("o.0001.exr")).whitewater.size(), 1u);
  const std::string before = read("o.0001.exr");
  // A file of whitewater that changes makes its frame anew.
  write("f.1.ply", header(1) + "0 0 1 0 0 0 0.2 0\n");
  std::vector<std::string> loud = words(more, "w.####.ply");
  std::erase(loud, "-q");
  EXPECT_THAT(run(loud).err, HasSubstr("1 was there already"));
  EXPECT_NE(read("o.0001.exr"), before);
  EXPECT_THAT(run(loud).err, HasSubstr("2 were there already"));

  // The third frame has none.
  std::vector<std::string> all{"--whitewater", "foam=f.{}.ply", "-o", "p.####.exr"};
  expect_error(run(words(all, "w.####.ply")), 1, {"f.{}.ply: frame 2 missing", "--missing skip"});
  all.insert(all.end(), {"--missing", "skip"});
  const Outcome outcome = run_well(words(all, "w.####.ply"));
  EXPECT_THAT(outcome.err, HasSubstr("frame 2 missing, and the water made without"));
  const Surface last = read_exr(path("p.0002.exr"));
  ASSERT_EQ(last.whitewater.size(), 1u);
  EXPECT_EQ(sum(last.whitewater[0].coverage), 0);
}

TEST_F(ProgramWhitewater, SaysWhatIsWrong) {
  write_files();
  const auto outcome = [&](const std::vector<std::string>& given,
                           const std::string& output = "a.exr") {
    std::vector<std::string> all{"-o", output};
    for (const std::string& one : given) all.insert(all.end(), {"--whitewater", one});
    return run(words(all));
  };
  expect_error(outcome({"mist=white.ply"}), 2, {"mist=white.ply", "must be foam=FILE"});
  expect_error(outcome({"white.ply"}), 2, {"white.ply", "must be foam=FILE"});
  expect_error(outcome({"foam="}), 2, {"foam=", "must be foam=FILE"});
  expect_error(outcome({"foam=white.ply", "foam=water.ply"}), 2, {"foam is given twice"});
  expect_error(outcome({"foam=none.ply"}), 1, {"none.ply"});
  expect_error(outcome({"foam=none.mov"}), 1, {"none.mov: cannot be opened: No such file"});
  expect_error(outcome({"foam=white.ply@kind=1"}), 1, {"white.ply", "kind"});
  expect_error(outcome({"foam=white.ply@id=x"}), 2, {"whitewater white.ply@id=x: wanted a number"});
  expect_error(outcome({"foam=f.####.ply"}), 2, {"foam=f.####.ply is a sequence", "one frame"});
  expect_error(outcome({"foam=white.ply"}, "white.ply"), 2, {"white.ply", "is the input"});
  write("flat.ply", header(1) + "0 0 1 0 0 0 0 0\n");
  expect_error(outcome({"foam=flat.ply"}), 1,
               {"flat.ply", "radius is 0, must be > 0", "--whitewater-radius"});
  write("cut.ply", header(2) + "0 0 1 0 0 0 1 0\n");
  expect_error(outcome({"foam=cut.ply"}), 1, {"cut.ply"});
  EXPECT_FALSE(exists("a.exr"));
  write("none.ply", header(0));
  EXPECT_EQ(outcome({"foam=none.ply"}).exit_code, 0);
  const Outcome idle = outcome({"foam=white.ply"}, "a.obj");
  EXPECT_EQ(idle.exit_code, 0);
  EXPECT_THAT(idle.err, HasSubstr("--whitewater has no effect: no output is an .exr or a .png"));
  write("nan.ply", header(2) + "nan 0 1 0 0 0 1 0\n0 0 1 0 0 0 1 0\n");
  EXPECT_THAT(outcome({"foam=nan.ply"}).err,
              HasSubstr("nan.ply: 1 of 2 particles have NaN or infinite coordinates"));
}

TEST_F(ProgramWhitewater, IsMadeForAFrameOfWater) {
  const std::string water = std::string(MENISCUS_EXAMPLE_DATA) + "/dam/frame_015.ply";
  for (const char* type : {"foam", "spray", "bubble"}) {
    const std::string name = std::string(type) + ".ply";
    const std::vector<std::string> all{"generate",    "--whitewater", type, "--from", water,
                                       "--particles", "5000",         "-o", name,     "-q"};
    run_well(all);
    const std::string first = read(name);
    run_well(all);
    EXPECT_EQ(read(name), first);
    const Particles made = read_particles(path(name));
    EXPECT_EQ(made.size(), 5000u);
    EXPECT_EQ(made.vx.size(), 5000u);
    EXPECT_LT(*std::max_element(made.radius.begin(), made.radius.end()), 0.15 * 0.0251);
  }
  EXPECT_NE(read("foam.ply").substr(300), read("spray.ply").substr(300));
  expect_error(run({"generate", "--whitewater", "mist", "--from", water, "--particles", "10", "-o",
                    "a.ply"}),
               2, {"mist", "foam, spray or bubble"});
  write_particles("still.ply", block(3));
  expect_error(run({"generate", "--whitewater", "foam", "--from", "still.ply", "--particles", "10",
                    "-o", "a.ply"}),
               2, {"velocities"});
}

}  // namespace
}  // namespace meniscus::test
