// Sequences that are shared out: shards, tasks of Slurm arrays, and several devices.
#include <gmock/gmock.h>

#include <filesystem>

#include "program/cli/sequence_frames.hpp"

namespace meniscus::test {
namespace {

namespace fs = std::filesystem;
using testing::HasSubstr;
using testing::IsEmpty;
using testing::Not;

TEST_F(Sequence, ShardsTogetherAreTheWhole) {
  write_sequence(5);
  run_well(words({"-q"}));
  const auto whole = outputs();
  for (const auto& [file, bytes] : whole) fs::remove(path(file));
  run_well(words({"-q", "--shard", "1/2"}));
  EXPECT_EQ(outputs().size(), 9u);
  const Conditions task{{{"SLURM_ARRAY_TASK_ID", "7"},
                         {"SLURM_ARRAY_TASK_COUNT", "2"},
                         {"SLURM_ARRAY_TASK_MIN", "6"}}};
  const Outcome second = run_well(words(), task);
  EXPECT_THAT(second.err, HasSubstr("2 of 2 of 5 frames, from SLURM_ARRAY_TASK_ID"));
  Conditions sparse = task;
  sparse.environment[0].second = "9";
  expect_error(run(words(), sparse), 2, {"SLURM_ARRAY_TASK_ID is 9", "gaps", "--shard k/N"});
  EXPECT_EQ(outputs(), whole);
}

// --array=1,3 has two tasks; to the first of them it looks like --array=1,2 but for the maximum.
TEST_F(Sequence, EachTaskOfAnArrayWithGapsIsRefused) {
  write_sequence(2);
  for (const char* id : {"1", "3"})
    expect_error(run(words(), {{{"SLURM_ARRAY_TASK_ID", id},
                                {"SLURM_ARRAY_TASK_COUNT", "2"},
                                {"SLURM_ARRAY_TASK_MIN", "1"},
                                {"SLURM_ARRAY_TASK_MAX", "3"}}}),
                 2, {std::string("SLURM_ARRAY_TASK_ID is ") + id, "gaps"});
  EXPECT_THAT(outputs(), IsEmpty());
}

TEST_F(Sequence, ALaterTaskOnItsOwnWarnsThatItDoesAllFrames) {
  write_sequence(3);
  Conditions alone{{{"SLURM_ARRAY_TASK_ID", "2"},
                    {"SLURM_ARRAY_TASK_COUNT", "1"},
                    {"SLURM_ARRAY_TASK_MIN", "2"},
                    {"SLURM_ARRAY_TASK_MAX", "2"}}};
  EXPECT_THAT(run_well(words(), alone).err,
              HasSubstr("warning: task 2 is the only one of its Slurm array and does all frames"));
  EXPECT_THAT(run_well(words({"--shard", "slurm"}), alone).err, Not(HasSubstr("warning")));
  alone.environment[0].second = alone.environment[2].second = alone.environment[3].second = "1";
  EXPECT_THAT(run_well(words(), alone).err, Not(HasSubstr("warning")));
}

TEST_F(Sequence, FramesInATaskOfAnArrayAreSplitOnlyWhereThatIsSaid) {
  write_sequence(4);
  const Conditions task{{{"SLURM_ARRAY_TASK_ID", "2"},
                         {"SLURM_ARRAY_TASK_COUNT", "4"},
                         {"SLURM_ARRAY_TASK_MIN", "0"}}};
  expect_error(run(words({"--frames", "2"}), task), 2,
               {"--frames 2 in task 2", "--shard 1/1", "--shard slurm"});
  EXPECT_THAT(outputs(), IsEmpty());
  run_well(words({"--frames", "2", "--shard", "1/1"}), task);
  EXPECT_TRUE(exists("o.0002.exr"));
  EXPECT_EQ(outputs().size(), 3u);
  run_well(words({"--frames", "1-3", "--shard", "slurm"}), task);
  EXPECT_TRUE(exists("o.0003.exr"));  // the third of them
  EXPECT_EQ(outputs().size(), 6u);
  expect_error(run(words({"--shard", "slurm"}),
                   {{{"SLURM_ARRAY_TASK_ID", ""}, {"SLURM_ARRAY_TASK_COUNT", ""}}}),
               2, {"--shard slurm: SLURM_ARRAY_TASK_ID"});
}

TEST_F(Sequence, TwoDevicesGiveTheSameBytes) {
  write_sequence(5);
  run_well(words({"-q"}));
  const auto one = outputs();
  for (const auto& [file, bytes] : one) fs::remove(path(file));
  const Conditions two{{{"POCL_DEVICES", "pthread pthread"}}};
  // PoCL 3.1 may abort when two of its devices build the same kernel at once for the first time
  // (docs/portability.md), so that each has built all by itself before.
  for (const char* device : {"0", "1"}) {
    run_well(words({"-q", "--device", device, "--in-flight", "1"}), two);
    EXPECT_EQ(outputs(), one);
    for (const auto& [file, bytes] : one) fs::remove(path(file));
  }
  run_well(words({"--device", "all", "--log", "log.jsonl"}), two);
  EXPECT_EQ(outputs(), one);
}

}  // namespace
}  // namespace meniscus::test
