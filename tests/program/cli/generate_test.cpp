// meniscus generate, as a user runs it.
#include <gmock/gmock.h>

#include "meniscus/extract.hpp"
#include "program/cli/program.hpp"
#include "program/dam_break.hpp"

namespace meniscus::test {
namespace {

using testing::ElementsAre;
using testing::IsEmpty;

using ProgramGenerate = Program;

TEST_F(ProgramGenerate, WritesTheParticlesAndTheirRadius) {
  run_well({"generate", "--particles", "40000", "--seed", "5", "-o", "dam.ply"});
  const Particles particles = read_particles(path("dam.ply"));
  const DamBreak dam(40000, 5);
  std::vector<float> expected, found;
  dam.emit([&](std::span<const float> block) {
    expected.insert(expected.end(), block.begin(), block.end());
  });
  for (std::size_t i = 0; i < particles.size(); ++i)
    found.insert(found.end(), {particles.x[i], particles.y[i], particles.z[i]});
  EXPECT_EQ(found, expected);
  // Nine digits name a float.
  EXPECT_FLOAT_EQ(static_cast<float>(particles.particle_radius),
                  static_cast<float>(dam.particle_radius()));
}

TEST_F(ProgramGenerate, MakesParticlesWhoseDisorderIsTold) {
  ASSERT_EQ(run({"generate", "--particles", "8000", "--noise", "0.29", "-o", "dam.ply"}).exit_code,
            0);
  const std::vector<std::string> extract{"extract", "dam.ply", "-o", "dam.exr", "--size", "64x48"};
  EXPECT_THAT(run(extract).err, testing::HasSubstr(" of 2, found: particles are evened out"));
  std::vector<std::string> given = extract;
  given.insert(given.end(), {"--disorder", "0.5"});
  EXPECT_THAT(run(given).err, testing::HasSubstr("0.50 of 2, given"));
  const std::vector<std::string> mesh{"mesh", "dam.ply", "-o", "mesh.ply"};
  EXPECT_THAT(run(mesh).err, testing::HasSubstr("disorder   1."));
  given = mesh;
  given.insert(given.end(), {"--disorder", "0.5"});
  EXPECT_THAT(run(given).err, testing::HasSubstr("0.50 of 2, given"));
}

TEST_F(ProgramGenerate, TakesRoundNumbersInShort) {
  run_well({"generate", "--particles", "1e3", "-o", "short.ply", "-q"});
  run_well({"generate", "--particles", "1000", "-o", "long.ply", "-q"});
  EXPECT_EQ(read("short.ply"), read("long.ply"));
}

TEST_F(ProgramGenerate, RefusesWhatItCannotMake) {
  for (const char* count : {"9", "1e10", "12.5", "-3", "many", "1e3x", "nan"})
    expect_error(run({"generate", "--particles", count, "-o", "dam.ply"}), 2,
                 {"--particles", count, "10 to 1000000000"});
  for (const char* name : {"dam.vtk", "dam.bgeo", "dam"})
    expect_error(run({"generate", "--particles", "100", "-o", name}), 2, {name, ".ply"});
  expect_error(run({"generate", "--particles", "100", "--noise", "2", "-o", "dam.ply"}), 2,
               {"--noise is 2", "0 to 1"});
  expect_error(run({"generate", "--particles", "100", "-o", "no/dam.ply"}), 1, {"no/dam.ply"});
  EXPECT_THAT(files(), IsEmpty());
}

TEST_F(ProgramGenerate, LeavesNothingWhenTheDiskIsFull) {
  Conditions conditions;
  conditions.file_size_limit = 1 << 20;
  expect_error(run({"generate", "--particles", "1e6", "-o", "dam.ply"}, conditions), 1,
               {"dam.ply", "cannot be written"});
  EXPECT_THAT(files(), IsEmpty());
}

TEST_F(ProgramGenerate, ALargeFrameStreamsToTheSameBytes) {
  run_well({"generate", "--particles", "280000", "-o", "dam.ply", "-q"});
  const std::vector<std::string> extract{"extract", "dam.ply", "--size", "200x150", "-q"};
  const auto with = [&](std::vector<std::string> more) {
    more.insert(more.begin(), extract.begin(), extract.end());
    return run(more);
  };
  ASSERT_EQ(with({"-o", "a.exr", "-o", "a.ply"}).exit_code, 0);
  ASSERT_EQ(with({"-o", "b.exr", "-o", "b.ply", "--memory", "2M"}).exit_code, 0);
  EXPECT_EQ(read("a.exr"), read("b.exr"));
  EXPECT_EQ(read("a.ply"), read("b.ply"));
  expect_error(with({"-o", "c.png", "--memory", "1K"}), 1, {"--memory is 1024 bytes", "at least"});
}

TEST_F(ProgramGenerate, ALargeFileThatIsCutSaysWhere) {
  run_well({"generate", "--particles", "280000", "-o", "dam.ply", "-q"});
  const std::string bytes = read("dam.ply");
  write("cut.ply", bytes.substr(0, bytes.size() - 5));
  expect_error(run({"extract", "cut.ply", "-o", "out.png"}), 1, {"cut.ply", "truncated"});
}

}  // namespace
}  // namespace meniscus::test
