// What `meniscus tune` says, and that later runs go by it.
#include <gmock/gmock.h>

#include "cli/program.hpp"

namespace meniscus::test {
namespace {

using testing::AllOf;
using testing::HasSubstr;

using ProgramTune = Program;

TEST_F(ProgramTune, MeasuresKeepsAndForgets) {
  const Conditions conditions{.environment = {{"MENISCUS_CACHE_DIR", "cache"}}};
  const Outcome tuned = run({"tune", "--device", "cpu", "--rounds", "1", "-q"}, conditions);
  EXPECT_EQ(tuned.exit_code, 0) << tuned.err;
  EXPECT_THAT(tuned.out, AllOf(HasSubstr("width 1, groups of 64"), HasSubstr("(default)"),
                               HasSubstr("kept: width ")));
  EXPECT_EQ(tuned.err, "");
  const Outcome forgotten = run({"tune", "--device", "cpu", "--forget"}, conditions);
  EXPECT_EQ(forgotten.exit_code, 0) << forgotten.err;
  EXPECT_THAT(forgotten.out, HasSubstr("forgotten: width 8, groups of 64 from now on"));
}

TEST_F(ProgramTune, SaysWhatIsWrong) {
  expect_error(run({"tune", "--rounds", "0"}), 2, {"--rounds"});
  expect_error(run({"tune", "--device", "no such"}), 1, {"no usable OpenCL device matches"});
}

}  // namespace
}  // namespace meniscus::test
