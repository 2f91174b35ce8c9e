// One frame, whose device fails.
#include "faults/faulty_runtime.hpp"

namespace meniscus::test {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;
using testing::Not;

class FaultyFrame : public FaultyRuntime {
 protected:
  static std::vector<std::string> words(const std::string& stem) {
    return {"extract", "in.ply", "--size", "64x48", "-o", stem + ".exr", "-o", stem + ".ply"};
  }
};

TEST_F(FaultyFrame, IsExtractedAgainWhenMemoryRanOutOnce) {
  write_particles("in.ply", block(4));
  run_well(words("a"));
  const Outcome outcome =
      run_well(words("b"), failing({{"MENISCUS_FAIL_CALL", "clEnqueueNDRangeKernel:5"}}));
  EXPECT_THAT(outcome.err, HasSubstr("meniscus: warning: in.ply: extracted again in smaller "
                                     "chunks after: "));
  EXPECT_EQ(read("b.exr"), read("a.exr"));
  EXPECT_EQ(read("b.ply"), read("a.ply"));
}

TEST_F(FaultyFrame, WarnsOnceThoughItIsExtractedTwice) {
  write_particles("in.ply", block(12), 1);
  const Outcome outcome =
      run_well(words("b"), failing({{"MENISCUS_FAIL_CALL", "clEnqueueNDRangeKernel:5"}}));
  const auto first = outcome.err.find("would fit (check --particle-radius)");
  EXPECT_LT(first, outcome.err.find("extracted again in smaller chunks"));
  EXPECT_EQ(outcome.err.find("would fit", first + 1), std::string::npos) << outcome.err;
}

TEST_F(FaultyFrame, AsksForABufferAgain) {
  write_particles("in.ply", block(4));
  run_well(words("a"));
  const Outcome outcome =
      run_well(words("b"), failing({{"MENISCUS_FAIL_CALL", "clCreateBuffer:3"}}));
  EXPECT_THAT(outcome.err, Not(HasSubstr("warning")));
  EXPECT_EQ(read("b.exr"), read("a.exr"));
  EXPECT_EQ(read("b.ply"), read("a.ply"));
}

TEST_F(FaultyFrame, ThatNeverHasMemoryIsOneErrorAndNoFile) {
  write_particles("in.ply", block(4));
  const Outcome outcome = run(words("a"), failing({{"MENISCUS_FAIL_CALL", "clCreateBuffer:20+"}}));
  expect_error(outcome, 1,
               {"clCreateBuffer failed with CL_MEM_OBJECT_ALLOCATION_FAILURE (-4)", " in stage ",
                "out of memory (use a smaller image"});
  EXPECT_THAT(files(), ElementsAre("in.ply"));
}

TEST_F(FaultyFrame, ThatFailsInAnotherWayIsNotTriedAgain) {
  write_particles("in.ply", block(4));
  const Outcome outcome = run(
      words("a"),
      failing({{"MENISCUS_FAIL_CALL", "clEnqueueNDRangeKernel:5"}, {"MENISCUS_FAIL_CODE", "-54"}}));
  expect_error(outcome, 1,
               {"clEnqueueNDRangeKernel failed with CL_INVALID_WORK_GROUP_SIZE (-54)", " in stage ",
                "try another --device"});
  EXPECT_THAT(files(), ElementsAre("in.ply"));
}

// The first attempt's chunks take 16 MB, an eighth of them and the few particles in view do not.
TEST_F(FaultyFrame, ThatStreamsFitsIntoLessMemory) {
  run_well({"generate", "--particles", "300000", "-o", "in.ply"});
  const auto extract = [](const std::string& output) {
    return std::vector<std::string>{
        "extract",  "in.ply",    "--size", "64x48", "--method", "ssm", "--eye", "0,3,0",
        "--target", "0.2,0,0.2", "--fov",  "6",     "--memory", "24M", "-o",    output};
  };
  run_well(extract("a.exr"));
  const Outcome outcome =
      run_well(extract("b.exr"), failing({{"MENISCUS_DEVICE_MEMORY", "8000000"}}));
  EXPECT_THAT(outcome.err, HasSubstr("extracted again in smaller chunks"));
  EXPECT_EQ(read("b.exr"), read("a.exr"));
}

TEST_F(FaultyFrame, ABuildThatFailsSaysSo) {
  write_particles("in.ply", block(4));
  const Outcome outcome = run(words("a"), failing({{"MENISCUS_FAIL_CALL", "clBuildProgram:1+"}}));
  expect_error(outcome, 1,
               {"building density.cl on ",
                " in stage field: clBuildProgram failed with "
                "CL_BUILD_PROGRAM_FAILURE (-11)"});
}

}  // namespace
}  // namespace meniscus::test
