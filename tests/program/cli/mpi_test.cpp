// The program under mpirun: the bytes of one process, one error line, nobody left behind.
#include <gmock/gmock.h>

#include <algorithm>
#include <array>
#include <chrono>
#include <cmath>
#include <csignal>
#include <filesystem>
#include <thread>

#include "program/cli/program.hpp"
#include "program/dam_break.hpp"

namespace meniscus::test {
namespace {

using testing::AllOf;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;
using testing::Not;
// A frame of enough particles to stream, which thinning thins at this size.
const Words kSmall{"--eye",  "5,2.2,3.4", "--target", "1.5,.3,.75", "--fov",     "32",
                   "--size", "320x240",   "--device", "cpu",        "--threads", "1"};

class UnderMpi : public Program {
 protected:
  void SetUp() override {
#ifndef MENISCUS_MPIRUN
    GTEST_SKIP() << "built without MPI (-DMENISCUS_MPI=ON)";
#endif
  }

  static Conditions ranks([[maybe_unused]] const std::string& count) {
    Conditions conditions;
#ifdef MENISCUS_MPIRUN
    // Open MPI 4: mpirun -q.
    conditions.environment.emplace_back("OMPI_MCA_orte_execute_quiet", "1");
    conditions.launcher = {MENISCUS_MPIRUN,
                           "--allow-run-as-root",
                           "--oversubscribe",
                           "--bind-to",
                           "none",
                           "-n",
                           count};
#endif
    return conditions;
  }

  /// Without the words that mpirun of Open MPI 5, which has no -q, puts between two rules.
  Outcome run(const Words& words, const Conditions& conditions = {}) const override {
    Outcome outcome = Program::run(words, conditions);
    std::string& err = outcome.err;
    for (std::size_t at = 0; (at = err.find("\nprterun ")) != std::string::npos;) {
      const std::size_t begin = at == 0 ? 0 : err.rfind('\n', at - 1) + 1;
      const std::size_t rule = err.find("\n---", at + 1), end = err.find('\n', rule + 1);
      err.erase(begin, end == std::string::npos ? end : end + 1 - begin);
    }
    return outcome;
  }

  /// Positions of a dam's particles.
  static const std::vector<std::array<float, 3>>& dam() {
    static const std::vector<std::array<float, 3>> all = [] {
      std::vector<std::array<float, 3>> points;
      DamBreak(300000, 1).emit([&](std::span<const float> block) {
        for (std::size_t k = 0; k < block.size(); k += 3)
          points.push_back({block[k], block[k + 1], block[k + 2]});
      });
      return points;
    }();
    return all;
  }

  /// A binary PLY of rows of floats.
  template <std::size_t kColumns>
  void write_rows(const std::string& name, const std::string& comment,
                  const std::array<const char*, kColumns>& columns,
                  const std::vector<std::array<float, kColumns>>& rows) const {
    std::string bytes = "ply\nformat binary_little_endian 1.0\n" + comment + "element vertex " +
                        std::to_string(rows.size()) + "\n";
    for (const char* column : columns) bytes += std::string("property float ") + column + "\n";
    bytes += "end_header\n";
    bytes.append(reinterpret_cast<const char*>(rows.data()), rows.size() * sizeof rows[0]);
    write(name, bytes);
  }

  /// The `part`-th of `parts` of a dam, with the extra particles at its end.
  void write_dam(const std::string& name, std::size_t part = 0, std::size_t parts = 1,
                 const std::vector<std::array<float, 3>>& extra = {}) const {
    const auto place = [&](std::size_t k) {
      return dam().begin() + static_cast<std::ptrdiff_t>(dam().size() * k / parts);
    };
    std::vector<std::array<float, 3>> rows(place(part), place(part + 1));
    rows.insert(rows.end(), extra.begin(), extra.end());
    write_rows<3>(name, "comment particle_radius 0.0088\n", {"x", "y", "z"}, rows);
  }

