// What `meniscus bench` prints and writes.
#include <gmock/gmock.h>

#include <nlohmann/json.hpp>
#include <set>

#include "meniscus/io.hpp"
#include "meniscus/parameters.hpp"
#include "program/cli/program.hpp"

namespace meniscus::test {
namespace {

using nlohmann::json;
using testing::HasSubstr;

class ProgramBench : public Program {
 protected:
  json measured(std::vector<std::string> more) const {
    const Outcome outcome =
        run_well(Words{"bench", "frame", "--seconds", "0", "--json", "figures.json"} + more);
    table_ = outcome.out;
    return json::parse(read("figures.json"));
  }
  mutable std::string table_;
};

TEST_F(ProgramBench, FramesOfEveryMethodWithTheirStagesAndMemory) {
  write_particles("in.ply", block(5));
  const json root = measured({"in.ply", "--size", "64x48"});
  EXPECT_FALSE(root["device"].get<std::string>().empty());
  std::set<std::string> methods, wanted;
  for (const MethodEntry& entry : method_list()) wanted.insert(entry.name);
  for (const json& f : root["results"]) {
    const std::string method = f["method"];
    SCOPED_TRACE(method);
    methods.insert(method);
    EXPECT_EQ(f["particles"], 125);
    EXPECT_EQ(f["streamed"], false);
    EXPECT_EQ(f["width"], 64);
    EXPECT_EQ(f["height"], 48);
    EXPECT_GT(f["pixels"], 0);
    EXPECT_GE(f["frames"], 5);
    EXPECT_GT(f["frames_per_second"], 0);
    EXPECT_GT(f["cpu_ms"], 0);
    EXPECT_GT(f["first_ms"], 0);
    EXPECT_GT(f["least_ms"], 0);
    EXPECT_LE(f["least_ms"], f["p10_ms"]);
    EXPECT_LE(f["p10_ms"], f["median_ms"]);
    EXPECT_LE(f["median_ms"], f["p90_ms"]);
    EXPECT_GT(f["stages"]["project"], 0);
    const auto sum = [](const json& times) {
      double ms = 0;
      for (const json& each : times) ms += each.get<double>();
      return ms;
    };
    double kernels = 0;
    for (const json& stage : f["kernels"]) kernels += sum(stage);
    EXPECT_GT(kernels, 0);
    EXPECT_LE(sum(f["device_stages"]), sum(f["stages"]));
    EXPECT_GE(f["device_bytes"], 64 * 48 * (4 + 12));    // depth and normals at the least
    EXPECT_GT(f["host_bytes"], 1 << 20);                 // a program
    EXPECT_LT(f["host_bytes"], std::int64_t{16} << 30);  // bytes and not kibibytes or so
    EXPECT_THAT(table_, HasSubstr("\n" + method + " "));
  }
  EXPECT_EQ(methods, wanted);
}

TEST_F(ProgramBench, FramesWithLayersStandBesideThoseWithout) {
  write_particles("in.ply", block(5));
  const json results =
      measured({"in.ply", "--method", "fit", "--size", "64x48", "--layers", "0,2"})["results"];
  ASSERT_EQ(results.size(), 2u);
  EXPECT_EQ(results[0]["layers"], 0);
  EXPECT_EQ(results[1]["layers"], 2);
  EXPECT_FALSE(results[0]["stages"].contains("layers"));
  EXPECT_GT(results[1]["stages"]["layers"], 0);
  EXPECT_THAT(table_, HasSubstr("\nfit, 2 layers "));
  const Outcome wrong = run({"bench", "frame", "--layers", "0,9"});
  EXPECT_EQ(wrong.exit_code, 2);
  EXPECT_THAT(wrong.err, HasSubstr("--layers is 0,9, must be numbers from 0 to 8, e.g. 0,2"));
  EXPECT_EQ(run({"bench", "frame", "--layers", ""}).exit_code, 2);
}

TEST_F(ProgramBench, TheBuiltInFrameIsTheExampleOfTheDam) {
  const json built_in = measured({"--method", "spheres", "--size", "128x96"})["results"][0];
  const std::string dam = MENISCUS_EXAMPLE_DATA "/dam/";
  const json given = measured({dam + "frame_015.ply", "--camera", dam + "camera.json", "--method",
                               "spheres", "--size", "128x96"})["results"][0];
  EXPECT_EQ(built_in["particles"], 35937);
  for (const char* key : {"particles", "pixels"}) EXPECT_EQ(built_in[key], given[key]) << key;
  // A driver lets go of a command's buffers a little after it, under load later than the next
  // command's are made, which moves the peak by some of the particles' buffers, of 16 bytes a
  // particle.
  EXPECT_NEAR(built_in["device_bytes"].get<double>(), given["device_bytes"].get<double>(),
              2 * 16 * 35937.0);
}

TEST_F(ProgramBench, SyntheticFramesOfEverySize) {
  const json results =
      measured({"--particles", "1e3,4000", "--size", "64x48,100x50", "--method", "ssm"})["results"];
  std::vector<std::pair<int, int>> sizes;  // in thousands of particles, width
  for (const json& f : results)
    sizes.emplace_back(std::lround(f["particles"].get<double>() / 1000), f["width"]);
  EXPECT_THAT(sizes, testing::ElementsAre(std::pair{1, 64}, std::pair{1, 100}, std::pair{4, 64},
                                          std::pair{4, 100}));
}

TEST_F(ProgramBench, LargeFilesStreamAndTheirFramesHaveTheReading) {
  run_well({"generate", "--particles", "300000", "-o", "large.ply", "-q"});
  const json f =
      measured({"large.ply", "--method", "ssm", "--frames", "1", "--memory", "32M"})["results"][0];
  EXPECT_NEAR(f["particles"].get<double>(), 300000, 300);
  EXPECT_EQ(f["streamed"], true);
  EXPECT_EQ(f["frames"], 1);
  EXPECT_THAT(table_, HasSubstr("with reading the file"));
}

TEST_F(ProgramBench, JsonGoesToStandardOutputAlone) {
  const Outcome outcome =
      run_well({"bench", "frame", "--seconds", "0", "--frames", "1", "--method", "spheres",
                "--particles", "1000", "--size", "64x48", "--json", "-"});
  EXPECT_EQ(json::parse(outcome.out)["results"].size(), 1u);
  EXPECT_THAT(files(), testing::IsEmpty());
}

TEST_F(ProgramBench, SaysWhichInputIsMissing) {
  expect_error(run({"bench", "frame", "none.ply"}), 1, {"none.ply"});
  EXPECT_FALSE(exists("figures.json"));
}

}  // namespace
}  // namespace meniscus::test