  /// Extracts an EXR and a PLY and returns their bytes.
  std::pair<std::string, std::string> extract(const std::string& input, const Words& options,
                                              const Conditions& conditions) const {
    run_well(Words{"extract", input, "-o", "out.exr", "-o", "out.ply"} + kSmall + options,
             conditions);
    const std::pair<std::string, std::string> found{read("out.exr"), read("out.ply")};
    EXPECT_FALSE(found.first.empty() || found.second.empty());
    std::filesystem::remove(path("out.exr"));
    std::filesystem::remove(path("out.ply"));
    return found;
  }
};

TEST_F(UnderMpi, GivesTheBytesOfOneProcess) {
  write_dam("dam.ply", 0, 1, {{NAN, 0, 0}});
  for (const Words& options : std::vector<Words>{
           {"--method", "fit"}, {"--method", "fit", "--thin", "0"}, {"--method", "ssm"}}) {
    const auto expected = extract("dam.ply", options, {});
    for (const char* count : {"1", "2", "3"})
      EXPECT_EQ(expected, extract("dam.ply", options, ranks(count)))
          << testing::PrintToString(options) << count;
  }
}

TEST_F(UnderMpi, BringsRadiiAndVelocitiesTogether) {
  std::vector<std::array<float, 7>> rows;
  for (const auto& p : dam()) {
    const float radius = 0.0085f + 0.0006f * std::abs(std::sin(1000 * p[0]));
    rows.push_back({p[0], p[1], p[2], std::sin(p[1]), p[2], -p[0], radius});
  }
  for (const std::size_t bad : {60000u, 250000u}) rows[bad][4] = NAN;
  write_rows<7>("dam.ply", "", {"x", "y", "z", "vx", "vy", "vz", "radius"}, rows);
  for (const char* thin : {"4", "0"}) {
    const Words words = Words{"extract", "dam.ply", "--thin", thin} + kSmall;
    const Outcome one = run(words + Words{"-o", "one.exr", "-o", "one.ply"});
    const Outcome three = run_well(words + Words{"-o", "three.exr", "-o", "three.ply"}, ranks("3"));
    EXPECT_EQ(read("one.exr"), read("three.exr")) << thin;
    EXPECT_EQ(read("one.ply"), read("three.ply")) << thin;
    const auto until_written = [](const std::string& text) {
      return text.substr(0, text.find("wrote "));
    };
    EXPECT_EQ(until_written(one.err), until_written(three.err));
    EXPECT_THAT(one.err, HasSubstr("the middle of the file's radii"));
  }
}

// What cannot be used of what particles carry is told by others from anywhere.
TEST_F(UnderMpi, MeshesOneFrameTogether) {
  std::vector<std::array<float, 7>> rows;
  for (const auto& p : dam())
    rows.push_back({p[0], p[1], p[2], std::sin(p[1]), p[2], -p[0], p[0] * p[1]});
  write_rows<7>("dam.ply", "comment particle_radius 0.0088\n",
                {"x", "y", "z", "vx", "vy", "vz", "q"}, rows);
  for (const std::size_t bad : {60000u, 250000u}) rows[bad][4] = NAN;
  write_rows<7>("torn.ply", "comment particle_radius 0.0088\n",
                {"x", "y", "z", "vx", "vy", "vz", "q"}, rows);
  for (const char* input : {"dam.ply", "torn.ply"}) {
    const Words words{"mesh", input, "--attribute", "q", "--device", "cpu"};
    const Outcome one = run_well(words + Words{"-o", "one.ply"});
    for (const char* count : {"2", "3"}) {
      const Outcome made = run_well(words + Words{"-o", "some.ply"}, ranks(count));
      EXPECT_TRUE(read("one.ply") == read("some.ply")) << input << " " << count;
      const auto until_written = [](const std::string& text) {
        return text.substr(0, text.find("wrote "));
      };
      EXPECT_EQ(until_written(one.err), until_written(made.err));
    }
  }
  write_particles("few.ply", block(6), 0.1);
  for (const char* adaptive : {"0", "0.1"}) {
    const Words words{"mesh", "few.ply", "-q", "--adaptive", adaptive};
    run_well(words + Words{"-o", "one.ply"});
    run_well(words + Words{"-o", "some.ply"}, ranks("2"));
    EXPECT_EQ(read("one.ply"), read("some.ply")) << adaptive;
  }
}

TEST_F(UnderMpi, ReadsPartsByRank) {
  write_dam("dam.ply");
  for (std::size_t k = 0; k < 4; ++k)
    write_dam("part" + std::to_string(7 + k) + ".ply", k, 4);  // natural order: 7, 8, 9, 10
  const auto expected = extract("dam.ply", {}, {});
  EXPECT_EQ(expected, extract("part*.ply", {}, {}));
  for (const char* count : {"2", "3"})
    EXPECT_EQ(expected, extract("part*.ply", {}, ranks(count))) << count;
}

TEST_F(UnderMpi, WorksWithFewParticles) {
  write_particles("a.ply", block(6), 0);
  write_particles("b1.ply", block(3));
  write_particles("b2.ply", {{0.1, 0.2, 0.9}, {0, 0, 1.1}});
  for (const char* input : {"a.ply", "b*.ply"}) {
    const Words words{"extract", input, "--size", "64x48"};
    const Outcome one = run(words + Words{"-o", "one.exr"});
    const Outcome three = run_well(words + Words{"-o", "three.exr"}, ranks("3"));
    EXPECT_EQ(read("one.exr"), read("three.exr"));
    EXPECT_THAT(one.err, HasSubstr("found "));
  }
}

TEST_F(UnderMpi, OnlyTheFirstRankSpeaks) {
  write_dam("dam.ply", 0, 1, {{NAN, 0, 0}, {0, INFINITY, 0}});
  const Words words = Words{"extract", "dam.ply", "-o", "a.exr", "--timings"} + kSmall;
  const Outcome one = run(words), two = run(words, ranks("2"));
  EXPECT_EQ(two.exit_code, 0);
  const auto without_time = [](std::string text) { return text.substr(0, text.rfind("total ")); };
  EXPECT_EQ(without_time(one.err), without_time(two.err));
  EXPECT_THAT(two.err,
              HasSubstr("2 of 300002 particles have NaN or infinite coordinates (the first is "
                        "particle 300000) and were dropped"));
  EXPECT_THAT(one.out, Not(HasSubstr("rank")));
  EXPECT_THAT(two.out, AllOf(HasSubstr("\nrank "), HasSubstr("\n0  "), HasSubstr("\n1  "),
                             Not(HasSubstr("\n2  "))));
}

TEST_F(UnderMpi, EndsWithOneErrorWhereverItIs) {
  write_dam("dam.ply");
  for (std::size_t k = 0; k < 3; ++k) write_dam("part" + std::to_string(k) + ".ply", k, 3);
  const std::string whole = read("part1.ply");
  write("part1.ply", whole.substr(0, whole.size() - 100));
  const Words one = Words{"extract", "part*.ply", "-o", "a.exr"} + kSmall;
  expect_error(run(one, ranks("3")), 1, {"part1.ply", "truncated", "(rank 1 on "});
  expect_error(run({"extract", "gone.ply", "-o", "a.exr"}, ranks("2")), 1, {"gone.ply"});
  expect_error(run({"extract", "dam.ply", "-o", "gone/a.exr"}, ranks("2")), 1, {"gone/a.exr"});
  expect_error(run({"extract", "dam.ply", "-o", "a.txt"}, ranks("2")), 2, {"a.txt"});
  // A device that only rank 1 asks for.
  const Words good = Words{"extract", "dam.ply", "-o", "a.exr"} + kSmall;
  expect_error(run(good + Words{":", "-n", "1", MENISCUS_PROGRAM, "extract", "dam.ply", "-o",
                                "a.exr", "--device", "none such"},
                   ranks("1")),
               1, {"\"none such\"", "(rank 1 on "});
  // Rank 0 alone works on few particles; the other waits for it.
  write_particles("few.ply", {{0, 0, 0}, {NAN, 0, 0}});
  expect_error(run({"extract", "few.ply", "-o", "a.exr", "--strict"}, ranks("2")), 1,
               {"few.ply: 1 of 2 particles have NaN"});
  EXPECT_THAT(files(), ElementsAre("dam.ply", "few.ply", "part0.ply", "part1.ply", "part2.ply"));
}

TEST_F(UnderMpi, LeavesNothingWhenItIsStopped) {
  write_dam("dam.ply");
  // mpirun gives its processes a second to end by themselves, and then kills them: here three,
  // since tests run side by side, and the frame is to take longer.
  Conditions patient = ranks("2");
  patient.launcher.insert(patient.launcher.end(), {"--mca", "odls_base_sigkill_timeout", "3"});
  Words words = Words{"extract", "dam.ply", "-o", "a.exr", "-o", "a.png"} + kSmall;
  std::replace(words.begin(), words.end(), std::string("320x240"), std::string("3200x2400"));
  int stopped = 0;
  for (const int milliseconds : {300, 700, 1200, 2000}) {
    const int process = start(words, patient);
    std::this_thread::sleep_for(std::chrono::milliseconds(milliseconds));
    kill(process, SIGTERM);
    const Outcome outcome = wait_for(process);
    if (exists("a.exr")) {  // had ended: nothing was stopped
      for (const char* name : {"a.exr", "a.png"}) std::filesystem::remove(path(name));
      continue;
    }
    ++stopped;
    EXPECT_NE(outcome.exit_code, 0);
    EXPECT_THAT(files(), ElementsAre("dam.ply"));
  }
  EXPECT_GT(stopped, 0);
}

TEST_F(UnderMpi, SharesASequenceOutByFrames) {
  for (int frame = 1; frame <= 3; ++frame)
    write_particles("in." + std::to_string(frame) + ".ply", block(2 + frame));
  const Words words{"extract", "in.#.ply", "-o",    "out.#.exr",
                    "--size",  "64x48",    "--log", "log.jsonl"};
  run_well(words, ranks("2"));
  EXPECT_THAT(files(), ElementsAre("in.1.ply", "in.2.ply", "in.3.ply", "log.1.jsonl", "log.jsonl",
                                   "out.1.exr", "out.2.exr", "out.3.exr"));
  const std::string log = read("log.jsonl") + read("log.1.jsonl");
  for (const char* part :
       {"\"shard\":\"1/2\"", "\"shard\":\"2/2\"", "\"frame\":1", "\"frame\":2", "\"frame\":3"})
    EXPECT_THAT(log, HasSubstr(part));
  EXPECT_EQ(std::count(log.begin(), log.end(), '\n'), 3);
  for (int frame = 1; frame <= 3; ++frame)
    std::filesystem::remove(path("out." + std::to_string(frame) + ".exr"));
  run_well(words + Words{"--shard", "2/2"}, ranks("2"));  // both of one shard
  EXPECT_FALSE(exists("out.1.exr"));
  EXPECT_TRUE(exists("out.2.exr"));
  EXPECT_FALSE(exists("out.3.exr"));
  expect_error(run(words + Words{"--report", "page.html"}, ranks("2")), 2, {"--report"});
  // One bad frame is named by the process that met it.
  write("in.2.ply", "nonsense");
  const Outcome bad = run(words, ranks("2"));
  EXPECT_EQ(bad.exit_code, 3) << bad.err;
  EXPECT_THAT(bad.err, HasSubstr("error: 1 of 1 frame failed: 2"));
}

// Without its module beside it the program is what a build without MPI makes.
TEST_F(Program, RefusesToDoTheWorkOfSeveralManyTimes) {
  write_particles("in.ply", block(4));
  std::filesystem::copy(MENISCUS_PROGRAM, path("lone"));
  const Words words{"extract", "in.ply", "-o", "a.exr", "--size", "64x48"};
  Conditions conditions;
  conditions.program = path("lone");
  const auto started_as = [&](const char* rank, const char* size) {
    conditions.environment = {{"OMPI_COMM_WORLD_RANK", rank}, {"OMPI_COMM_WORLD_SIZE", size}};
    return run(words, conditions);
  };
  expect_error(started_as("0", "3"), 1,
               {"started by mpirun or srun as 3 processes", "-DMENISCUS_MPI=ON"});
  EXPECT_FALSE(exists("a.exr"));
  EXPECT_EQ(started_as("0", "1").exit_code, 0);
  EXPECT_TRUE(exists("a.exr"));
}

}  // namespace
}  // namespace meniscus::test
